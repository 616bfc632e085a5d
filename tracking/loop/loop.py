"""The loop: an image and a report of the mirrors in, joint values out."""

from __future__ import annotations

import math
from dataclasses import replace
from statistics import median
from typing import Any

import numpy as np

from optics.gaze.motion import JointSpeeds
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mirror_outline import mirror_outline
from rigs import ImageSensorSpec, Rig
from tracking.control.crop_follower import CropFollower
from tracking.control.crop_scale import crop_scale, level_pose
from tracking.control.direct_look import DirectLook
from tracking.control.follower import Follower, Observation
from tracking.control.gaze_follower import GazeFollower
from tracking.control.gaze_view import GazeView
from tracking.control.joint_paths import check_path
from tracking.control.paper_law import error
from tracking.control.pointing import Pointing
from tracking.control.search import Search
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.loop.behaviour import BehaviourState, next_state
from tracking.loop.corner_models import corner_model
from tracking.loop.variants import Variant
from tracking.perception import (
    RED_BALL,
    CornerSamples,
    Crop,
    DetectorSettings,
    detector_of,
    taken,
)
from tracking.perception.appearance import AppearanceModel
from tracking.perception.contrast_pyramid import Mask
from tracking.perception.detectors import Detector, keeps_colour, plainness, weighs_contrast
from tracking.perception.direct_view import DirectView
from tracking.perception.robot_view import MARGIN_PX, RobotView
from tracking.protocols import AttitudeReport, CameraFrame, MirrorReport
from tracking.records import Mode, Step

FIRST_INTERVAL_S = 1 / 30
"""From image to image, until two are known."""

INTERVALS = 5
"""Whose median is the usual time from image to image: two lost ones do not change it."""


