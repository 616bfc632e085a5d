"""The default's pursuit: filter and pointing among directions of the body."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from tracking.control.pointing import Pointing
from tracking.control.pursuit import Look, Sight
from tracking.estimation.direction_filter import DirectionFilter, DirectionNoise
from tracking.estimation.sight_lines import SightLines
from tracking.perception import weighted_centroid
from tracking.records import Spot

GATE = 3.0
"""Standard deviations between the expected direction and the edge of a spot that is still taken for the target."""


class GazePursuit:
    """Measures the target's direction through the exact train, and points at where it will be.

    An error of the believed joint values that stays the same cancels: the direction is measured with it, and the mirror
    is commanded with it. Once it knows a direction, spots elsewhere are not the target's, but a reef's of its colour.

    Parameters
    ----------
    sight_lines : SightLines
    pointing : Pointing
    scale : array, shape (2,)
        Radians of gaze to a pixel of the crop along x and y, at a level gaze.
    noise : DirectionNoise
    latency_s : float
        From the middle of an exposure to the servos' answer.
    row_time_s : float
        From row to row of a picture, at whose time its middle row is open; zero for a global shutter.
    """

    def __init__(
        self,
        sight_lines: SightLines,
        pointing: Pointing,
        scale: FloatArray,
        noise: DirectionNoise,
        *,
        latency_s: float,
        row_time_s: float,
    ):
        self._sight_lines, self._pointing, self._latency_s = sight_lines, pointing, latency_s
        self._row_time_s = row_time_s
        self._rates: FloatArray = np.zeros(2)
        self._before: tuple[float, FloatArray] | None = None
        self._rad_per_px = math.sqrt(scale.prod())
        self._filter = DirectionFilter(noise)
        self._seen = False

    @property
    def direction(self) -> FloatArray | None:
        """Unit vector from the centre of M2 to the target, body frame; None without an estimate."""
        bearing = self._filter.bearing
        return None if bearing is None else bearing.direction

    @property
    def known(self) -> bool:
        """Whether there is an estimate."""
        return self._filter.bearing is not None

    def look(self, sight: Sight) -> Look:
        """Predict the direction, and correct it by the ray of the centroid of the spots that are the target's."""
        self._note_rates(sight)
        self._filter.predict(sight.time_s)
        expected_px = self._expected_px(sight)
        spots = tuple(spot for spot in sight.spots if self._may_be_target(spot, sight))
        centroid_px = weighted_centroid(spots)
        if centroid_px is not None:
            direction = self._direction(centroid_px, sight)
            if direction is not None:
                self._filter.update(direction)
        self._seen = bool(spots)
        return Look(expected_px=expected_px, spots=spots)

    def follow(self, sight: Sight) -> FloatArray:
        """Joint values whose gaze is on the target at the first picture that they can be seen in; after `look`."""
        bearing = self._filter.bearing
        if bearing is None:
            return sight.q_command
        pictures = math.floor(self._latency_s / sight.interval_s) + 1
        return self._pointing.command(bearing, pictures * sight.interval_s, sight.q, seen=self._seen)

    def forget(self) -> None:
        """Drop the estimate."""
        self._filter.forget()

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        before = None if self._before is None else [self._before[0], self._before[1].tolist()]
        return {"filter": self._filter.snapshot(), "before": before}

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self._filter.restore(snapshot["filter"])
        before = snapshot["before"]
        self._before = None if before is None else (before[0], np.array(before[1]))

    def _note_rates(self, sight: Sight) -> None:
        """How fast the joints have moved since the picture before."""
        if self._before is not None:
            self._rates = (sight.q - self._before[1]) / (sight.time_s - self._before[0])
        self._before = (sight.time_s, sight.q)

    def _direction(self, centroid_px: tuple[float, float], sight: Sight) -> FloatArray | None:
        """Direction that a pixel of the crop shows, with the joints as they were when its row was open."""
        pixel = sight.crop.to_image([centroid_px])[0]
        later_s = (pixel[1] - self._sight_lines.middle_row_px) * self._row_time_s
        return self._sight_lines.direction(pixel, sight.q + self._rates * later_s)

    def _may_be_target(self, spot: Spot, sight: Sight) -> bool:
        """Whether the spot, as a disc of its area, comes near enough to the expected direction."""
        expected = self.direction
        if expected is None:
            return True
        direction = self._direction(spot.centroid_px, sight)
        if direction is None:
            return False
        apart = math.atan2(float(np.linalg.norm(np.cross(expected, direction))), float(expected @ direction))
        radius = math.sqrt(spot.area_px / math.pi) * self._rad_per_px
        return apart <= GATE * self._filter.expected_spread + radius

    def _expected_px(self, sight: Sight) -> tuple[float, float] | None:
        if self.direction is None or sight.crop.empty:
            return None
        pixel = self._sight_lines.pixel(self.direction, sight.q)
        if pixel is None:
            return None
        x, y = sight.crop.from_image(np.array([pixel]))[0].tolist()
        return x, y
