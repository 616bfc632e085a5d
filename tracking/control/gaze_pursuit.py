"""The default's pursuit: filter and pointing among directions of the body."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tracking.control.pointing import Pointing
from tracking.control.pursuit import Sight
from tracking.estimation.direction_filter import DirectionFilter, DirectionNoise
from tracking.estimation.sight_lines import SightLines
from tracking.protocols import FloatArray


class GazePursuit:
    """Measures the target's direction through the exact train, and points at where it will be.

    An error of the believed joint values that stays the same cancels: the direction is measured with it, and the mirror
    is commanded with it.

    Parameters
    ----------
    sight_lines : SightLines
    pointing : Pointing
    noise : DirectionNoise
    latency_s : float
        From the middle of an exposure to the servos' answer.
    """

    def __init__(self, sight_lines: SightLines, pointing: Pointing, noise: DirectionNoise, latency_s: float):
        self._sight_lines, self._pointing, self._latency_s = sight_lines, pointing, latency_s
        self._filter = DirectionFilter(noise)

    @property
    def direction(self) -> FloatArray | None:
        """Unit vector from the centre of M2 to the target, body frame; None without an estimate."""
        bearing = self._filter.bearing
        return None if bearing is None else bearing.direction

    @property
    def known(self) -> bool:
        """Whether there is an estimate."""
        return self._filter.bearing is not None

    def look(self, sight: Sight) -> tuple[float, float] | None:
        """Predict the direction, and correct it by the centroid's ray; where it was expected in the crop."""
        self._filter.predict(sight.time_s)
        expected = self._expected_px(sight)
        if sight.centroid_px is not None:
            pixel = sight.crop.to_image([sight.centroid_px])[0]
            direction = self._sight_lines.direction(pixel, sight.q)
            if direction is not None:
                self._filter.update(direction)
        return expected

    def follow(self, sight: Sight) -> FloatArray:
        """Joint values whose gaze is on the target at the first picture that they can be seen in."""
        bearing = self._filter.bearing
        if bearing is None:
            return sight.q_command
        pictures = math.floor(self._latency_s / sight.interval_s) + 1
        return self._pointing.command(bearing, pictures * sight.interval_s, sight.q)

    def forget(self) -> None:
        """Drop the estimate."""
        self._filter.forget()

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        return {"filter": self._filter.snapshot()}

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self._filter.restore(snapshot["filter"])

    def _expected_px(self, sight: Sight) -> tuple[float, float] | None:
        if self.direction is None or sight.crop.empty:
            return None
        pixel = self._sight_lines.pixel(self.direction, sight.q)
        if pixel is None:
            return None
        x, y = sight.crop.from_image(np.array([pixel]))[0].tolist()
        return x, y