class TrackingLoop:
    """Finds the target in each image and says where to turn the mirror. It draws no random numbers.

    Parameters
    ----------
    rig : Rig
        With mirrors and servos.
    variant : Variant
        One of `VARIANTS`, or `dataclasses.replace` of one.
    detector : DetectorSettings or callable, optional
        What the target looks like, by default the red ball; or what finds it (a `Detector`).
    samples : CornerSamples, optional
        For eq. 6; without them, exact corners on a grid of 7 x 7 poses. Exact corners need none.
    robot_view : RobotView, optional
        Where the crop shows the robot itself: what is there is not taken for the target. Without it, everything may be.
    direct_view : DirectView, optional
        Where the image shows the water past the mirrors: a search turns to what looks like the target there. Without
        it, the gaze alone is looked at.

    Raises
    ------
    ValueError
        For a rig without mirrors or servos, or one whose camera does not see the gaze mirror at a level gaze.
    """

    def __init__(
        self,
        rig: Rig,
        variant: Variant,
        *,
        detector: DetectorSettings | Detector | None = None,
        samples: CornerSamples | None = None,
        robot_view: RobotView | None = None,
        direct_view: DirectView | None = None,
    ):
        speeds = JointSpeeds.from_rig(rig)
        self._variant = variant
        self._detect = detector if callable(detector) else detector_of(detector or RED_BALL, contrast=variant.contrast)
        settings = None if callable(detector) else detector or RED_BALL
        self._appearance: AppearanceModel | None = None
        if settings is not None and variant.appearance and weighs_contrast(settings, contrast=variant.contrast):
            self._appearance = AppearanceModel(settings.area_min_px)
        self._robot_view = robot_view
        self._gimbal = Gimbal(Layout.from_rig(rig))
        self._outline = mirror_outline(rig.require_gaze().gaze_mirror)
        self._corners = corner_model(rig, variant, samples, self._gimbal)
        lines_of_sight = LinesOfSight(rig, variant.target_distance_m)
        scale = crop_scale(lines_of_sight, self._crop_at, level_pose(self._gimbal))
        if not np.isfinite(scale).all():
            raise ValueError(f"expected a camera that sees the gaze mirror at a level gaze, got rig {rig.name!r}")
        crop = self._crop_at(level_pose(self._gimbal))
        view = scale * [crop.width_px, crop.height_px]
        shown = GazeView(self._gimbal, lines_of_sight, self._crop_at, robot_view)
        self._follower: Follower
        if variant.law == "gaze":
            # What pan cannot follow is beside the axis, since tilt follows at any pan angle: across the view.
            pointing = Pointing(self._gimbal, speeds, float(view[0]) / 2)
            latency_s = variant.control_latency_s + _servo_latency_s(rig)
            self._follower = GazeFollower(
                lines_of_sight,
                pointing,
                shown,
                scale,
                variant.direction_noise,
                latency_s=latency_s,
                row_time_s=(rig.image_sensor or ImageSensorSpec()).row_time_us * 1e-6,
                plain=0.0 if settings is None else plainness(settings, contrast=variant.contrast),
                overhead=settings is not None and keeps_colour(settings, contrast=variant.contrast),
                least_speed_m_per_s=None if settings is None else settings.least_speed_m_per_s,
            )
        else:
            literal = variant.law == "paper-literal"
            self._follower = CropFollower(
                self._gimbal, scale, variant.centroid_noise, literal=literal, gains=variant.gains
            )
        self._search = Search(
            self._gimbal,
            speeds,
            view,
            likely=shown if variant.likely_first else None,
            direct=None if direct_view is None else DirectLook(direct_view, self._detect, self._gimbal, speeds, shown),
            interval_s=1 / (rig.image_sensor or ImageSensorSpec()).frame_rate_hz,
        )
        check_s = variant.behaviour.check_s
        self._check = check_path(self._gimbal, speeds, check_s) if check_s > 0 else None
        self._state = BehaviourState()
        self._q_command = self._gimbal.middle
        self._first_s: float | None = None
        self._last_s = math.nan
        self._intervals: list[float] = []

    @property
    def started(self) -> bool:
        """Whether it has taken an image."""
        return self._first_s is not None

    def looks_past_mirrors(self, time_s: float) -> bool:
        """Whether it will look at the direct view in an image at a time, seconds, if that is the next."""
        return self._searches and self._search.looks_past_mirrors(time_s)

    def step(self, camera_frame: CameraFrame, report: MirrorReport, attitude: AttitudeReport | None = None) -> Step:
        """Take one image, decide where to turn the mirror.

        Images may be missing: time may jump, but must grow. A report that is not finite is replaced by the last
        command. Where no mirror is seen, the crop is black. With `attitude` the default's estimate is kept among axes
        that do not turn with the body; images without one may come in between (`tracking.estimation.attitude`).

        Raises
        ------
        ValueError
            For a time that is not later than the last image's, or no image of uint8 colours.
        """
        if not math.isfinite(camera_frame.time_s) or camera_frame.time_s <= self._last_s:
            raise ValueError(
                f"expected an image later than the last, at {self._last_s} s, got one at {camera_frame.time_s} s"
            )
        q = self._joints(report)
        corners = self._corners.corners(q)
        crop = Crop.of(corners, outline=self._outline)
        image = crop.take(camera_frame.image)
        # Nothing is refused from here on: an image that is leaves no trace.
        looks_past_mirrors = self.looks_past_mirrors(camera_frame.time_s)
        elapsed_s = self._note_time(camera_frame.time_s)
        robot = self._robot_mask(q, crop)
        observation = Observation(
            time_s=camera_frame.time_s,
            interval_s=self._interval_s,
            q=q,
            q_command=self._q_command,
            crop=crop,
            blobs=(),
            robot=robot,
            attitude=attitude,
        )
        expected, followed = self._follower.expect(observation), self._follower.trusted
        detection = self._detect(image, robot, expected)
        if self._appearance is not None and self._appearance.is_asked(detection, expected, camera_frame.time_s):
            # Between frame and mount a margin leaves little of the water; colours tell the robot without one.
            bare = self._robot_mask(q, crop, margin_px=0.0)
            detection = self._appearance.recalled(detection, image, robot, bare, expected, followed=followed)
        looking = self._state.mode is not Mode.CHECK or elapsed_s >= self._variant.behaviour.check_s
        observation = replace(observation, blobs=detection.blobs if looking else ())
        blobs = self._follower.update(observation)
        if looking:
            detection = taken(detection, blobs)
        beyond_reach = self._follower.beyond_reach
        before = self._state
        self._state = next_state(
            before,
            self._variant.behaviour,
            elapsed_s=elapsed_s,
            found=bool(blobs),
            expected=expected is not None and observation.shows(expected),
            beyond_reach=beyond_reach,
            likely=self._follower.likely,
            doubted=self._follower.doubted,
        )
        if self._appearance is not None and blobs and self._follower.trusted and self._follower.alone:
            self._appearance.note(image, robot, detection, camera_frame.time_s, regained=not followed)
        if not self._searches:
            self._search.pause(self._passed_s, found=self._state.mode is Mode.TRACK and self._follower.trusted)
        elif looks_past_mirrors:
            self._search.look_past_mirrors(camera_frame.image, camera_frame.time_s, q, self._follower.clutter)
        self._q_command = np.clip(
            self._decide(before, observation, elapsed_s), self._gimbal.lowest, self._gimbal.highest
        )
        target = detection.centroid_px if detection.centroid_px is not None else expected
        return Step(
            time_s=camera_frame.time_s,
            mode=self._state.mode,
            q_estimated=q,
            q_command=self._q_command,
            corners_px=corners,
            crop=image,
            detection=detection,
            predicted_px=expected,
            error_px=None if target is None else _pair(error(target, crop.width_px, crop.height_px)),
            target_direction=self._follower.direction,
            beyond_reach=beyond_reach and self._follower.known,
        )

    def corners_px(self, report: MirrorReport) -> FloatArray:
        """Corners between which the crop of an image with this report will lie, shape (4, 2)."""
        return self._corners.corners(self._joints(report))

    def snapshot(self) -> dict[str, Any]:
        """State as plain numbers, exact through JSON."""
        return {
            "mode": str(self._state.mode),
            "hits": self._state.hits,
            "missed": self._state.missed,
            "unseen": self._state.unseen,
            "waited": self._state.waited,
            "seen": self._state.seen,
            "q_command": self._q_command.tolist(),
            "first_s": self._first_s,
            "last_s": None if math.isnan(self._last_s) else self._last_s,
            "intervals": list(self._intervals),
            "follower": self._follower.snapshot(),
            "search": self._search.snapshot(),
            "appearance": None if self._appearance is None else self._appearance.snapshot(),
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go on from a snapshot of a loop made with the same arguments, to the same bytes."""
        self._state = BehaviourState(
            mode=Mode(snapshot["mode"]),
            **{name: snapshot[name] for name in ("hits", "missed", "unseen", "waited", "seen")},
        )
        self._q_command = np.array(snapshot["q_command"])
        self._first_s = snapshot["first_s"]
        self._last_s = math.nan if snapshot["last_s"] is None else snapshot["last_s"]
        self._intervals = list(snapshot["intervals"])
        self._follower.restore(snapshot["follower"])
        self._search.restore(snapshot["search"])
        if self._appearance is not None:
            self._appearance.restore(snapshot["appearance"])

    def _joints(self, report: MirrorReport) -> FloatArray:
        """Joint values of a report; those asked for last where it is not finite."""
        return np.array(report.q if np.isfinite(report.q).all() else self._q_command, dtype=np.float64)

    def _robot_mask(self, q: FloatArray, crop: Crop, margin_px: float = MARGIN_PX) -> Mask | None:
        """255 in the pixels of the crop that may show the robot; None of a loop that is not told where it is."""
        if self._robot_view is None:
            return None
        return self._robot_view.mask(q, crop.width_px, crop.height_px, margin_px)

    @property
    def _searches(self) -> bool:
        """Whether it searches, and has no candidate."""
        return self._state.mode is Mode.SCAN and self._state.hits == 0

    @property
    def _interval_s(self) -> float:
        return median(self._intervals) if self._intervals else FIRST_INTERVAL_S

    def _crop_at(self, q: FloatArray) -> Crop:
        return Crop.of(self._corners.corners(q))

    def _note_time(self, time_s: float) -> float:
        """Note the time of an image; seconds since the first."""
        if self._first_s is None:
            self._first_s = time_s
        else:
            self._intervals = [*self._intervals, time_s - self._last_s][-INTERVALS:]
        self._last_s = time_s
        return time_s - self._first_s

    def _decide(self, before: BehaviourState, observation: Observation, elapsed_s: float) -> FloatArray:
        """Joint values to ask for in the mode that has been found."""
        mode = self._state.mode
        if mode is Mode.CHECK and self._check is not None:
            return self._check.at(elapsed_s)
        if mode is Mode.PREDICT:
            self._note_unseen(before, observation)
        if mode is not Mode.SCAN or self._state.hits > 0:
            return self._follower.follow(observation)
        if before.mode is not Mode.SCAN or before.hits > 0:
            self._search_on(before, observation)
        brief = not self._long_seen(before)
        if self._appearance is not None and before.mode is not Mode.SCAN and (brief or self._follower.doubted):
            self._appearance.forget()
        if (dropped := self._follower.forget(brief=brief)) is not None:
            self._search.note_dropped(dropped)
        return self._search.advance(self._passed_s, observation.q, self._follower.clutter)

    def _note_unseen(self, before: BehaviourState, observation: Observation) -> None:
        """While a target is waited for where it is predicted, keep what images say of where else it can have gone."""
        lost = self._follower.last_seen if self._variant.rescan == "reachable" else None
        if before.mode is Mode.TRACK and lost and self._long_seen(before):
            self._search.begin_lost(lost, observation.time_s)
        self._search.note_unseen(self._passed_s, observation.q, self._follower.clutter)

    def _search_on(self, before: BehaviourState, observation: Observation) -> None:
        """Begin a search, or take up the one that something else of the target's colour has broken off."""
        long_seen, last = self._long_seen(before), self._follower.last_seen
        reachable = self._variant.rescan == "reachable"
        if before.mode is Mode.SCAN:
            if reachable and long_seen and last is not None:
                self._search.begin_lost(last, observation.time_s)
            else:
                self._search.resume(observation.q)
        elif before.mode is Mode.CHECK or not reachable:
            self._search.begin(observation.q)
        elif not long_seen:
            # It was something else, or seen in fewer images than it has been missed in since.
            self._search.resume(observation.q)
        elif (alone := self._follower.last_alone) is not None:
            # The target is where it was before it seemed to grow into something else.
            self._search.begin_lost(alone, observation.time_s)
        elif self._follower.doubted or before.mode is Mode.TRACK:
            if self._follower.trusted:
                self._search.resume_everything(observation.q)
            else:
                # Of what was lost before it nothing is said by that this is something else.
                self._search.resume(observation.q)

    def _long_seen(self, before: BehaviourState) -> bool:
        """Whether what was followed was seen in more images than a target is waited for, or looked plainly like it."""
        return before.seen > self._variant.behaviour.predict_frames or self._follower.promising

    @property
    def _passed_s(self) -> float:
        """Since the image before."""
        return self._intervals[-1] if self._intervals else 0.0


def _servo_latency_s(rig: Rig) -> float:
    """From a command to the slower motor's answer: on average it waits for half a period of the pulses."""
    gaze = rig.require_gaze()
    return max(servo.pulse_period_ms / 2 + servo.latency_ms for servo in (gaze.servos.pan, gaze.servos.tilt)) / 1000


def _pair(values: FloatArray) -> tuple[float, float]:
    return float(values[0]), float(values[1])
