"""The closed loop without rendering: a drawn ball through the exact train, simulated servos, every variant."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from dives.evaluation.synthetic_camera import BALL, DRAWN_BALL, SyntheticCamera
from dives.views.direct_view import direct_view
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import Rig
from tracking.control.gaze_follower import GazeFollower
from tracking.control.paper_law import GAIN
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.own_motion import SOONEST_S
from tracking.estimation.track_evidence import PLAIN_S
from tracking.estimation.track_record import MOST_PLAIN
from tracking.loop.loop import TrackingLoop
from tracking.loop.variants import VARIANTS, Variant
from tracking.mirrors.simulated import SimulatedMirrors
from tracking.perception import CornerSamples, DetectorSettings, ExactCorners
from tracking.protocols import CameraFrame, MirrorReport
from tracking.records import Blob, Detection, Mode, Step

RIG = Rig.load("aqua2")
GIMBAL = Gimbal(Layout.from_rig(RIG))
RADIUS_M = 0.1
RATE_HZ = 30.0
LATENCY_S = 0.02

START_DEG = -69.75
"""Azimuth of the raster's first strip: a target that waits there is found at once."""

WAIT_S = 1.0
"""It is found in less: 0.5 s from the strip's lower end up to the horizon, three images, and the servos' delays."""

SETTLED_S = 4.0
"""Before the first image the mirrors are sent to where the raster begins, from wherever they stood when power came
on. The functional check tells the driver where they are in a dive; these leave it out, for time."""

Path = Callable[[float], FloatArray]
"""Target's centre from the centre of M2, body frame, metres, at a time."""


@cache
def camera() -> SyntheticCamera:
    return SyntheticCamera(RIG, RADIUS_M)


def place(azimuth_deg: float, elevation_deg: float, distance_m: float = 2.0) -> FloatArray:
    azimuth, elevation = math.radians(azimuth_deg), math.radians(elevation_deg)
    level = math.cos(elevation)
    return distance_m * np.array([level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)])


def open_spiral(time_s: float, *, turning_deg_per_s: float = 6.0) -> FloatArray:
    """The paper's: level with the robot first, around it, rising and going away."""
    moving_s = max(time_s - WAIT_S, 0.0)
    azimuth = math.radians(START_DEG + turning_deg_per_s * moving_s)
    radius, height = 1.8 + 0.03 * moving_s, 0.04 * moving_s
    return np.array([radius * math.cos(azimuth), radius * math.sin(azimuth), height])


def without_check(name: str) -> Variant:
    """A loop that looks at once, and whose search is the raster that `START_DEG` is made for."""
    return replace(VARIANTS[name].without_check(), likely_first=False)


class Dive:
    """A loop on its servos; `errors_deg` is the angle from the true gaze to the target, frame by frame.

    `bias`: what nobody knows to lie between the servos' horns and the joints, radians.
    """

    def __init__(
        self,
        variant: Variant,
        *,
        rate_hz: float = RATE_HZ,
        seed: int = 1,
        bias: FloatArray | None = None,
        detector: DetectorSettings = DRAWN_BALL,
    ):
        self.loop = TrackingLoop(camera().rig, variant, detector=detector)
        self.mirrors = SimulatedMirrors.from_rig(RIG, seed=seed)
        self.mirrors.command([math.radians(START_DEG), GIMBAL.lowest[1]], 0.0)
        self.rate_hz, self.bias = rate_hz, np.zeros(2) if bias is None else bias
        self.steps: list[Step] = []
        self.errors_deg: list[float] = []

    def run(self, path: Path, until_s: float, hidden: tuple[float, float] = (0.0, 0.0)) -> Dive:
        while (time_s := len(self.steps) / self.rate_hz) < until_s:
            q, target = self.mirrors.true_q(SETTLED_S + time_s) + self.bias, path(time_s)
            image = camera().image(q, target)
            if hidden[0] <= time_s < hidden[1]:
                image = np.zeros_like(image)
            step = self.loop.step(CameraFrame(image=image, time_s=time_s), self.mirrors.report(SETTLED_S + time_s))
            self.mirrors.command(step.q_command, SETTLED_S + time_s + LATENCY_S)
            gaze = GIMBAL.gaze(q)
            self.steps.append(step)
            self.errors_deg.append(math.degrees(math.atan2(np.linalg.norm(np.cross(gaze, target)), gaze @ target)))
        return self

    def since(self, time_s: float) -> tuple[float, float]:
        """Share of the images with a detection, RMS error in degrees."""
        first = round(time_s * self.rate_hz)
        held = np.mean([step.detection.centroid_px is not None for step in self.steps[first:]])
        return float(held), float(np.sqrt(np.mean(np.square(self.errors_deg[first:]))))

    def modes(self, from_s: float = 0.0) -> str:
        return "".join(step.mode.value[0] for step in self.steps[round(from_s * self.rate_hz) :])


