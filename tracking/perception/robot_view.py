"""Where the gaze mirror shows the robot itself: places of the crop in which nothing is taken for the target.

Hull, holder, yoke, servos and M1's frame are where the joints put them, so that the rig tells which parts of the crop
show them. What the meshes say is computed beforehand on a grid of joint values (`dives.views.robot_view`) and handed to
the loop as arrays: a robot's computer needs no meshes.

An edge moves through the crop from one joint value to the next. What is kept is therefore no mask but the signed
distance from its edge, which interpolates: half way between two poses the edge lies half way.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.kernels.arrays import FloatArray

MARGIN_PX = 2.0
"""Of the crop, by which the robot is grown: an eighth of a degree of the aqua2's gaze.

With joint values that are off by up to a quarter of a degree, in 3,225 stills of the arena 1,368 of 1,532 targets are
found and 23 things that are no ball; with twice the margin 1,359 and 14."""

DEEPEST_PX = 127
"""Depths beyond are not told apart."""


@dataclass(frozen=True, kw_only=True)
class RobotView:
    """Cells of the crop that do not show the water, on a grid of joint values.

    Attributes
    ----------
    q1, q2 : arrays, shape (n1,) and (n2,)
        Pan and tilt, radians, rising; two or more each.
    depth : array, shape (n1, n2, rows, columns)
        int8: how many pixels of the crop a cell's centre lies inside of what shows the robot, or past the mirrors'
        edges; below zero how many it lies outside. `DEEPEST_PX` at most.
    """

    q1: FloatArray
    q2: FloatArray
    depth: NDArray[np.int8]

    def mask(self, q: ArrayLike, width_px: int, height_px: int, margin_px: float = MARGIN_PX) -> NDArray[np.uint8]:
        """255 in the pixels of the crop in which the robot, grown by a margin, may show; shape (height_px, width_px).

        Linear between the grid's joint values; beyond them, those at its edge hold.
        """
        pan, tilt = np.asarray(q, dtype=np.float64).tolist()
        (i, along_pan), (j, along_tilt) = _place(self.q1, pan), _place(self.q2, tilt)
        corners = self.depth[i : i + 2, j : j + 2].astype(np.float32)
        sides = corners[0] + np.float32(along_pan) * (corners[1] - corners[0])
        depth = sides[0] + np.float32(along_tilt) * (sides[1] - sides[0])
        fine = np.asarray(cv2.resize(depth, (width_px, height_px), interpolation=cv2.INTER_LINEAR))
        return (fine > -margin_px).view(np.uint8) * np.uint8(255)

    def depth_in(self, q: FloatArray, across: FloatArray, down: FloatArray) -> FloatArray:
        """`depth` at joint values, shape (n, 2), in the cells that hold places of the crop from 0 to 1, shape (n,).

        Of the joint values of the grid the nearest count.
        """
        rows, columns = self.depth.shape[2:]
        pan, tilt = (
            np.rint(np.interp(each, nodes, np.arange(len(nodes)))).astype(int)
            for each, nodes in zip(q.T, (self.q1, self.q2), strict=True)
        )
        row, column = (down * rows).astype(int), (across * columns).astype(int)
        return np.asarray(self.depth[pan, tilt, row, column], dtype=np.float64)


def _place(values: FloatArray, value: float) -> tuple[int, float]:
    """Position of the interval of rising values in which one lies, and how far along it, from 0 to 1."""
    first = min(max(int(np.searchsorted(values, value)) - 1, 0), len(values) - 2)
    low, high = values[first : first + 2].tolist()
    return first, min(max((value - low) / (high - low), 0.0), 1.0)
