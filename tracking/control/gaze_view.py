"""Which directions a pose of the mirror shows: not all that lies within a fixed angle of the gaze.

A gaze mirror is seen the more aslant the farther it looks up or down, and shows less of the water above and below the
axis: the aqua2's shows 28 degrees with the gaze at the zenith, 6 at the ends of tilt. Where it looks up, and back over
the zenith, it shows M1, its own mount and the hull as well. A search that takes all poses for alike counts as seen what
was hidden, and a gaze that is centred on a target may have a bar of the mount in its middle.

From the gaze's tangent plane (right, down) to the crop leads a homography, up to the refraction behind a flat port.
It depends on tilt alone, since pan turns the mirror about the folded optical axis. What the robot hides is a
`RobotView`'s.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.perception import Crop
from tracking.perception.crop import WIDTH_PX
from tracking.perception.robot_view import RobotView

CELLS = np.array([40, 30])
"""Columns and rows of the crop in which distances are told: half a degree of the presets' gaze each."""

CELL_PX = WIDTH_PX / CELLS[0]

CLEAR_CELLS = 3.0
"""From the robot and the crop's edge, at which a direction is shown: with its middle there, three quarters of a ball of
0.2 m at 2 m are. Less of it is found less often, and at the edge itself hardly ever."""

LEAST_SHOWN = 1 / 3
"""Of that, at which a direction is looked at nevertheless: of all that bluerov2 shows about the horizon, legs of the
mount and the hull leave no more of 0.11."""

TILTS = 63
"""Nodes over tilt's range between which homographies are interpolated: 2.5 degrees apart for the presets."""

ASIDE = math.tan(math.radians(3.0))
"""From the axis, on the tangent plane, of the points that tell a homography: rays at the crop's edge may miss M1."""

DODGES = np.radians(np.arange(-15.0, 15.1, 2.5)), np.radians(np.arange(-2.5, 2.6, 0.625))
"""Of the gaze, across and upwards: about the pose that is centred on a direction, and about the best of these, for what
is between two bars."""


