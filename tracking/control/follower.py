"""Following a target: what a law of control is to the loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from tracking.estimation.bearing import Sight
from tracking.estimation.clutter import ClutterPlace
from tracking.perception import Crop
from tracking.protocols import AttitudeReport
from tracking.records import Blob


@dataclass(frozen=True, kw_only=True)
class Observation:
    """What one image gives a follower.

    Attributes
    ----------
    time_s : float
        Of the image.
    interval_s : float
        Usual time from image to image.
    q : array, shape (2,)
        Joint values the image was taken with, as far as is known, radians.
    q_command : array, shape (2,)
        Last ones commanded.
    crop : Crop
    blobs : tuple of Blob
        What may be the target in the crop.
    robot : array, shape (crop height, crop width), optional
        uint8: 255 where the crop may show the robot itself; without it, nowhere.
    attitude : AttitudeReport, optional
        How the body is turned, where a sensor says so.
    """

    time_s: float
    interval_s: float
    q: FloatArray
    q_command: FloatArray
    crop: Crop
    blobs: tuple[Blob, ...]
    robot: NDArray[np.uint8] | None = None
    attitude: AttitudeReport | None = None

    def shows(self, point_px: tuple[float, float]) -> bool:
        """Whether a point of the crop would show a target: it lies in the crop, and not on the robot."""
        x, y = point_px
        if not (0 <= x < self.crop.width_px and 0 <= y < self.crop.height_px):
            return False
        return self.robot is None or self.robot[int(y), int(x)] == 0


@dataclass(frozen=True, kw_only=True)
class Dropped:
    """What was followed and was dropped, and may be the target for all that.

    Attributes
    ----------
    direction : array, shape (3,)
        Where it was last: unit vector, body frame.
    probability : float
        That it is the target.
    """

    direction: FloatArray
    probability: float


class Follower(Protocol):
    """Estimates where the target is, and says how to follow it."""

    def expect(self, observation: Observation) -> tuple[float, float] | None:
        """Where the estimate expects the target in the crop, before its blobs are known; None without an estimate."""

    def update(self, observation: Observation) -> tuple[Blob, ...]:
        """Take in an image's blobs, after `expect`; those of them that are taken for the target."""

    def follow(self, observation: Observation) -> FloatArray:
        """Joint values to ask for after `update`, radians, shape (2,); limits are not asked."""

    @property
    def direction(self) -> FloatArray | None:
        """Unit vector to the target, body frame; None when it does not know or does not use directions."""

    @property
    def beyond_reach(self) -> bool:
        """Whether the target is estimated to be where no gaze within the joint limits shows it."""

    @property
    def doubted(self) -> bool:
        """Whether what is followed is likelier not to be the target."""

    @property
    def likely(self) -> bool:
        """Whether what is followed looks enough like the target to be tracked."""

    @property
    def promising(self) -> bool:
        """Whether what is followed has looked so much like the target that it is sought where it can have gone."""

    @property
    def trusted(self) -> bool:
        """Whether what is followed has been seen for long enough, and looked enough like the target, to be it."""

    @property
    def alone(self) -> bool:
        """Whether what is followed is not in one piece with something larger."""

    @property
    def known(self) -> bool:
        """Whether there is an estimate."""

    @property
    def last_alone(self) -> Sight | None:
        """Where it was last seen, and when, before it was in one piece with what is followed; None when it is not."""

    @property
    def last_seen(self) -> Sight | None:
        """Where the target was last seen, and at which time, seconds; None when it does not know directions."""

    @property
    def clutter(self) -> list[ClutterPlace]:
        """What is passed by, body frame: a target there would not be found."""

    def forget(self, *, brief: bool) -> Dropped | None:
        """Drop the estimate, of what was seen briefly, as a candidate is, or for longer.

        Returns what may be the target though it was dropped, if it is known where and how likely.
        """

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