@cache
def on_the_spiral(name: str) -> Dive:
    return Dive(without_check(name)).run(open_spiral, WAIT_S + 10.0)


def test_the_default_holds_the_open_spiral():
    """Rationale: the issue's numbers for clear water, 97 % of the time and 1.5 degrees RMS, less light and water.

    A target at 2 m turns 60 degrees around the robot at 6 degrees/s, rising. Expected: never out of view from
    acquisition on, and no larger an error than the servos' backlash, 0.25 degrees to each side, which tilt doubles:
    0.56 degrees RMS. Seen: 0.52, with other seeds of the servos 0.40 to 0.42.
    """
    dive = on_the_spiral("default")
    assert dive.modes(WAIT_S) == "t" * 300
    held, rms_deg = dive.since(WAIT_S)
    assert held == 1.0
    assert rms_deg < math.hypot(0.25, 0.5)


def test_the_papers_loop_holds_it_less_well_and_as_printed_not_at_all():
    """`paper` lags (0.9 degrees RMS); `paper-literal` never corrects what is above or below, and loses it."""
    held, rms_deg = on_the_spiral("paper").since(WAIT_S)
    assert held == 1.0
    assert rms_deg > 1.5 * on_the_spiral("default").since(WAIT_S)[1]
    held, _ = on_the_spiral("paper-literal").since(WAIT_S)
    assert held < 0.7


def test_the_papers_loop_lags_by_its_gain():
    """A proportional law on the last command follows a rate w by w T / gain behind.

    The crop shows the error from the virtual camera, 0.226 m behind M2: at 2 m by 2 / 2.226 smaller. 12 degrees/s make
    12 / 30 / (1/4) 2.226 / 2 = 1.78 degrees. A tenth is for the backlash of the servos, which pan takes up in one
    direction, 0.25 degrees, and for the corners of eq. 6.
    """
    path = lambda time_s: place(START_DEG + 12.0 * max(time_s - WAIT_S, 0.0), 0.0)  # noqa: E731
    dive = Dive(without_check("paper")).run(path, WAIT_S + 8.0)
    expected = 12.0 / RATE_HZ / GAIN * 2.226 / 2.0
    assert np.median(dive.errors_deg[-150:]) == pytest.approx(expected, abs=0.25 + 0.1 * expected)


@pytest.mark.parametrize("bias_deg", [(2.0, 0.0), (-1.0, 1.5)])
def test_a_constant_error_of_the_joints_cancels(bias_deg):
    """Direction and command carry the same error: the target is met as well as without it.

    But for the crop, which is cut at the wrong place: 2 degrees of tilt move the corners by some pixels, no more.
    """
    dive = Dive(without_check("default"), bias=np.radians(bias_deg)).run(open_spiral, WAIT_S + 6.0)
    held, rms_deg = dive.since(WAIT_S + 1)
    assert held == 1.0
    assert rms_deg < on_the_spiral("default").since(WAIT_S)[1] + 0.3


