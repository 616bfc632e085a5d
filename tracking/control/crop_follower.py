"""The paper's follower: filter and law in the crop's pixels."""

from __future__ import annotations

from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from tracking.control.crop_scale import centroid_motion
from tracking.control.follower import Observation
from tracking.control.paper_law import GAIN, NO_ERRORS, CropErrors, error, meant_turn, printed_turn
from tracking.estimation.centroid_filter import CentroidFilter, CentroidNoise
from tracking.estimation.clutter import ClutterPlace
from tracking.estimation.gimbal import Gimbal
from tracking.perception import weighted_centroid
from tracking.records import Blob


class CropFollower:
    """Eqs. 8 to 15.

    Parameters
    ----------
    gimbal : Gimbal
    scale : array, shape (2,)
        Radians of gaze to a pixel of the crop along x and y, at a level gaze.
    noise : CentroidNoise
    literal : bool
        Eqs. 14 and 15 as printed, pan with one sign everywhere, and no B u in eq. 8.
    gains : tuple of float
        Of pan and tilt: the share of the error that one image takes away.
    """

    def __init__(
        self,
        gimbal: Gimbal,
        scale: FloatArray,
        noise: CentroidNoise,
        *,
        literal: bool,
        gains: tuple[float, float] = (GAIN, GAIN),
    ):
        self._gimbal, self._scale, self._literal = gimbal, scale, literal
        self._gains = -np.array(gains) * gimbal.signs * scale
        self._filter = CentroidFilter(noise)
        self._q_before: FloatArray | None = None
        self._now = self._before = NO_ERRORS

    direction: FloatArray | None = None
    """It has none: it knows the target in the crop only."""

    beyond_reach = False
    """Nor does it know of a target that is out of the crop."""

    last_seen = None
    last_alone = None
    """Nor where it was, once it is out of it."""

    doubted = False
    trusted = alone = True
    likely = True
    promising = False
    """Nor does it weigh what it follows."""

    @property
    def known(self) -> bool:
        """Whether there is an estimate."""
        return self._filter.centroid_px is not None

    def expect(self, observation: Observation) -> tuple[float, float] | None:
        """Predict the centroid."""
        self._filter.predict(self._moved_px(observation.q))
        self._q_before = observation.q
        expected = self._filter.centroid_px
        return None if expected is None else (float(expected[0]), float(expected[1]))

    def update(self, observation: Observation) -> tuple[Blob, ...]:
        """Correct the centroid by that of all blobs (eq. 7)."""
        expected, found = self._filter.centroid_px, weighted_centroid(observation.blobs)
        size = (observation.crop.width_px, observation.crop.height_px)
        self._before = self._now
        self._now = CropErrors(
            found=found is not None,
            centroid=np.zeros(2) if found is None else error(found, *size),
            prediction=np.zeros(2) if expected is None else error(expected, *size),
        )
        if found is not None:
            self._filter.update(found)
        return observation.blobs

    def follow(self, observation: Observation) -> FloatArray:
        """Last joint values commanded, and the law's turn."""
        if self._literal:
            return observation.q_command + printed_turn(self._now, self._before, self._gains)
        turned_over = np.sign(centroid_motion(self._gimbal, self._scale, observation.q).diagonal() * self._gimbal.signs)
        return observation.q_command + turned_over * meant_turn(self._now, self._gains)

    @property
    def clutter(self) -> list[ClutterPlace]:
        """Nothing is passed by."""
        return []

    def forget(self, *, brief: bool) -> None:
        """Drop the estimate."""
        self._filter.forget()
        self._now = self._before = NO_ERRORS

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        return {
            "filter": self._filter.snapshot(),
            "q_before": None if self._q_before is None else self._q_before.tolist(),
            "errors": [
                [errors.found, errors.centroid.tolist(), errors.prediction.tolist()]
                for errors in (self._now, self._before)
            ],
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self._filter.restore(snapshot["filter"])
        self._q_before = None if snapshot["q_before"] is None else np.array(snapshot["q_before"])
        self._now, self._before = (
            CropErrors(found=found, centroid=np.array(centroid), prediction=np.array(prediction))
            for found, centroid, prediction in snapshot["errors"]
        )

    def _moved_px(self, q: FloatArray) -> FloatArray:
        """B u: what the turn of the joints since the last image has done to the centroid."""
        if self._literal or self._q_before is None:
            return np.zeros(2)
        return np.asarray(centroid_motion(self._gimbal, self._scale, q) @ (q - self._q_before))
