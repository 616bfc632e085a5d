"""The edges of the gaze mirror in the image: refraction bends them, where the paper draws a quadrilateral."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.status import Status
from optics.train import OpticalTrain
from rigs import Rig

POINTS_PER_EDGE = 201
"""Odd, so that the middle, where a bent edge is farthest from its chord, is among them."""


@dataclass(frozen=True, kw_only=True)
class MirrorEdge:
    """One edge of M2 in the image, as M1 and the port show it.

    Attributes
    ----------
    pixels : array, shape (k, 2)
        From corner to corner, evenly spaced on the mirror; NaN where there is no pixel. Points that M1's edge or the
        image's border cuts off keep the pixel at which they would appear.
    visible : array of bool, shape (k,)
        Whether the camera sees that point.
    deviation_px : float
        Largest distance of the edge from its chord, the straight line between its corners; NaN without corners.
    """

    pixels: FloatArray
    visible: np.ndarray[tuple[int], np.dtype[np.bool_]]
    deviation_px: float


def mirror_edges(rig: Rig, *, q1: float = 0.0, q2: float = 0.0, count: int = POINTS_PER_EDGE) -> tuple[MirrorEdge, ...]:
    """Edges of the gaze mirror in the image: bottom, right, top, left in the mirror's own frame.

    The outline of M2 is seen through the port and over M1 alone, so it is projected by the train without M2.
    """
    rig.require_gaze()
    train = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
    corners = train.mirrors[1].corners_m
    along = np.linspace(0, 1, count)[:, np.newaxis]
    before = replace(train, mirrors=train.mirrors[:1])
    edges = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        image = before.project(start + along * (end - start))
        edges.append(
            MirrorEdge(
                pixels=image.pixels, visible=image.status == Status.OK, deviation_px=_off_its_chord(image.pixels)
            )
        )
    return tuple(edges)


def _off_its_chord(pixels: FloatArray) -> float:
    chord = pixels[-1] - pixels[0]
    offset = pixels - pixels[0]
    distance = np.abs(offset[:, 0] * chord[1] - offset[:, 1] * chord[0]) / np.hypot(*chord)
    return float(distance.max())
