"""Paths of the joints: what they cover, and that the servos can follow them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optics.gaze.motion import JointSpeeds
from optics.layout import Layout
from rigs import Rig
from tracking.control.joint_paths import JointPath, check_path, raster_path
from tracking.control.search import OVERLAP, Search
from tracking.estimation.bearing import Bearing, Sight
from tracking.estimation.gimbal import Gimbal

RIG = Rig.load("aqua2")
GIMBAL = Gimbal(Layout.from_rig(RIG))
SPEEDS = JointSpeeds.from_rig(RIG)
VIEW = np.radians([22.0, 20.0])
STEP = (1 - OVERLAP) * VIEW


def test_a_path_is_as_fast_as_the_slower_joint_allows():
    """30 degrees of pan and 60 of tilt at 60 degrees/s take 1 s, 30 degrees of pan alone half."""
    path = JointPath.through(np.radians([[0, 0], [30, 60], [30, 60], [0, 60]]), SPEEDS)
    np.testing.assert_allclose(path.time_s, [0, 1, 1.5], rtol=1e-12)
    np.testing.assert_allclose(np.degrees(path.at(0.5)), [15, 30], rtol=1e-12)
    np.testing.assert_allclose(np.degrees([path.at(-1), path.at(9)]), [[0, 0], [0, 60]], atol=1e-12)


def test_the_check_drives_both_joints_over_their_range_in_the_time_it_is_given():
    path = check_path(GIMBAL, SPEEDS, 30.0)
    assert path.duration_s == pytest.approx(30.0)
    np.testing.assert_allclose([path.at(0.0), path.at(30.0)], [GIMBAL.middle] * 2)
    np.testing.assert_allclose(path.q.min(axis=0), GIMBAL.lowest)
    np.testing.assert_allclose(path.q.max(axis=0), GIMBAL.highest)
    # Twice the range a joint, one after the other: 620 degrees in 30 s, a third of what the paper's servos can.
    assert (np.abs(np.diff(path.q, axis=0)).max(axis=1) / np.diff(path.time_s)).max() < SPEEDS.pan / 2


def test_a_short_check_goes_as_far_as_the_servos_get():
    """620 degrees at 60 degrees/s take 10.3 s: in 3 s it is 0.29 of the range, to each side of the middle."""
    path = check_path(GIMBAL, SPEEDS, 3.0)
    assert path.duration_s == pytest.approx(3.0)
    share = 3.0 * 60 / 620
    np.testing.assert_allclose(path.q.max(axis=0) - GIMBAL.middle, share * (GIMBAL.highest - GIMBAL.lowest) / 2)
    assert (np.abs(np.diff(path.q, axis=0)).max(axis=1) / np.diff(path.time_s)).max() <= SPEEDS.pan * (1 + 1e-12)


def test_the_raster_leaves_no_gap():
    """Every gaze within reach lies within half a view of the path, across the strip in the crop's own axes.

    On the horizon, where strips of pan are farthest apart, to the front and over the zenith to the back.
    """
    path = raster_path(GIMBAL, SPEEDS, STEP)
    tried = np.array([path.at(time_s) for time_s in np.arange(0, path.duration_s, 1 / 60)])
    for tilt in (0.0, math.radians(90)):
        for pan in np.radians(np.linspace(-77.5, 77.5, 63)):
            near = np.abs(tried - GIMBAL.joint_values(pan, tilt)) * [1, 2] <= VIEW / 2
            assert near.all(axis=1).any(), f"pan {math.degrees(pan)}, tilt {math.degrees(tilt)}"


def test_the_raster_takes_the_cheaper_way():
    """Along tilt, which turns the gaze twice as fast: ceil(155 / 17.6) = 9 strips of 155 degrees, eight steps."""
    path = raster_path(GIMBAL, SPEEDS, STEP)
    expected_s = (9 * 155 + 8 * 155 / 9) / 60
    assert path.duration_s == pytest.approx(expected_s, rel=1e-12)
    slow_tilt = JointSpeeds(pan=SPEEDS.pan, tilt=SPEEDS.tilt / 20)
    along_pan = raster_path(GIMBAL, slow_tilt, STEP)
    assert np.abs(np.diff(along_pan.q[:, 0])).max() == pytest.approx(math.radians(155))


@pytest.mark.parametrize(("pan_deg", "end"), [(-20.0, 0), (0.0, 0), (20.0, -1)])
def test_a_raster_begins_at_its_nearer_end_when_the_mirror_is_there(pan_deg, end):
    """A mirror that only gets to the end at its servos' speed looks along the whole first strip, from its corner on."""
    path = raster_path(GIMBAL, SPEEDS, STEP)
    q = np.radians([pan_deg, 45.0])
    search = Search(GIMBAL, SPEEDS, VIEW)
    search.begin(q)
    mirror, seen = q, []
    # 77.5 degrees of tilt to the corner and 155 along the strip, at 60 degrees/s.
    for _ in range(round((77.5 + 155) / 60 * 100)):
        most = SPEEDS.pan / 100
        mirror = mirror + np.clip(search.advance(0.01, mirror) - mirror, -most, most)
        seen.append(mirror)
    along = np.array(seen)[np.abs(np.array(seen)[:, 0] - path.q[end, 0]) < 1e-9, 1]
    # It turns round up to a step of 0.6 degrees before the corner, and the command is one ahead.
    limits = [GIMBAL.lowest[1], GIMBAL.highest[1]]
    np.testing.assert_allclose([along.min(), along.max()], limits, atol=2 * SPEEDS.tilt / 100)


def test_a_search_does_not_run_ahead_of_lost_images():
    search = Search(GIMBAL, SPEEDS, VIEW)
    search.begin(GIMBAL.middle)
    before = search.advance(0.0, GIMBAL.middle)
    after = search.advance(60.0, GIMBAL.middle)
    assert (np.abs(after - before) * [1, 2] <= VIEW).all()


def test_a_search_goes_on_from_a_snapshot():
    """Also one for a lost target, and on into the search of everything that follows it."""
    bearing = Bearing(direction=GIMBAL.gaze([0.1, 0.2]), rate=np.array([0.0, 0.1, 0.0]))
    whole, resumed = Search(GIMBAL, SPEEDS, VIEW), Search(GIMBAL, SPEEDS, VIEW)
    whole.begin_lost(Sight(bearing=bearing, time_s=0.0, hidden=True), 1.0)
    whole.advance(0.7, np.zeros(2))
    resumed.restore(whole.snapshot())
    q = np.zeros(2)
    for _ in range(400):
        goal = whole.advance(1 / 30, q)
        np.testing.assert_array_equal(goal, resumed.advance(1 / 30, q))
        q = q + np.clip(goal - q, -SPEEDS.pan / 30, SPEEDS.pan / 30)


def test_a_search_is_resumed_where_it_was_broken_off():
    """Broken off after 2 s, resumed from elsewhere: it waits at that place until the mirror has come, then goes on."""
    search, whole = Search(GIMBAL, SPEEDS, VIEW), Search(GIMBAL, SPEEDS, VIEW)
    for each in (search, whole):
        each.begin(np.zeros(2))
        for _ in range(90):
            last = each.advance(1 / 30, GIMBAL.middle)
    away = last + np.array([0.0, SPEEDS.tilt * 0.5])
    search.resume(away)
    for _ in range(15):
        np.testing.assert_allclose(search.advance(1 / 30, away), last, atol=1e-9)
    for _ in range(100):
        np.testing.assert_allclose(search.advance(1 / 30, away), whole.advance(1 / 30, away), atol=1e-9)
