"""What stands at the end of a line of sight hides what is behind it from the water before it.

Water scatters forward: much of the light that it adds to a line of sight comes from a narrow cone about the line's own
direction. Where the line ends at a ball, a bracket or a mirror, that cone shows, near the end, the same surface and not
what is around it. So a share k of what is scattered comes from that surface itself: its light dies off with
``c - k b`` instead of c, and of the water's own light the share is missing. The surface counts as a disc across the
line, and the share is the mean over lines that end on it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import Float32, UInt32, dr
from optics.kernels.packing import between, pairs_of

NODES = 65
SHORTEST, LONGEST = 2.0**-4, 2.0**12
"""Lengths over radius, at nodes that are even in their logarithm."""

ROW = 2

RINGS, AROUND, OFFSETS = 96, 16, 8
"""Points at which the phase function, and lines that end on a disc, are taken."""


def forward_cone_table(shares: FloatArray) -> Any:
    """Table of `hidden_share` from `hidden_shares`."""
    return pairs_of(shares[:, np.newaxis], ROW)


def lengths_over_radius() -> FloatArray:
    """Nodes of the table."""
    return np.geomspace(SHORTEST, LONGEST, NODES)


def hidden_shares(phase: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Share of the scattered light that comes from a disc at the end of a line, on the mean over line and disc.

    At the nodes of `lengths_over_radius`, for a phase function of the scattering angle in radians, 1/sr.
    """
    edges = np.concatenate([[0], np.geomspace(SHORTEST / 64, LONGEST, 2 * NODES)])
    distance = (edges[:-1] + edges[1:]) / 2
    share = np.array([_share_from(each, phase) for each in distance])
    whole = np.concatenate([[0], np.cumsum(share * np.diff(edges))])
    nodes = lengths_over_radius()
    return np.asarray(np.interp(nodes, edges, whole) / nodes)


def _share_from(distance: float, phase: Callable[[FloatArray], FloatArray]) -> float:
    """Share that comes from the disc, at a distance in its radii before it."""
    ring = np.concatenate([[0], np.geomspace(1e-3, np.pi, RINGS)])
    angle = (ring[:-1] + ring[1:]) / 2
    weight = phase(angle) * (np.cos(ring[:-1]) - np.cos(ring[1:]))
    offset = np.sqrt((np.arange(OFFSETS) + 0.5) / OFFSETS)[:, np.newaxis, np.newaxis]
    around = np.arange(AROUND) * (2 * np.pi / AROUND)
    reach = distance * np.tan(np.minimum(angle, np.pi / 2 - 1e-6))[:, np.newaxis]
    inside = (offset + reach * np.cos(around)) ** 2 + (reach * np.sin(around)) ** 2 < 1
    seen = np.where(angle < np.pi / 2, inside.mean(axis=(0, 2)), 0)
    return float(seen @ weight / weight.sum())


def gain_of_light(scattering: Any, length: Any, share: Any) -> Any:
    """Kernel: what a surface's light gains on a line that ends at it, over what arrives unscattered.

    It is ``exp(k b r) - 1`` to second order; the exponent is small, since the share k falls off with length.
    """
    exponent = scattering * length * share
    return exponent * dr.fma(exponent, 0.5, 1)


def hidden_share(table: Any, length: Any, radius: Any) -> Any:
    """Kernel: share of the light scattered along lines that comes from what they end at; 0 where that has no radius."""
    steps = (NODES - 1) / np.log2(LONGEST / SHORTEST)
    position = dr.log2(length / dr.maximum(radius, 1e-6)) * steps - np.log2(SHORTEST) * steps
    position = dr.clip(position, 0, NODES - 1)
    node = dr.minimum(UInt32(position), NODES - 2)
    share = between(table, node, position - Float32(node), ROW)[0]
    return dr.select(radius > 0, share, 0)
