"""Following a target: what a law of control is to the loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from optics.kernels.arrays import FloatArray
from tracking.perception import Crop
from tracking.records import Spot


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
    spots : tuple of Spot
        Clusters of the target's colour in the crop.
    """

    time_s: float
    interval_s: float
    q: FloatArray
    q_command: FloatArray
    crop: Crop
    spots: tuple[Spot, ...]


@dataclass(frozen=True, kw_only=True)
class Look:
    """What a pursuit made of one picture.

    Attributes
    ----------
    expected_px : tuple of float, optional
        Where the estimate expected the target in the crop; None without one.
    spots : tuple of Spot
        Those of the picture's that were taken for the target.
    """

    expected_px: tuple[float, float] | None
    spots: tuple[Spot, ...]


class Pursuit(Protocol):
    """Estimates where the target is, and says how to follow it."""

    def look(self, sight: Sight) -> Look:
        """Take in a picture."""

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