@pytest.mark.parametrize("name", ["default", "paper"])
def test_a_target_is_held_over_the_zenith(name):
    """Up ahead, over the zenith and down behind, at 15 degrees/s, where the crop turns upside down."""
    path = lambda time_s: _over(START_DEG, 15.0 * max(time_s - WAIT_S, 0.0))  # noqa: E731
    dive = Dive(without_check(name)).run(path, WAIT_S + 10.0)
    assert dive.modes(WAIT_S) == "t" * 300
    assert dive.since(WAIT_S)[1] < {"default": 0.7, "paper": 3.5}[name]


def _over(azimuth_deg: float, elevation_deg: float) -> FloatArray:
    return place(azimuth_deg, elevation_deg) if elevation_deg <= 90 else place(azimuth_deg + 180, 180 - elevation_deg)


def test_servos_bound_the_speed_of_a_target():
    """Pan turns the gaze at 60 degrees/s ahead, tilt at 120: 50 and 100 are followed, 75 and 150 are not."""
    for path, speeds in (
        (lambda time_s, speed: place(min(START_DEG + speed * max(time_s - WAIT_S, 0.0), 70.0), 0.0), (50.0, 75.0)),
        (lambda time_s, speed: _over(START_DEG, min(speed * max(time_s - WAIT_S, 0.0), 170.0)), (100.0, 150.0)),
    ):
        slow, fast = (
            Dive(without_check("default")).run(
                lambda time_s, path=path, speed=speed: path(time_s, speed), WAIT_S + 140.0 / speed
            )
            for speed in speeds
        )
        # It jumps to its speed within an image: the first few see it run ahead.
        assert set(slow.modes(WAIT_S)) == {"t"}
        assert "p" in fast.modes(WAIT_S)


def test_a_hidden_target_is_predicted_and_found_again():
    """14 images without it, while it moves on: the 15 of the prediction are enough.

    The filter knows the rate to 1.19 q^(3/8) (r T)^(1/8) = 6 degrees/s (square root of the steady state's variance, for
    acceleration q = (20 degrees)^2/s^3 and measurements of r = (0.5 degrees)^2 every T = 1/30 s): within 14 / 30 s the
    direction is off by 2.8 degrees, one standard deviation; what the crop sees is 9 to each side.
    """
    dive = Dive(without_check("default")).run(open_spiral, 6.0, hidden=(4.0, 4.0 + 14 / RATE_HZ))
    assert dive.modes(4.0)[:14] == "p" * 14
    assert dive.modes(4.0 + 15 / RATE_HZ) == "t" * (60 - 15)
    hidden = dive.steps[120:134]
    assert all(step.predicted_px is not None and step.error_px is not None for step in hidden)
    assert max(dive.errors_deg[120:134]) < 6.0 * 14 / RATE_HZ


def test_a_lost_target_is_searched_where_it_was_lost():
    """Hidden for 4 s, while it goes on by 8 degrees: found again about the place. The raster begins elsewhere."""
    path = lambda time_s: open_spiral(time_s, turning_deg_per_s=2.0)  # noqa: E731
    dive = Dive(without_check("default")).run(path, 15.0, hidden=(3.0, 7.0))
    modes = dive.modes(3.0)
    assert modes[:16] == "p" * 15 + "s"
    assert modes[-30:] == "t" * 30
    searched = [np.degrees(step.q_command) for step in dive.steps[120:210]]
    assert np.ptp(searched, axis=0).max() < 60


