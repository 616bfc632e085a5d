"""Collecting the samples of eq. 6 from images: the mirror is driven over a grid and its outline found in each.

The outline's sides are fitted with parabolas, for refraction bends them, and meet in corners finer than a pixel. A
corner that something hides is found where the visible parts of its sides lead to.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike, NDArray

from optics.kernels.arrays import FloatArray
from optics.status import Region
from tracking.calibration.observations import corners_problem
from tracking.perception.corners.exact import ExactCorners
from tracking.perception.corners.samples import CornerSamples
from tracking.perception.crop import CORNER_COUNT

if TYPE_CHECKING:
    # The loop runs without rendering, and the renderer takes seconds to load.
    from scenes.renderer import FastRenderer

BAND_PX = (12.0,) * 6 + (6.0,) * 4 + (3.0,) * 4 + (1.5,) * 4
"""Half width of the band around a side in which its points are looked for, from one fit to the next.

The first forgives that much of the nominal corners; the last is what rounding to pixels leaves.
"""

ROUNDED_PX = 0.5
"""What a point may be off because the image is made of pixels."""

ENDS = 0.03
"""Part of a side next to each corner that is left out: the neighbouring side's points are there too."""

LEAST_VISIBLE = 0.35
"""Part of a side that must be seen: a corner is not to be led to from too far away."""

PLACES = 100
"""Parts of a side that are seen or not."""

CROSSING_STEPS = 4
"""Newton steps to where two sides meet: they bend so little that the first is good to a tenth of a pixel."""


def collect_samples(renderer: FastRenderer, q: ArrayLike) -> CornerSamples:
    """Samples from rendered images, by the ground truth of which pixels look through both mirrors.

    Poses in which a side of the mirror is hidden are left out. The rig's own numbers say which corner is which, and
    where to look for it within a dozen pixels; where it is comes from the image. What is seen is what counts: a
    holder that grips over the mirror's edges makes the outline smaller.

    Parameters
    ----------
    renderer : FastRenderer
        Of a rig with mirrors, in any world. Images larger than the camera's make the corners finer.
    q : array_like, shape (n, 2)
        Joint values to drive to, radians (`tracking.perception.corners.errors.pose_grid`).

    Raises
    ------
    ValueError
        For joint values outside their limits, a mirror that is no rectangle, and when fewer than four poses show the
        mirror.
    """
    q = np.asarray(q, dtype=np.float64)
    if q.ndim != 2 or q.shape[1] != 2:
        raise ValueError(f"expected q of shape (n, 2), got {q.shape}")
    rig, (rows, columns) = renderer.rig, renderer.shape
    if problem := corners_problem(rig):
        raise ValueError(problem)
    nominal = ExactCorners(rig)
    finer = np.array([columns / rig.camera.width_px, rows / rig.camera.height_px])
    found = []
    for pose in q:
        frame = renderer.render(q1=float(pose[0]), q2=float(pose[1]))
        guess = (nominal.corners(pose) + 0.5) * finer - 0.5
        found.append(outline_corners(frame.region == Region.GAZE, guess))
    corners = (np.array(found).reshape(-1, CORNER_COUNT, 2) + 0.5) / finer - 0.5
    seen = np.isfinite(corners).all(axis=(1, 2))
    return CornerSamples(q=q[seen], corners_px=corners[seen])


def outline_corners(mirror: NDArray[np.bool_], guess_px: FloatArray) -> FloatArray:
    """Corners of the mirror in an image, shape (4, 2), in the order of the guess; nan for those that are not found.

    Parameters
    ----------
    mirror : array, shape (height, width)
        Pixels that show the mirror.
    guess_px : array, shape (4, 2)
        Where the corners are expected.
    """
    points = _border(mirror)
    sides = [_Side.fitted(points, *guess_px[[k, (k + 1) % CORNER_COUNT]]) for k in range(CORNER_COUNT)]
    corners = [_crossing(before, after) for before, after in pairwise([sides[-1], *sides])]
    return np.array(corners)


def _border(mirror: NDArray[np.bool_]) -> FloatArray:
    """Middles of the edges between pixels that show the mirror and pixels that do not, shape (n, 2).

    What the image's own border cuts off is no edge of the mirror.
    """
    shown = mirror.astype(np.int8)
    v, u = np.nonzero(np.diff(shown, axis=1))
    upright = np.column_stack([u + 0.5, v])
    v, u = np.nonzero(np.diff(shown, axis=0))
    return np.concatenate([upright, np.column_stack([u, v + 0.5])]).astype(np.float64)


@dataclass(frozen=True)
class _Side:
    """A side of the outline: a parabola over the chord between two corners, in pixels along it and to its right."""

    start: FloatArray
    along: FloatArray
    bend: Polynomial

    @classmethod
    def fitted(cls, points: FloatArray, start: FloatArray, end: FloatArray) -> _Side | None:
        """Parabola through the border's points near a chord; None when too little of the side is seen."""
        length = float(np.hypot(*(end - start)))
        along = (end - start) / length
        x, y = ((points - start) @ np.column_stack([along, _turned(along)])).T
        between = (x > ENDS * length) & (x < (1 - ENDS) * length)
        x, y = x[between], y[between]
        bend = Polynomial([0.0])
        for band in BAND_PX:
            off = np.abs(y - bend(x))
            near = off < band
            places = np.unique((x[near] * PLACES / length).astype(np.int64))
            if len(places) < LEAST_VISIBLE * PLACES:
                return None
            # Least distances, not least squares: what hides a part of the side crosses the band as well.
            weight = 1 / np.sqrt(np.maximum(off[near], ROUNDED_PX))
            bend = Polynomial.fit(x[near], y[near], 2, domain=[0, length], w=weight).convert()
        return cls(start=start, along=along, bend=bend)

    def tangent(self, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Point of the parabola beside a point, and the direction in which it goes on there."""
        x = float((point - self.start) @ self.along)
        across = _turned(self.along)
        return self.start + x * self.along + self.bend(x) * across, self.along + self.bend.deriv()(x) * across


def _turned(vector: FloatArray) -> FloatArray:
    return np.array([-vector[1], vector[0]])


def _crossing(before: _Side | None, after: _Side | None) -> FloatArray:
    """Where two sides meet; nan without both."""
    if before is None or after is None:
        return np.full(2, np.nan)
    point = after.start
    for _ in range(CROSSING_STEPS):
        (a, towards_a), (b, towards_b) = before.tangent(point), after.tangent(point)
        step = np.linalg.solve(np.column_stack([towards_a, -towards_b]), b - a)
        point = a + step[0] * towards_a
    return np.asarray(point)
