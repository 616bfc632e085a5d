"""Following a target: what a law of control is to the loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from tracking.perception import Crop
from tracking.protocols import FloatArray


@dataclass(frozen=True, kw_only=True)
class Sight:
    """What one picture has for a pursuit.

    Attributes
    ----------
    time_s : float
        Of the picture.
    interval_s : float
        Usual time from picture to picture.
    q : array, shape (2,)
        Joint values the picture was taken with, as far as is known, radians.
    q_command : array, shape (2,)
        Last ones commanded.
    crop : Crop
    centroid_px : tuple of float, optional
        Of the target in the crop; None when it was not detected.
    """

    time_s: float
    interval_s: float
    q: FloatArray
    q_command: FloatArray
    crop: Crop
    centroid_px: tuple[float, float] | None


class Pursuit(Protocol):
    """Estimates where the target is, and says how to follow it."""

    def look(self, sight: Sight) -> tuple[float, float] | None:
        """Take in a picture; what the estimate expected of it, crop pixels, None without an estimate."""

    def follow(self, sight: Sight) -> FloatArray:
        """Joint values to ask for after `look`, radians, shape (2,); limits are not asked."""

    @property
    def direction(self) -> FloatArray | None:
        """Unit vector to the target, body frame; None when it does not know or does not use directions."""

    @property
    def known(self) -> bool:
        """Whether there is an estimate."""

    def forget(self) -> None:
        """Drop the estimate."""

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