@pytest.mark.parametrize(("speed", "kept"), [(None, True), (0.7, False)])
def test_a_ball_that_stays_is_not_followed_for_one_that_swims(speed, kept):
    """A second ball that looks like the target is dropped after 3 s, as that would have swum 2 m, and not met again."""
    still = Dive(without_check("default"), detector=replace(DRAWN_BALL, least_speed_m_per_s=speed))
    modes = still.run(lambda _: place(START_DEG, 0.0), 9.0).modes(WAIT_S)
    tracked = len(modes) - len(modes.lstrip("t"))
    assert (tracked == len(modes)) is kept
    if not kept:
        assert tracked / RATE_HZ == pytest.approx(SOONEST_S, abs=WAIT_S)
        assert set(modes[tracked:]) == {"s"}


def test_what_is_seen_in_few_images_does_not_end_a_search():
    """A target is lost, and 1 s later something of its colour is seen elsewhere for 5 images.

    Expected: the search for it goes on where it was broken off, and finds the target when that is back after 4 s.
    What was seen in between, 40 degrees away, is not searched for.
    """
    dive = Dive(without_check("default"))
    dive.run(lambda _: place(START_DEG, 10.0), 3.0, hidden=(2.0, 3.0))
    before = dive.loop.snapshot()["search"]
    gaze = GIMBAL.gaze(dive.mirrors.true_q(SETTLED_S + 3.0))
    dive.run(lambda _: 2.0 * gaze, 4.0, hidden=(3.0 + 5 / RATE_HZ, 4.0))
    modes = dive.modes(3.0)
    assert modes.lstrip("s")[:3] == "ttt"
    # For as many images as it was seen in, it is looked for where it is predicted.
    followed = modes.strip("s")
    assert followed.count("p") == 2 + followed.count("t")
    after = dive.loop.snapshot()["search"]
    assert after["lost"]["direction"] == before["lost"]["direction"]
    # It has gone on while images showed what was not it.
    assert after["lost"]["age_s"] == pytest.approx(before["lost"]["age_s"] + 1.0)
    dive.run(lambda _: place(START_DEG, 10.0), 16.0)
    assert dive.modes(15.0) == "t" * 30


@pytest.mark.parametrize(("images", "remembered"), [(4, True), (12, False), (40, False)])
def test_what_was_tracked_briefly_is_passed_by_when_it_is_lost(images, remembered):
    """Else a piece of a reef that is the target's colour in every third image holds the search for good.

    What looked plainly like the target for longer is sought where it can have gone.
    """
    still = place(START_DEG, 0.0)
    dive = Dive(without_check("default"))
    while dive.modes()[-images:] != "t" * images:
        dive.run(lambda _: still, (len(dive.steps) + 1) / RATE_HZ - 1e-9)
    lost_s = len(dive.steps) / RATE_HZ
    while dive.modes()[-1] != "s":
        dive.run(lambda _: still, (len(dive.steps) + 1) / RATE_HZ - 1e-9, hidden=(lost_s, math.inf))
    snapshot = dive.loop.snapshot()
    assert bool(snapshot["follower"]["evidence"]["clutter"]) == remembered
    assert (snapshot["search"]["lost"] is None) == remembered


@pytest.mark.parametrize(("images", "sought"), [(4, False), (9, True)])
def test_a_candidate_that_gets_away_is_sought(images, sought):
    """What the crop's edge cuts in every image is no target yet: one that looked plainly like it is not given up."""
    cut = Blob(area_px=500.0, centroid_px=(8.0, 100.0), box_px=(0, 80, 16, 40), circularity=0.7, log_odds=5.0)
    taken = 0

    def detect(crop: NDArray[np.uint8], *_: object) -> Detection:
        nonlocal taken
        taken += 1
        blobs = (cut,) if 10 <= taken < 10 + images else ()
        return Detection(mask=np.zeros(crop.shape[:2], np.uint8), blobs=blobs, centroid_px=None)

    dive = Dive(without_check("default"))
    dive.loop = TrackingLoop(RIG, without_check("default"), detector=detect)
    dive.run(lambda _: place(0.0, 0.0), 1.0)
    assert dive.loop.snapshot()["hits"] == 0 and "t" not in dive.modes()
    assert (dive.loop.snapshot()["search"]["lost"] is not None) is sought


