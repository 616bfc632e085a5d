"""The sphere of directions in cells of equal solid angle: HEALPix, ring scheme.

Gorski et al. 2005, ApJ 622, 759 (section 5.1): 12 nside^2 cells on 4 nside - 1 rings of constant elevation, numbered
from the zenith down and, along a ring, from azimuth zero (the body's x) to the left. Colatitude is counted from the
body's z, so the numbers here are those of healpy's `ang2pix(nside, azimuth, elevation, lonlat=True)`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.kernels.arrays import FloatArray, check_points, opaque, to_columns
from optics.kernels.backend import Array3f64, Float64, Int32, UInt32, dr

LARGEST_NSIDE = 1024
"""Cells 0.06 degrees wide; numbers of cells and their products fit 32 bits."""

CAP_HEIGHT = 1 / 3
"""1 - |z| at which the polar caps begin (section 4: |z| > 2/3)."""


def check_nside(nside: int) -> None:
    """Raise a `ValueError` unless `nside` is a power of two that the kernels can number."""
    if not 1 <= nside <= LARGEST_NSIDE or nside & (nside - 1):
        raise ValueError(f"expected nside to be a power of two from 1 to {LARGEST_NSIDE}, got {nside}")


def cell_count(nside: int) -> int:
    """Number of cells."""
    check_nside(nside)
    return 12 * nside * nside


def cell_solid_angle_sr(nside: int) -> float:
    """Solid angle of each cell."""
    return 4 * np.pi / cell_count(nside)


def cell_directions(nside: int) -> FloatArray:
    """Unit vectors to the centres of all cells, shape (12 nside^2, 3), body frame."""
    ring, place, length, offset = _rings(nside)
    # Eqs. 4 and 8: z over the cap's rings, and over those of the equatorial belt.
    from_pole = np.minimum(ring, 4 * nside - ring)
    z = np.where(
        from_pole < nside,
        np.sign(2 * nside - ring) * (1 - from_pole**2 / (3 * nside**2)),
        2 * (2 * nside - ring) / (3 * nside),
    )
    # Eqs. 5 and 9: a ring's first centre is half a step from azimuth zero, or every other one in the belt on it.
    azimuth = 2 * np.pi * (place + offset) / length
    # 1 - z^2 would lose digits at the poles.
    radius = np.where(from_pole < nside, from_pole * np.sqrt((1 + np.abs(z)) / 3) / nside, np.sqrt(1 - z * z))
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], axis=1)


def cells_of(directions: ArrayLike, nside: int) -> NDArray[np.int64]:
    """Cells that unit vectors, shape (n, 3), body frame, lie in; shape (n,)."""
    directions = check_points("directions", directions, 3)
    check_nside(nside)
    if not len(directions):
        return np.empty(0, dtype=np.int64)
    return np.array(cell_of(Array3f64(*to_columns(directions)), opaque(nside)), dtype=np.int64)


def cell_of(direction: Any, nside: Any) -> Any:
    """Kernel: number of the cell of unit vectors in the body frame; `nside` is a float64 input."""
    n = Int32(nside)
    z, height = direction.z, dr.abs(direction.z)
    quarters = dr.atan2(direction.y, direction.x) * (2 / dr.pi)
    quarters = dr.select(quarters < 0, quarters + 4, quarters)
    # Belt: number of the ascending and of the descending line below the direction, section 5.1.
    belt = height <= 1 - CAP_HEIGHT
    along, across = nside * (0.5 + quarters), nside * 0.75 * z
    descending, ascending = Int32(dr.floor(along - across)), Int32(dr.floor(along + across))
    ring = n + 1 + descending - ascending
    place = (descending + ascending - n + 1 + (1 - (ring & 1))) >> 1
    place = place - dr.select(place >= 4 * n, 4 * n, 0)
    in_belt = 2 * n * (n - 1) + 4 * n * (ring - 1) + place
    # Caps: the same in the quarter of the azimuth, counted from the pole.
    share = quarters - dr.floor(quarters)
    from_pole = nside * dr.sqrt(3 * (dr.square(direction.x) + dr.square(direction.y)) / (1 + height))
    ring = Int32(dr.floor(share * from_pole)) + Int32(dr.floor((1 - share) * from_pole)) + 1
    ring = dr.minimum(ring, n)
    place = dr.minimum(Int32(dr.floor(quarters * Float64(ring))), 4 * ring - 1)
    north = 2 * ring * (ring - 1) + place
    south = 12 * n * n - 2 * ring * (ring + 1) + place
    return UInt32(dr.select(belt, in_belt, dr.select(z > 0, north, south)))


def _rings(nside: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], FloatArray]:
    """Of all cells: ring (1 at the zenith), place along it, number of cells on it, and where on it the first is."""
    check_nside(nside)
    rings = np.arange(1, 4 * nside)
    from_pole = np.minimum(rings, 4 * nside - rings)
    lengths = 4 * np.minimum(from_pole, nside)
    # Every other ring of the belt begins on azimuth zero: those whose distance to the cap's last ring is odd.
    offsets = np.where((from_pole > nside) & ((from_pole - nside) % 2 == 1), 0.0, 0.5)
    starts = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    ring, length, offset, start = (np.repeat(values, lengths) for values in (rings, lengths, offsets, starts))
    return ring, np.arange(len(ring)) - start, length, offset
