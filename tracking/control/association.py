"""Which blobs of an image may be the target: by where it is expected, how they look, and what is no target."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from optics.kernels.arrays import FloatArray
from tracking.control.follower import Observation
from tracking.estimation.bearing import Bearing, Sight
from tracking.estimation.target_look import TargetLook
from tracking.estimation.track_evidence import TrackEvidence
from tracking.estimation.track_record import AT_ONCE_LOG_ODDS, GAP_S, is_overhead
from tracking.perception import ACQUIRED_LOG_ODDS
from tracking.perception.cut_blobs import cut_sides
from tracking.perception.outline import outline_log_odds
from tracking.records import Blob

WIDEST_GATE_RAD = math.radians(15.0)
"""Of an expected direction: three of four targets of the arena are within 9 degrees of it after 2 s. What is seen
further off, and as far from where the target was last seen, is a candidate of the search, which asks for more than one
image."""

PLACE_TELLS_RAD = math.radians(3.0)
"""Spread of the expected direction up to which its place alone makes a blob the target's: beyond, it must look like it
as one does of which nothing is known."""

GATE = 3.0
"""Standard deviations between the expected direction and the edge of a blob that is still taken for the target."""

PALE_LOG_ODDS = 1.0
"""By contrast, from which what has a target's outline is a candidate of a search, if both together have
`AT_ONCE_LOG_ODDS`: a ball at 3.3 m before the bright water above, passed by a search, has 1.4, and 1.5 to 2 when looked
at. In 405 s of searches from point to point two other things have as much."""

OVERHEAD_LOG_ODDS = 1.0
"""That a thing seen overhead has beforehand: a ball shows its dark side before the bright surface, and little else is
there. Of the arena's stills in waters that leave the target its colour, from `OVERHEAD_RAD` up, 0.17 of 367 targets and
0.04 of 201 other balls have 1 to 2 by contrast, and pieces of the world in 0.3 of 100 images."""

WHOLE_SHARE = 0.5
"""Of a dark thing overhead, from which what is red of it is taken for all of it: in 0.88 of 716 images of targets in
four dives it is more; of a blue ball, whose bright lower side is not red, 0.3 to 0.45."""


@dataclass(frozen=True, kw_only=True)
class Association:
    """What is known before an image's blobs are looked at. Directions are unit vectors, steady axes, shape (3,).

    Attributes
    ----------
    observation : Observation
    evidence : TrackEvidence
    look : TargetLook
    bearing : Bearing, optional
        Where the target is expected; None while nothing is followed.
    spread : float
        Standard deviation of that, radians.
    last_seen : Sight, optional
        Steady axes; None of one that the image before showed.
    rad_per_px : float
        Of the crop.
    """

    observation: Observation
    evidence: TrackEvidence
    look: TargetLook
    bearing: Bearing | None
    spread: float
    last_seen: Sight | None
    rad_per_px: float

    def may_be_target(self, blob: Blob, direction: FloatArray | None) -> bool:
        """Whether the blob, as a disc of its area about a direction, comes near enough to the expected one."""
        if direction is None:
            return False
        likely = blob.log_odds >= ACQUIRED_LOG_ODDS
        if self.bearing is None:
            looks_like_it = (likely or self._is_pale(blob)) and not self._is_paler(blob, direction)
            return looks_like_it and not self.is_clutter(direction)
        if not (likely or blob.recalled) and self.spread > PLACE_TELLS_RAD:
            return False
        if blob.silhouette and not self._is_silhouette(blob):
            return False
        if self.is_expected(blob, direction):
            return True
        return blob.log_odds >= AT_ONCE_LOG_ODDS and (
            self._may_have_turned_to(direction) or self._has_come_out(blob, direction)
        )

    def may_be_another(self, blob: Blob) -> bool:
        """Whether a blob that is taken for the target after a gap has yet to show that it is the same thing."""
        if self.last_seen is None or blob.recalled:
            return False
        gap_s = self.observation.time_s - self.last_seen.time_s
        faded = not blob.silhouette and self.evidence.is_another(blob.log_odds, gap_s)
        return faded or self.spread > PLACE_TELLS_RAD

    def takes_over(self, blob: Blob) -> bool:
        """Whether a blob that hides what was followed is by far the likelier target of the two."""
        return self.look.has_outgrown(blob) and self.evidence.is_outdone_by(blob.log_odds)

    def is_expected(self, blob: Blob, direction: FloatArray | None) -> bool:
        """Whether a blob, as a disc of its area about a direction, is near enough to where the target is expected."""
        if self.bearing is None or direction is None:
            return True
        apart = 2 * math.asin(min(math.dist(self.bearing.direction, direction) / 2, 1))
        radius = math.sqrt(blob.area_px / math.pi) * self.rad_per_px
        return apart <= min(GATE * self.spread, WIDEST_GATE_RAD) + radius

    def is_clutter(self, direction: FloatArray | None) -> bool:
        """Whether a direction shows what was not the target, or nothing."""
        return direction is None or self.evidence.clutter.covers(direction, self.observation.time_s)

    def _is_pale(self, blob: Blob) -> bool:
        """Whether a blob has little contrast, and the outline of a target."""
        if blob.silhouette or blob.log_odds < PALE_LOG_ODDS or cut_by_edges(blob, self.observation) != (0, 0):
            return False
        return blob.log_odds + outline_log_odds(blob) >= AT_ONCE_LOG_ODDS

    def _is_paler(self, blob: Blob, direction: FloatArray) -> bool:
        """Whether a candidate is too pale for the target that was lost, and not because it is overhead."""
        return self.look.is_paler_than_lost(blob, self.observation.time_s) and not is_overhead(direction)

    def _is_silhouette(self, blob: Blob) -> bool:
        """Whether a dark thing may be the target before the light: it is trusted, and was about as large."""
        cut = cut_by_edges(blob, self.observation) != (0, 0)
        return self.evidence.trusted and self.look.may_be_silhouette(blob, cut=cut)

    def _may_have_turned_to(self, direction: FloatArray) -> bool:
        """Whether the target may have turned while it was not seen, and come into view in a direction.

        Near where it was last seen, and after a gap: in an image or two nothing turns.
        """
        if self.last_seen is None:
            return False
        near = float(self.last_seen.bearing.direction @ direction) > math.cos(WIDEST_GATE_RAD)
        return near and self.observation.time_s - self.last_seen.time_s >= GAP_S

    def _has_come_out(self, blob: Blob, direction: FloatArray) -> bool:
        """Whether a blob looks as plainly like the target as that ever did, beside what is told by other marks.

        By its darkness or its colours alone a thing is followed that hides the target, which then comes out beside it;
        or now and then a sliver of the target is, between two bars, while it turns back.
        """
        told = self.evidence.silhouette_s + self.evidence.untold_s < GAP_S
        if told or self.bearing is None or blob.recalled or blob.log_odds < (self.evidence.clearest or 0.0):
            return False
        return float(self.bearing.direction @ direction) > math.cos(WIDEST_GATE_RAD)


def with_overhead(blob: Blob, direction: FloatArray | None, blobs: Iterable[Blob]) -> Blob:
    """A blob, one of an image's, with what its direction tells of it.

    What looks like no target is told by its place alone; and so is the part of a dark thing, whose rest has another
    colour.
    """
    if blob.silhouette or blob.recalled or direction is None or not is_overhead(direction):
        return blob
    dark = (other for other in blobs if other.silhouette and other.is_near(blob.centroid_px))
    if any(blob.area_px < WHOLE_SHARE * other.area_px for other in dark):
        return blob
    return replace(blob, log_odds=blob.log_odds + OVERHEAD_LOG_ODDS)


def cut_by_edges(blob: Blob, observation: Observation) -> tuple[int, int]:
    """On which sides the crop's edge or the robot cuts a blob."""
    crop, robot = observation.crop, observation.robot
    return cut_sides(blob, np.zeros((crop.height_px, crop.width_px), np.uint8) if robot is None else robot)