def test_a_search_goes_on_where_a_pale_thing_broke_it_off(monkeypatch):
    """What stands still and is never plain is dropped after 4 s: the places that were looked at before it come last."""
    monkeypatch.setattr("tracking.loop.loop.plainness", lambda *_, **__: 1.0)
    monkeypatch.setattr("tracking.estimation.track_evidence.PLAIN_LOG_ODDS", 2 * MOST_PLAIN)
    dive = Dive(without_check("default"))
    searched_s: list[float] = []
    while "ts" not in dive.modes() and len(dive.steps) < 10 * RATE_HZ:
        dive.run(lambda _: place(START_DEG, 0.0), (len(dive.steps) + 1) / RATE_HZ - 1e-9)
        searched_s.append(dive.loop.snapshot()["search"]["everywhere"]["time_s"])
    seen = dive.modes().index("t")
    assert len(dive.steps) - seen == pytest.approx(PLAIN_S * RATE_HZ, abs=5)
    assert dive.loop.snapshot()["search"]["lost"] is None
    assert 0 < searched_s[seen] <= searched_s[-1] < searched_s[seen] + 0.2


@pytest.mark.parametrize("alone", [True, False])
def test_of_what_is_in_one_piece_with_something_larger_no_colours_are_learned(monkeypatch, alone):
    """They would be those of what hides the target."""
    monkeypatch.setattr(GazeFollower, "alone", alone)
    dive = Dive(without_check("default"), detector=DetectorSettings()).run(lambda _: place(START_DEG, 0.0), 2.0)
    assert dive.modes()[-1] == "t"
    assert (dive.loop.snapshot()["appearance"]["colours"][0] is not None) is alone


def test_the_first_seconds_check_the_joints():
    variant = replace(VARIANTS["paper"], behaviour=replace(VARIANTS["paper"].behaviour, check_s=3.0))
    dive = Dive(variant).run(lambda time_s: place(START_DEG, 0.0), 4.0)
    modes = dive.modes()
    assert modes[:90] == "c" * 90
    assert "c" not in modes[90:]
    commands = np.array([step.q_command for step in dive.steps[:90]])
    # 180 degrees of the servos' way in 3 s: 22.5 to each side of the middle, pan first.
    assert np.degrees(commands.min(axis=0)) == pytest.approx([-22.5, 22.5], abs=2)
    assert np.degrees(commands.max(axis=0)) == pytest.approx([22.5, 67.5], abs=2)
    assert all(step.predicted_px is None for step in dive.steps[:90])


@pytest.mark.parametrize("rate_hz", [10.0, 60.0])
def test_other_rates(rate_hz):
    dive = Dive(without_check("default"), rate_hz=rate_hz).run(open_spiral, WAIT_S + 4.0)
    assert set(dive.modes(WAIT_S)) == {"t"}
    assert dive.since(WAIT_S)[1] < 0.7


@pytest.mark.parametrize("name", VARIANTS)
def test_a_loop_goes_on_from_a_snapshot_to_the_same_bytes(name):
    """Through check, scan, track, prediction and search: at every 17th image a new loop takes over, through JSON."""
    settings = replace(VARIANTS[name].behaviour, check_s=0.5)
    variant = replace(VARIANTS[name], behaviour=settings, likely_first=False)
    whole, passed_on = Dive(variant), Dive(variant)
    path = lambda time_s: open_spiral(time_s - 2.0)  # noqa: E731  # the mirror comes back from the check
    whole.run(path, 6.0, hidden=(4.0, 6.0))
    for frame in range(0, 180, 17):
        state = json.loads(json.dumps(passed_on.loop.snapshot()))
        passed_on.loop = TrackingLoop(camera().rig, variant, detector=DRAWN_BALL)
        assert not passed_on.loop.started
        passed_on.loop.restore(state)
        assert passed_on.loop.started == (frame > 0)
        passed_on.run(path, min((frame + 17) / RATE_HZ, 6.0) - 1e-9, hidden=(4.0, 6.0))
    assert set(whole.modes()) == set("cstp")
    assert len(whole.steps) == len(passed_on.steps)
    for ours, theirs in zip(whole.steps, passed_on.steps, strict=True):
        assert _bytes(ours) == _bytes(theirs)
    assert whole.loop.snapshot() == passed_on.loop.snapshot()