class GazeView:
    """What each pose shows.

    Parameters
    ----------
    gimbal : Gimbal
    lines_of_sight : LinesOfSight
    crop_at : callable
        Crop at joint values.
    robot_view : RobotView, optional
        Where the crop shows the robot; without it, nowhere.
    """

    def __init__(
        self,
        gimbal: Gimbal,
        lines_of_sight: LinesOfSight,
        crop_at: Callable[[FloatArray], Crop],
        robot_view: RobotView | None = None,
    ):
        self._gimbal, self._robot_view = gimbal, robot_view
        tilts = np.linspace(*gimbal.limits(1), TILTS)
        pan = gimbal.angles(gimbal.middle)[0]
        poses = [gimbal.joint_values(pan, tilt) for tilt in tilts.tolist()]
        self._cells_from_gaze = np.array([_homography(gimbal, lines_of_sight, crop_at(q), q) for q in poses])

    def shown(self, direction: FloatArray, pan: FloatArray, tilt: FloatArray) -> NDArray[np.float32]:
        """How well poses show unit vectors, gimbal's frame, shape (n, 3): from 0 to 1, shape (pans, tilts, n)."""
        return np.asarray(np.clip(self.clearance(direction, pan, tilt) / np.float32(CLEAR_CELLS), 0, 1))

    def shown_at(self, q: FloatArray, direction: FloatArray) -> NDArray[np.float32]:
        """How well joint values show unit vectors, gimbal's frame, shape (n, 3): from 0 to 1, shape (n,)."""
        pan, tilt = self._gimbal.angles(q)
        return np.asarray(self.shown(direction, np.array([pan]), np.array([tilt]))[0, 0])

    def shows_at(self, q: FloatArray, direction: FloatArray) -> NDArray[np.bool_]:
        """Which unit vectors, gimbal's frame, shape (n, 3), joint values show well enough to be looked at, (n,)."""
        return np.asarray(self.shown_at(q, direction) >= LEAST_SHOWN)

    def shows_whole(self, q: FloatArray, direction: FloatArray) -> bool:
        """Whether joint values show a ball in a direction, a unit vector of the body frame, all but whole."""
        return bool(self.shown_at(q, self._gimbal.in_gimbal(direction)[np.newaxis])[0] == 1)

    def clearance(self, direction: FloatArray, pan: FloatArray, tilt: FloatArray) -> NDArray[np.float32]:
        """How far directions are from what hides them.

        Parameters
        ----------
        direction : array, shape (n, 3)
            Unit vectors, gimbal's frame.
        pan, tilt : arrays, shape (pans,) and (tilts,)
            In the gimbal's frame, radians.

        Returns
        -------
        array, shape (pans, tilts, n)
            Cells from the crop's edge or the robot, below zero beyond; minus infinity behind the mirror.
        """
        clear = np.empty((len(pan), len(tilt), len(direction)), dtype=np.float32)
        cosine, sine = np.cos(pan)[:, np.newaxis], np.sin(pan)[:, np.newaxis]
        x, y, z = direction.T
        forward, right = cosine * x + sine * y, sine * x - cosine * y
        for index, angle in enumerate(tilt.tolist()):
            ahead = math.cos(2 * angle) * forward + math.sin(2 * angle) * z
            down = math.sin(2 * angle) * forward - math.cos(2 * angle) * z
            clear[:, index] = self._clearance_at(pan, angle, np.stack([right, down, ahead], axis=-1))
        return clear

    def past_robot(self, q: FloatArray, direction: FloatArray) -> FloatArray:
        """Joint values that show a direction, a unit vector of the body frame: `q`, or the nearest that show it better.

        `q` is centred on it, or as nearly as the joints' limits let it.
        """
        there, (pan, tilt) = self._gimbal.in_gimbal(direction)[np.newaxis], self._gimbal.angles(q)
        now = float(self.shown_at(q, there)[0])
        if now == 1:
            return q
        best, most = (pan, tilt), now
        for dodges in DODGES:
            pans, tilts = (
                np.clip(middle + dodges / turns, *self._gimbal.limits(joint))
                for joint, (middle, turns) in enumerate(zip(best, (1, 2), strict=True))
            )
            shown = self.shown(there, pans, tilts)[..., 0]
            if shown.max() <= most:
                break
            off = np.hypot((pans - pan)[:, np.newaxis], 2 * (tilts - tilt))
            place = np.unravel_index(int(np.where(shown == shown.max(), off, np.inf).argmin()), off.shape)
            best, most = (float(pans[place[0]]), float(tilts[place[1]])), float(shown.max())
            if most == 1:
                break
        return q if most == now else self._gimbal.joint_values(*best)

    def _clearance_at(self, pan: FloatArray, tilt: float, rays: FloatArray) -> FloatArray:
        """The same at one tilt, of rays (right, down, ahead of the gaze), shape (pans, n, 3)."""
        lowest, highest = self._gimbal.limits(1)
        place = (TILTS - 1) * min(max((tilt - lowest) / (highest - lowest), 0.0), 1.0)
        first = min(int(place), TILTS - 2)
        low, high = self._cells_from_gaze[first : first + 2]
        column, row, scale = np.moveaxis(rays @ (low + (place - first) * (high - low)).T, -1, 0)
        # Behind the gaze, and where there is no mirror to be seen (nan), nothing is shown.
        ahead = (rays[..., 2] > 0) & (scale > 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            column, row = column / scale, row / scale
        edge = np.minimum(np.minimum(column, CELLS[0] - column), np.minimum(row, CELLS[1] - row))
        clear = np.where(ahead, edge, -np.inf)
        if self._robot_view is not None:
            which, number = np.nonzero(clear > 0)
            q = np.array([self._gimbal.joint_values(each, tilt) for each in pan.tolist()])[which]
            depth_px = self._robot_view.depth_in(q, column[which, number] / CELLS[0], row[which, number] / CELLS[1])
            clear[which, number] = np.minimum(clear[which, number], depth_px / -CELL_PX)
        return np.asarray(clear)


def _homography(gimbal: Gimbal, lines_of_sight: LinesOfSight, crop: Crop, q: FloatArray) -> FloatArray:
    """From (right, down, ahead) of the gaze to cells of the crop, shape (3, 3); nan where no mirror is seen."""
    nothing = np.full((3, 3), np.nan)
    if crop.empty:
        return nothing
    pan, tilt = gimbal.angles(q)
    aside = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * ASIDE
    pixels = [lines_of_sight.pixel(gimbal.from_gaze(pan, tilt, right, down), q) for right, down in aside.tolist()]
    found = [pixel for pixel in pixels if pixel is not None]
    if len(found) < len(pixels):
        return nothing
    places = (crop.from_image(np.array(found)) + 0.5) / [crop.width_px, crop.height_px] * CELLS
    return np.asarray(cv2.getPerspectiveTransform(aside.astype(np.float32), places.astype(np.float32)))
