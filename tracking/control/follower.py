"""Following a target: what a law of control is to the loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from optics.kernels.arrays import FloatArray
from tracking.perception import Crop
from tracking.records import Blob


@dataclass(frozen=True, kw_only=True)
class Observation:
    """What one image has for a pursuit.

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
        Clusters of the target's colour in the crop.
    """

    time_s: float
    interval_s: float
    q: FloatArray
    q_command: FloatArray
    crop: Crop
    blobs: tuple[Blob, ...]


@dataclass(frozen=True, kw_only=True)
class TrackUpdate:
    """What a pursuit made of one image.

    Attributes
    ----------
    expected_px : tuple of float, optional
        Where the estimate expected the target in the crop; None without one.
    blobs : tuple of Blob
        Those of the image's that were taken for the target.
    """

    expected_px: tuple[float, float] | None
    blobs: tuple[Blob, ...]


class Follower(Protocol):
    """Estimates where the target is, and says how to follow it."""

    def update(self, observation: Observation) -> TrackUpdate:
        """Take in an image."""

    def follow(self, observation: Observation) -> FloatArray:
        """Joint values to ask for after `update`, radians, shape (2,); limits are not asked."""

    @property
    def direction(self) -> FloatArray | None:
        """Unit vector to the target, body frame; None when it does not know or does not use directions."""

    @property
    def beyond_reach(self) -> bool:
        """Whether the target is estimated to be where no gaze within the joint limits shows it."""

    @property
    def known(self) -> bool:
        """Whether there is an estimate."""

    def forget(self) -> None:
        """Drop the estimate."""

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