def test_a_snapshot_holds_all_that_the_behaviour_counts():
    loop = TrackingLoop(RIG, VARIANTS["default"])
    loop.step(camera_frame(1.0), report(1.0))
    state = loop.snapshot() | {"mode": "predict", "hits": 1, "missed": 2, "unseen": 3}
    other = TrackingLoop(RIG, VARIANTS["default"])
    other.restore(json.loads(json.dumps(state)))
    assert other.snapshot() == state


def _bytes(step: Step) -> tuple[object, ...]:
    direction = None if step.target_direction is None else step.target_direction.tobytes()
    arrays = (step.q_estimated, step.q_command, step.corners_px, step.crop, step.detection.mask)
    return (step.time_s, step.mode, step.predicted_px, step.error_px, direction, *(array.tobytes() for array in arrays))


def camera_frame(time_s: float, value: int = 0) -> CameraFrame:
    return CameraFrame(image=np.full((480, 640, 3), value, dtype=np.uint8), time_s=time_s)


def report(time_s: float, q: tuple[float, float] = (0.0, 0.0)) -> MirrorReport:
    return MirrorReport(q=np.array(q), time_s=time_s, measured=False)


@pytest.mark.parametrize("name", VARIANTS)
def test_black_images_reports_that_are_not_finite_and_jumps_in_time_are_lived_through(name):
    loop = TrackingLoop(RIG, without_check(name))
    nan = (math.nan, math.nan)
    # Seconds lost here and there; a report that fails; a pose at which the camera does not see M2's face.
    for time_s, q in ((0.0, (0.0, 0.0)), (0.1, nan), (7.0, (0.2, 0.1)), (7.001, (0.0, 2.3)), (3600.0, nan)):
        step = loop.step(camera_frame(time_s), report(time_s, q))
        assert np.isfinite(step.q_command).all()
        assert np.isfinite(step.q_estimated).all()
        assert step.mode is Mode.SCAN
        assert step.crop.shape == (240, 320, 3)
        assert step.detection.blobs == ()
        assert step.error_px is None


@pytest.mark.parametrize("name", ["default", "paper"])
def test_a_target_survives_lost_images(name):
    """Every third image missing, and once half a second."""
    dive = Dive(without_check(name)).run(open_spiral, WAIT_S + 1)
    loop, mirrors, modes = dive.loop, dive.mirrors, []
    for frame in range(60, 210):
        if frame % 3 == 0 or 130 <= frame < 145:
            continue
        time_s = frame / RATE_HZ
        image = camera().image(mirrors.true_q(SETTLED_S + time_s), open_spiral(time_s))
        step = loop.step(CameraFrame(image=image, time_s=time_s), mirrors.report(SETTLED_S + time_s))
        mirrors.command(step.q_command, SETTLED_S + time_s + LATENCY_S)
        modes.append(step.mode)
    assert set(modes) == {Mode.TRACK}


def test_time_must_grow_and_images_be_images():
    loop = TrackingLoop(RIG, VARIANTS["default"])
    loop.step(camera_frame(1.0), report(1.0))
    for time_s in (1.0, 0.5, math.nan):
        with pytest.raises(ValueError, match=r"expected an image later than the last, at 1.0 s, got one at"):
            loop.step(camera_frame(time_s), report(time_s))
    with pytest.raises(ValueError, match="expected image of uint8"):
        loop.step(CameraFrame(image=np.zeros((480, 640)), time_s=2.0), report(2.0))


