"""The largest angular speed: the arc in closed form, the search on made-up loops, and servos as its upper bound."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dives.evaluation import tracking_rate
from dives.evaluation.synthetic_camera import BALL, DRAWN_BALL, SyntheticCamera
from dives.evaluation.tracking_rate import (
    FASTEST_DEG_PER_S,
    PRECISION,
    SLOWEST_DEG_PER_S,
    Arc,
    Chase,
    Trial,
    _tried,
    check_reachable,
    largest_angular_speed,
)
from dives.metrics.holding import LOSS_FRAMES
from optics import OpticalTrain
from optics.layout import Layout
from rigs import Rig
from tracking.loop.variants import VARIANTS
from tracking.perception import Crop, ExactCorners, detect


@pytest.fixture(scope="module")
def rig():
    return Rig.load("aqua2")


@given(speed=st.floats(1, 300))
def test_the_arc_is_run_to_its_end_and_evenly(speed):
    """A quarter of 120 degrees to gain speed from rest, the rest at that speed."""
    arc = Arc()
    whole = arc.duration_s(speed)
    assert arc.angle_deg(0, speed) == -60
    assert arc.angle_deg(whole, speed) == pytest.approx(60)
    assert arc.angle_deg(2 * 30 / speed, speed) == pytest.approx(-30)
    step = 1e-3 * whole
    late = [arc.angle_deg(share * whole, speed) for share in (0.5, 0.999)]
    assert late[1] - late[0] == pytest.approx(0.499 * whole * speed, rel=1e-9)
    # It starts from rest: after a step it has gone half the square of it.
    assert arc.angle_deg(step, speed) + 60 == pytest.approx(0.5 * speed**2 / 60 * step**2, rel=1e-6)


def test_places_on_the_arc():
    assert Arc(distance_m=3).place_m(90) == pytest.approx([0, 3, 0])
    assert Arc(axis="elevation", distance_m=3).place_m(30) == pytest.approx([3 * np.sqrt(0.75), 0, 1.5])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [({"from_deg": 5, "to_deg": 5}, "from less to more"), ({"radius_m": 3}, "between 0 and its distance")],
)
def test_arcs_that_cannot_be(wrong, message):
    with pytest.raises(ValueError, match=message):
        Arc(**wrong)


def test_an_arc_beyond_the_joints_is_refused(rig):
    """Pan reaches 77.5 degrees, the rear over the zenith: level to the side at 90 degrees is a blind wedge."""
    check_reachable(rig, Arc(from_deg=-77, to_deg=77))
    with pytest.raises(ValueError, match="within the joints' reach, got azimuth 80 degrees"):
        check_reachable(rig, Arc(from_deg=0, to_deg=80))


def tried(limit):
    """Search on a loop that follows everything up to a limit."""
    return _tried(
        lambda speed: Trial(speed_deg_per_s=speed, longest_gap_frames=0 if speed <= limit else 9, gaze_error_rms_deg=0)
    )


@given(limit=st.floats(SLOWEST_DEG_PER_S, 0.999 * FASTEST_DEG_PER_S))
def test_the_search_ends_at_the_limit(limit):
    found = max(trial.speed_deg_per_s for trial in tried(limit) if trial.followed)
    assert limit * (1 - PRECISION) / (1 + PRECISION) <= found <= limit


def test_the_search_has_ends():
    assert not any(trial.followed for trial in tried(0.5))
    assert max(trial.speed_deg_per_s for trial in tried(1e9)) == FASTEST_DEG_PER_S


@pytest.mark.parametrize(("gap", "followed"), [(LOSS_FRAMES, True), (LOSS_FRAMES + 1, False)])
def test_what_counts_as_followed(gap, followed):
    assert Trial(speed_deg_per_s=1, longest_gap_frames=gap, gaze_error_rms_deg=0).followed is followed


@pytest.mark.parametrize("q_deg", [(0, 0), (30, -10), (-50, 20), (10, 60)])
def test_the_drawn_ball_is_where_the_train_puts_it(rig, q_deg):
    """A small ball off the axis: its centroid is its centre's projection.

    OpenCV fills the pixels on the outline too. If that moved the outline of one half by half a pixel, a disc's centroid
    would move by a quarter.
    """
    q = np.radians(q_deg)
    layout = Layout.from_rig(rig)
    train = OpticalTrain.from_rig(rig, q1=q[0], q2=q[1])
    axis = train.trace([[rig.camera.cx_px + 10, rig.camera.cy_px - 8]])
    in_camera = (axis.origin_m + 2 * axis.direction)[0]
    target_m = layout.body_from_camera.apply(in_camera) - layout.body_from_gimbal.translation
    camera = SyntheticCamera(rig, 0.05)
    assert camera.pixels(q, target_m[np.newaxis])[0] == pytest.approx(
        train.project(in_camera[np.newaxis]).pixels[0], abs=1e-6
    )
    rows, columns = np.nonzero((camera.image(q, target_m) == BALL).all(axis=2))
    assert (columns.mean(), rows.mean()) == pytest.approx(train.project(in_camera[np.newaxis]).pixels[0], abs=0.25)


def test_the_ball_ends_at_the_mirrors_edge(rig):
    """Far beside the gaze there is none, and the detector finds what is drawn, and nothing else."""
    camera = SyntheticCamera(rig, 0.03)
    crop = Crop.of(ExactCorners(rig).corners([0, 0]))
    ahead, beside = (camera.image(np.zeros(2), np.array(place)) for place in ([2.0, 0, 0], [0, 2.0, 0]))
    (blob,) = detect(crop.take(ahead), DRAWN_BALL).blobs
    # The crop stretches a tilted mirror's lower edge more than its upper one: a disc's middle is not its centroid, by
    # the square of its size. For 10 px that is a fifth of a pixel; the rest is the mask's whole pixels.
    assert blob.centroid_px == pytest.approx(crop.centre_px, abs=0.5)
    assert not (beside == BALL).all(axis=2).any()


def test_no_loop_outruns_its_servos(rig):
    """The paper's servos turn by 60 degrees a second, and so does the gaze about the pan axis.

    A target at 90 degrees a second gets away by 30 * 90 / 90 = 30 degrees on three quarters of an arc of 120 degrees:
    more than half the crop's field of view (14 degrees) and five images (15 degrees) together. At three quarters of
    the servos' speed the loop must follow.
    """
    chase = Chase(rig, VARIANTS["default"], Arc(), seed=0, frame_rate_hz=30.0)
    assert chase.acquired
    fast, slow, again = chase.trial(90.0), chase.trial(45.0), chase.trial(90.0)
    assert slow.followed
    assert not fast.followed
    # Each trial starts from the same state.
    assert fast == again


def test_seeds_are_averaged(rig, monkeypatch):
    """Loops that follow up to 20 and 40 degrees a second, and one that does not find the target at rest."""

    class Made:
        def __init__(self, *_, seed, **__):
            self.seed, self.acquired = seed, seed < 2

        def trial(self, speed):
            late = 0 if speed <= 20 * (self.seed + 1) else LOSS_FRAMES + 1
            return Trial(speed_deg_per_s=speed, longest_gap_frames=late, gaze_error_rms_deg=speed / 10)

    monkeypatch.setattr(tracking_rate, "Chase", Made)
    told = []
    found = largest_angular_speed(rig, VARIANTS["default"], Arc(), seeds=3, progress=lambda *done: told.append(done))
    assert found.by_seed_deg_per_s == pytest.approx((20, 40, 0), rel=2 * PRECISION)
    assert found.interval.estimate == pytest.approx(20, rel=2 * PRECISION)
    assert found.errors_deg[:2] == pytest.approx([2, 4], rel=2 * PRECISION)
    assert found.errors_deg[2] is None
    assert told == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize(("wrong", "value"), [("seeds", 0), ("frame_rate_hz", 0.0)])
def test_impossible_numbers_are_refused(rig, wrong, value):
    with pytest.raises(ValueError, match="one seed or more and a rate above 0"):
        largest_angular_speed(rig, VARIANTS["default"], Arc(), **{wrong: value})
