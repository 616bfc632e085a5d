"""The default follower: a filter of directions, and pointing.

Directions are measured and pointed at in the body frame. In between, filter and evidence are among steady axes
(`tracking.estimation.attitude`), which are the body's where no attitude is known.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from tracking.control.association import Association, cut_by_edges, with_overhead
from tracking.control.follower import Dropped, Observation
from tracking.control.gaze_view import GazeView
from tracking.control.pointing import Pointing
from tracking.estimation.attitude import SteadyAxes
from tracking.estimation.bearing import Bearing, Sight
from tracking.estimation.clutter import ClutterPlace
from tracking.estimation.direction_filter import DirectionFilter, DirectionNoise
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.estimation.lost_places import Turns
from tracking.estimation.steady_filter import SteadyFilter
from tracking.estimation.sway import Sway
from tracking.estimation.target_look import TargetLook, likeliest
from tracking.estimation.track_evidence import TrackEvidence
from tracking.estimation.track_record import is_overhead
from tracking.perception import weighted_centroid
from tracking.perception.cut_blobs import middle_of_cut, middle_of_part
from tracking.perception.outline import outline_log_odds
from tracking.records import Blob

Directions = dict[tuple[float, float], FloatArray | None]
"""Unit vectors, steady axes, that pixels of the crop show; None where they show none."""


RECALLED_LOG_ODDS = 1.0
"""Of a candidate of a search that has the colours of the target that was lost: so has, now and then, another thing."""


class GazeFollower:
    """Measures the target's direction through the exact train, and points at where it will be.

    An error of the estimated joint values that stays cancels: the direction is measured with it, and the mirror
    is commanded with it. Once it knows a direction, blobs elsewhere are not the target's, but a reef's of its colour.

    Parameters
    ----------
    lines_of_sight : LinesOfSight
    pointing : Pointing
    view : GazeView
        What each pose shows.
    scale : array, shape (2,)
        Radians of gaze to a pixel of the crop along x and y, at a level gaze.
    noise : DirectionNoise
    latency_s : float
        From the middle of an exposure to the servos' answer.
    row_time_s : float
        From row to row of an image, at whose time its middle row is open; zero for a global shutter.
    plain : float
        How plainly the target looks like one sooner or later, from 0 to 1 where the water leaves it its colour.
    overhead : bool
        Whether what is seen overhead is likelier to be the target than what is seen level: where the water leaves it
        more of its colour still.
    least_speed_m_per_s : float, optional
        At which the target swims at least, before a robot that hovers; None where that is not known.
    """

    def __init__(
        self,
        lines_of_sight: LinesOfSight,
        pointing: Pointing,
        view: GazeView,
        scale: FloatArray,
        noise: DirectionNoise,
        *,
        latency_s: float,
        row_time_s: float,
        plain: float,
        overhead: bool,
        least_speed_m_per_s: float | None = None,
    ):
        self._lines_of_sight, self._pointing, self._latency_s = lines_of_sight, pointing, latency_s
        self._row_time_s, self._view, self._overhead = row_time_s, view, overhead
        self._rates: FloatArray = np.zeros(2)
        self._before: tuple[float, FloatArray] | None = None
        self._rad_per_px = math.sqrt(scale.prod())
        self._axes = SteadyAxes()
        self._filter = DirectionFilter(noise)
        self._steady = SteadyFilter(noise, Sway())
        self._evidence = TrackEvidence(plain=plain, least_speed_m_per_s=least_speed_m_per_s)
        self._look = TargetLook()
        self._turns = Turns()
        self._seen = False
        self._radius_rad = 0.0
        self._last_seen: Sight | None = None
        self._last_alone: Sight | None = None

    @property
    def doubted(self) -> bool:
        """Whether what is followed is likelier not to be the target."""
        return self._evidence.doubted

    @property
    def likely(self) -> bool:
        """Whether what is followed looks enough like the target to be tracked."""
        return self._evidence.likely

    @property
    def trusted(self) -> bool:
        """Whether what is followed has been seen for long enough, and looked enough like the target, to be it."""
        return self._evidence.trusted

    @property
    def alone(self) -> bool:
        """Whether what is followed is not in one piece with something larger, or what is left of the two."""
        return self._evidence.swallowed_s == 0

    @property
    def promising(self) -> bool:
        """Whether what is followed has looked so much like the target that it is sought where it can have gone."""
        return self._evidence.promising and not self.doubted

    @property
    def direction(self) -> FloatArray | None:
        """Unit vector from the centre of M2 to the target, body frame; None without an estimate."""
        bearing = self._filter.bearing
        return None if bearing is None else self._axes.to_body(bearing.direction)

    @property
    def beyond_reach(self) -> bool:
        """Whether the target is estimated to be where no gaze within the joint limits shows it."""
        direction = self.direction
        return direction is not None and self._pointing.beyond_reach(direction)

    @property
    def known(self) -> bool:
        """Whether there is an estimate."""
        return self._filter.bearing is not None

    @property
    def last_seen(self) -> Sight | None:
        """Where the target was last seen, and at which time, seconds; its rate is what it was steadily.

        In the body frame as it is now, the body's own turn left out.
        """
        return self._in_body(self._last_seen)

    @property
    def last_alone(self) -> Sight | None:
        """Where the target was last seen, and when, before it was in one piece with what is followed.

        In the body frame as `last_seen`; None when it is not in one piece with anything.
        """
        return None if self.alone else self._in_body(self._last_alone)

    def _sight(self, bearing: Bearing, time_s: float, *, hidden: bool) -> Sight:
        return Sight(bearing=bearing, time_s=time_s, hidden=hidden, turning=self._turns.turning)

    def _in_body(self, sight: Sight | None) -> Sight | None:
        return None if sight is None else replace(sight, bearing=self._axes.bearing_to_body(sight.bearing))

    def expect(self, observation: Observation) -> tuple[float, float] | None:
        """Predict the direction."""
        self._note_rates(observation)
        self._axes.note(observation.attitude, observation.time_s)
        self._filter.predict(observation.time_s)
        self._steady.predict(observation.time_s)
        if not self._seen:
            self._coast()
        return self._expected_px(observation)

    def update(self, observation: Observation) -> tuple[Blob, ...]:
        """Correct the direction by the ray of the centroid of the blobs that are the target's."""
        directions = {blob.centroid_px: self._direction(blob.centroid_px, observation) for blob in observation.blobs}
        observation = replace(observation, blobs=tuple(self._weighed(observation, directions)))
        known = Association(
            observation=observation,
            evidence=self._evidence,
            look=self._look,
            bearing=self._filter.bearing,
            spread=self._filter.expected_spread,
            last_seen=None if self._seen else self._last_seen,
            rad_per_px=self._rad_per_px,
        )
        blobs = likeliest(blob for blob in observation.blobs if known.may_be_target(blob, directions[blob.centroid_px]))
        if blobs:
            self._take_in(blobs, directions, known)
        elif self.known:
            self._note_missing(observation)
        self._seen = bool(blobs)
        return blobs

    def _weighed(self, observation: Observation, directions: Directions) -> Iterator[Blob]:
        """Blobs with what is known of them beforehand."""
        for blob in observation.blobs:
            direction = directions[blob.centroid_px]
            known = with_overhead(blob, direction, observation.blobs) if self._overhead else blob
            yield self._look.remembered(known, observation.time_s, followed=self.known)

    def follow(self, observation: Observation) -> FloatArray:
        """Joint values whose gaze is on the target at the first image that they can be seen in; after `update`."""
        bearing = self._filter.bearing if self._seen else self._steady.bearing
        if bearing is None:
            return observation.q_command
        images = math.floor(self._latency_s / observation.interval_s) + 1
        last = None if self._seen else self.last_seen
        left = last is not None and self._pointing.past_the_end(last.bearing.direction)
        ahead_s = images * observation.interval_s
        ahead = self._axes.bearing_ahead(bearing, ahead_s)
        q = self._pointing.command(ahead, ahead_s, observation.q, seen=self._seen, left=left)
        return self._view.past_robot(q, ahead.after(ahead_s).direction)

    def _take_in(self, blobs: tuple[Blob, ...], directions: Directions, known: Association) -> None:
        """Correct direction and evidence by what was taken for the target; directions are those of centroids."""
        observation = known.observation
        sides = cut_by_edges(blobs[0], observation) if len(blobs) == 1 else (0, 0)
        middle_px, doubt = self._middle_px(blobs, sides, observation)
        direction = directions[middle_px] if middle_px in directions else self._direction(middle_px, observation)
        if direction is None:
            return
        turned = not known.is_expected(blobs[0], directions[blobs[0].centroid_px])
        if known.bearing is not None and known.takes_over(blobs[0]):
            self._evidence.outdone = turned = True
            self._evidence.drop(known.bearing.direction, observation.time_s, self._radius_rad)
            self._look.forget()
        self._radius_rad = math.sqrt(sum(blob.area_px for blob in blobs) / math.pi) * self._rad_per_px
        if turned or known.may_be_another(blobs[0]):
            self._evidence.begin_again()
        if turned:
            # Neither its rate nor where that led is known any more.
            self._filter.forget()
            self._steady.forget()
        self._filter.update(direction, doubt)
        self._steady.update(direction, doubt)
        if math.isinf(blobs[0].log_odds) and blobs[0].recalled:
            self._evidence.recall(observation.interval_s)
        else:
            self._weigh(blobs, sides, direction, known)
        others = [
            other.log_odds
            for other in observation.blobs
            if other.is_apart(blobs[0]) and not known.is_clutter(directions[other.centroid_px])
        ]
        self._evidence.note_other(max(others, default=-math.inf), observation.interval_s)
        self._evidence.swallowed_s = self._look.note(
            blobs[0],
            whole=sides == (0, 0),
            interval_s=observation.interval_s,
            swallowed_s=self._evidence.swallowed_s,
        )
        if self.alone and self._evidence.trusted and (lasting := self._steady.lasting) is not None:
            self._turns.note(lasting, observation.time_s)
            self._last_alone = self._sight(lasting, observation.time_s, hidden=True)

    def _weigh(
        self, blobs: tuple[Blob, ...], sides: tuple[int, int], direction: FloatArray, known: Association
    ) -> None:
        """Correct the evidence by the looks of what was taken for the target, cut on some sides."""
        interval_s = known.observation.interval_s
        outline = outline_log_odds(blobs[0]) if sides == (0, 0) else None
        known_by_colours = blobs[0].recalled and not self._evidence.trusted
        contrast = RECALLED_LOG_ODDS if known_by_colours else blobs[0].log_odds
        area_px2 = blobs[0].area_px if len(blobs) == 1 else None
        self._evidence.update(contrast, outline, direction, interval_s, area_px2)
        # Overhead are no corals; a ball's dark side before the bright surface is found in pieces.
        measured = len(blobs) == 1 and sides == (0, 0) and not is_overhead(direction)
        self._evidence.sizes.note(blobs[0].area_px if measured else None)
        # Nothing but a ball is round and dark overhead, for as long as it stays there.
        round_above = outline is not None and outline > 0 and is_overhead(direction)
        self._evidence.note_silhouette(interval_s, dark=blobs[0].silhouette and not round_above)

    def _note_missing(self, observation: Observation) -> None:
        """Go on by path and sway from the first image without the target on; count those that should show it."""
        if self._seen:
            self._coast()
            lasting, direction = self._steady.lasting, self.direction
            if lasting is not None and direction is not None:
                # Else it went out over the view's edge or behind the robot, or shows part of itself there.
                hidden = self._view.shows_whole(observation.q, direction)
                self._last_seen = self._sight(lasting, observation.time_s, hidden=hidden)
        expected = self._expected_px(observation)
        shown = expected is not None and observation.shows(expected)
        self._evidence.miss(observation.interval_s, shown=shown)
        self._look.miss(observation.interval_s)

    def _coast(self) -> None:
        """Take what is not seen to be where path and sway have it by now."""
        bearing = self._steady.bearing
        if bearing is not None:
            self._filter.take_over(bearing, self._steady.covariance)

    def _middle_px(
        self, blobs: tuple[Blob, ...], sides: tuple[int, int], observation: Observation
    ) -> tuple[tuple[float, float], float]:
        """Where the target's middle is in the crop, and the standard deviation that its being cut adds, radians."""
        if len(blobs) > 1:
            centroid_px = weighted_centroid(blobs)
            assert centroid_px is not None  # there are blobs
            return centroid_px, 0.0
        if sides == (0, 0):
            if not self._look.has_another_size(blobs[0]) or (expected_px := self._expected_px(observation)) is None:
                return blobs[0].centroid_px, 0.0
            middle_px, deviation_px = middle_of_part(blobs[0], self._look.usual_px2, expected_px)
            return middle_px, deviation_px * self._rad_per_px
        by_edge = sides == cut_by_edges(blobs[0], replace(observation, robot=None))
        middle_px, deviation_px = middle_of_cut(blobs[0], sides, self._look.whole_px2, by_edge=by_edge)
        return middle_px, deviation_px * self._rad_per_px

    @property
    def clutter(self) -> list[ClutterPlace]:
        """What is passed by at the last image, body frame."""
        if self._before is None:
            return []
        places = self._evidence.clutter.at(self._before[0])
        return [replace(each, direction=self._axes.to_body(each.direction)) for each in places]

    def forget(self, *, brief: bool) -> Dropped | None:
        """Drop the estimate; of what was doubted, or seen briefly, remember where it was; else how it looked."""
        bearing, dropped = self._filter.bearing, None
        if self._evidence.trusted and self._before is not None:
            self._look.lose(None if self.doubted or brief else self._evidence.contrast, self._before[0])
        if (self.doubted or brief) and self.alone and bearing is not None and self._before is not None:
            if (probability := self._evidence.probability) > 0:
                dropped = Dropped(direction=self._axes.to_body(bearing.direction), probability=probability)
            self._evidence.drop(bearing.direction, self._before[0], self._radius_rad)
        self._evidence.begin_again()
        self._filter.forget()
        self._steady.forget()
        self._look.forget()
        self._last_seen = self._last_alone = None
        return dropped

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers."""
        before = None if self._before is None else [self._before[0], self._before[1].tolist()]
        return {
            "axes": self._axes.snapshot(),
            "filter": self._filter.snapshot(),
            "steady": self._steady.snapshot(),
            "seen": self._seen,
            "radius_rad": self._radius_rad,
            "last_seen": None if self._last_seen is None else self._last_seen.snapshot(),
            "last_alone": None if self._last_alone is None else self._last_alone.snapshot(),
            "before": before,
            "evidence": self._evidence.snapshot(),
            "look": self._look.snapshot(),
            "turns": self._turns.snapshot(),
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot."""
        self._axes.restore(snapshot["axes"])
        self._filter.restore(snapshot["filter"])
        self._steady.restore(snapshot["steady"])
        self._seen, self._radius_rad = snapshot["seen"], snapshot["radius_rad"]
        self._last_seen, self._last_alone = (
            None if snapshot[name] is None else Sight.restored(snapshot[name]) for name in ("last_seen", "last_alone")
        )
        self._evidence.restore(snapshot["evidence"])
        self._look.restore(snapshot["look"])
        self._turns = Turns.restored(snapshot["turns"])
        before = snapshot["before"]
        self._before = None if before is None else (before[0], np.array(before[1]))

    def _note_rates(self, observation: Observation) -> None:
        """How fast the joints have moved since the image before."""
        if self._before is not None:
            self._rates = (observation.q - self._before[1]) / (observation.time_s - self._before[0])
        self._before = (observation.time_s, observation.q)

    def _direction(self, centroid_px: tuple[float, float], observation: Observation) -> FloatArray | None:
        """Direction that a pixel of the crop shows, steady axes, with the joints as they were when its row was open."""
        pixel = observation.crop.to_image([centroid_px])[0]
        later_s = (pixel[1] - self._lines_of_sight.middle_row_px) * self._row_time_s
        direction = self._lines_of_sight.direction(pixel, observation.q + self._rates * later_s)
        return None if direction is None else self._axes.to_steady(direction)

    def _expected_px(self, observation: Observation) -> tuple[float, float] | None:
        direction = self.direction
        if direction is None or observation.crop.empty:
            return None
        pixel = self._lines_of_sight.pixel(direction, observation.q)
        if pixel is None:
            return None
        x, y = observation.crop.from_image(np.array([pixel]))[0].tolist()
        return x, y