def test_a_image_that_is_refused_changes_nothing():
    loop = TrackingLoop(RIG, VARIANTS["default"])
    loop.step(camera_frame(1.0), report(1.0))
    before = loop.snapshot()
    with pytest.raises(ValueError, match="expected image of uint8"):
        loop.step(CameraFrame(image=np.zeros((480, 640)), time_s=2.0), report(2.0))
    assert loop.snapshot() == before


def test_rigs_without_mirrors_are_refused():
    with pytest.raises(ValueError, match="expected a rig with mirrors"):
        TrackingLoop(Rig.load("bench"), VARIANTS["default"])


def test_samples_of_ones_own_are_what_eq_6_interpolates():
    exact = ExactCorners(RIG)
    q = np.radians([(-70, -30), (70, -30), (-70, 120), (70, 120), (0, 0)])
    shifted = CornerSamples(q=q, corners_px=exact.corners(q) + 7.0)
    step = TrackingLoop(RIG, VARIANTS["paper"], samples=shifted).step(camera_frame(0.0), report(0.0))
    np.testing.assert_allclose(step.corners_px, exact.corners(np.zeros(2)) + 7.0, atol=1e-9)


def test_a_search_turns_to_what_shows_past_the_mirrors():
    """Closed loop, a ball that the direct view shows and the search comes to last: looked at at once with it."""
    view = direct_view(RIG, [])
    assert view is not None
    rows, columns = np.nonzero(view.water)
    row, column = rows[len(rows) // 2], columns[len(rows) // 2]
    target = 2.0 * view.direction[row, column].astype(np.float64)
    x, y = (int((at + 0.5) * 640 / view.water.shape[1]) for at in (column, row))
    found_s = []
    for shown in (None, view):
        dive = Dive(without_check("default"))
        dive.loop = TrackingLoop(camera().rig, without_check("default"), detector=DRAWN_BALL, direct_view=shown)
        looks = 0
        while set(dive.modes()) <= {"s"} and len(dive.steps) < 600:
            time_s = len(dive.steps) / RATE_HZ
            q = dive.mirrors.true_q(SETTLED_S + time_s)
            image = cv2.circle(camera().image(q, target), (x, y), 15, BALL, cv2.FILLED)
            looks += dive.loop.looks_past_mirrors(time_s)
            step = dive.loop.step(
                CameraFrame(image=np.asarray(image), time_s=time_s), dive.mirrors.report(SETTLED_S + time_s)
            )
            dive.mirrors.command(step.q_command, SETTLED_S + time_s + LATENCY_S)
            dive.steps.append(step)
        assert dive.modes()[-1] == "t"
        assert GIMBAL.gaze(q) @ target / np.linalg.norm(target) > math.cos(math.radians(15))
        assert looks == pytest.approx(0 if shown is None else len(dive.steps) / RATE_HZ / 0.2, abs=2)
        found_s.append(time_s)
    assert found_s[1] < found_s[0] - 1.0


def test_variants_differ_as_they_say():
    literal, paper, default = VARIANTS["paper-literal"], VARIANTS["paper"], VARIANTS["default"]
    assert [variant.law for variant in (literal, paper, default)] == ["paper-literal", "paper", "gaze"]
    assert [variant.contrast for variant in (literal, paper, default)] == [False, False, True]
    assert [variant.direct_view for variant in (literal, paper, default)] == [False, False, True]
    assert literal.behaviour == paper.behaviour
    assert (paper.behaviour.check_s, paper.behaviour.confirm_frames, paper.behaviour.predict_frames) == (30.0, 1, 30)
    with pytest.raises(ValueError, match=r"target_distance_m above 0, got 0.*control_latency_s"):
        replace(default, target_distance_m=0.0, control_latency_s=-1.0)
