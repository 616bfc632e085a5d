"""The longest time for which a mirror could have shown a target, against what speeds and angles say."""

import numpy as np
import pytest

from dives.metrics.search_time import gaze_view
from dives.planning.followable import FINEST_DEG, STEP_S, least_gaze_error, longest_in_view_s, nearest_gaze
from optics.gaze.motion import JointSpeeds
from optics.layout import Layout
from rigs import Rig
from tracking.estimation.gimbal import Gimbal
from tracking.loop.variants import VARIANTS

RIG = Rig.load("aqua2")
GIMBAL, VIEW = Gimbal(Layout.from_rig(RIG)), gaze_view(RIG, VARIANTS["default"], None)
TIMES_S = np.arange(0, 8, 1 / 30)
LOOK_S = 2 * STEP_S
"""A look begins and ends between two of the grid's."""


def level(azimuth_deg):
    """Unit vectors at the horizon."""
    azimuth = np.radians(np.broadcast_to(azimuth_deg, TIMES_S.shape))
    return np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros_like(azimuth)], axis=-1)


def longest_s(direction, *, speed_deg_per_s=60.0, start=(0.0, 0.0), available=True):
    speed = np.radians(speed_deg_per_s)
    return longest_in_view_s(
        GIMBAL,
        VIEW,
        JointSpeeds(pan=speed, tilt=speed),
        start=np.radians(start),
        times_s=TIMES_S,
        direction=direction,
        available=np.broadcast_to(available, TIMES_S.shape),
    )


def half_view_deg():
    """Azimuth up to which a level gaze ahead shows a level target."""
    azimuth_deg = np.linspace(0, 20, len(TIMES_S))
    directions = np.array([GIMBAL.in_gimbal(each) for each in level(azimuth_deg)])
    return azimuth_deg[VIEW.clearance(directions, np.zeros(1), np.zeros(1))[0, 0] >= 0].max()


def test_a_target_that_stays_in_view_is_shown_throughout():
    assert longest_s(level(0.0)) == pytest.approx(8.0, abs=LOOK_S)


def test_the_way_to_a_target_costs_what_the_servo_takes():
    """60 degrees off at 20 degrees/s, less half a view."""
    way_s = (60 - half_view_deg()) / 20
    grid_s = FINEST_DEG / 20
    assert longest_s(level(60.0), speed_deg_per_s=20.0) == pytest.approx(8.0 - way_s, abs=LOOK_S + grid_s)


def test_a_target_that_outruns_the_servo_is_shown_until_it_leaves_the_view():
    """At 16 degrees/s before a mirror at 8, which turns with it from the first moment on."""
    shown_s = half_view_deg() / (16 - 8)
    assert longest_s(level(16 * TIMES_S), speed_deg_per_s=8.0) == pytest.approx(shown_s, abs=LOOK_S + FINEST_DEG / 8)


def test_one_that_is_known_to_come_out_is_waited_for():
    """It jumps to the other side while it is hidden for 3 s: 60 degrees at 20 degrees/s are made in time."""
    hidden = (TIMES_S >= 2) & (TIMES_S < 5)
    direction = level(np.where(TIMES_S < 3.5, -30.0, 30.0))
    start = GIMBAL.joint_values(np.radians(-30.0), 0.0)
    shown_s = longest_s(direction, speed_deg_per_s=20.0, start=np.degrees(start), available=~hidden)
    assert shown_s == pytest.approx(5.0, abs=LOOK_S)


@pytest.mark.parametrize(
    ("azimuth_deg", "elevation_deg", "off_deg"),
    [(45.0, 0.0, 0.0), (-170.0, 20.0, 0.0), (90.0, 0.0, 12.5), (90.0, 60.0, 6.21), (-90.0, 60.0, 6.21)],
)
def test_past_pans_end_the_nearest_gaze_passes_by(azimuth_deg, elevation_deg, off_deg):
    """The servo turns by 77.5 degrees to each side; to the left of that: asin(cos(elevation) sin(12.5 degrees))."""
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    direction = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    assert np.degrees(nearest_gaze(GIMBAL, direction)) == pytest.approx(off_deg, abs=0.35 if off_deg else 1e-6)


def test_from_the_virtual_camera_a_near_target_is_less_off_the_axis():
    """It is 0.22 m behind the mirror: of 12.5 degrees at 1 m 10.3 are left, of those far away all."""
    direction = np.array([[0.0, 1.0, 0.0]] * 2)
    near_deg, far_deg = np.degrees(least_gaze_error(Layout.from_rig(RIG), direction, np.array([1.0, 1e6])))
    assert far_deg == pytest.approx(12.5, abs=0.35)
    layout = Layout.from_rig(RIG)
    # Over M1 the real camera is as far from M2: its image in M1 is behind that by the same way.
    image = layout.body_from_m1.inv().apply(layout.body_from_camera.translation) * [1, 1, -1]
    behind_m = np.linalg.norm(layout.body_from_m1.apply(image) - layout.body_from_gimbal.translation)
    off = np.radians(far_deg)
    assert near_deg == pytest.approx(np.degrees(np.arctan2(np.sin(off), behind_m + np.cos(off))), abs=0.01)


def test_nothing_is_shown_of_what_is_hidden_or_of_no_time():
    assert longest_s(level(0.0), available=False) == 0.0
    assert (
        longest_in_view_s(
            GIMBAL,
            VIEW,
            JointSpeeds(pan=1.0, tilt=1.0),
            start=np.zeros(2),
            times_s=TIMES_S[:1],
            direction=level(0.0)[:1],
            available=np.ones(1, dtype=bool),
        )
        == 0.0
    )
