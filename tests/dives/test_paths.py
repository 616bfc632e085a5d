"""Paths of target and robot against closed forms and invariants."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dives.dive import Dive
from dives.motions import Circle, Hover, Spiral, Straight, Sway, Travel, Waypoints
from dives.paths import body_pose, target_places, target_pose
from dives.specification import DiveTarget

DEPTH = 6.0


def dive(path=None, robot=None, **more):
    path = path or Straight(shape="straight", start_m=(2.0, 0.0, 0.0), velocity_m_per_s=(0.0, 0.0, 0.0))
    return Dive(
        name="trial",
        rig="aqua2",
        depth_m=DEPTH,
        duration_s=10.0,
        target=DiveTarget(path=path),
        robot=robot or Hover(motion="hover"),
        **more,
    )


SPIRAL = Spiral(
    shape="spiral",
    start_radius_m=2.0,
    start_bearing_deg=-30.0,
    turning_deg_per_s=10.0,
    receding_m_per_s=0.1,
    rising_m_per_s=0.05,
    wait_s=3.0,
)


def test_spiral_begins_level_rises_and_goes_away():
    """The paper's: 3 s at rest; 6 s on it has turned by 60 degrees and is 0.6 m farther and 0.3 m higher."""
    start, later = (target_pose(dive(SPIRAL), time).translation for time in (3.0, 9.0))
    assert start == pytest.approx([2 * np.cos(np.pi / 6), -2 * np.sin(np.pi / 6), -DEPTH])
    assert later == pytest.approx([2.6 * np.cos(np.pi / 6), 2.6 * np.sin(np.pi / 6), -DEPTH + 0.3])
    assert target_pose(dive(SPIRAL), 1.0).translation == pytest.approx(start)


def test_circle_and_straight_line():
    circle = Circle(shape="circle", centre_m=(1.0, 2.0, 3.0), radius_m=0.5, turning_deg_per_s=90.0)
    assert target_pose(dive(circle), 1.0).translation == pytest.approx([1.0, 2.5, 3.0 - DEPTH])
    straight = Straight(shape="straight", start_m=(1.0, 0.0, 0.0), velocity_m_per_s=(0.1, 0.2, -0.3))
    assert target_pose(dive(straight), 2.0).translation == pytest.approx([1.2, 0.4, -0.6 - DEPTH])


def test_waypoints_are_met_at_their_distances_over_the_speed():
    """3 m and then 4 m at 0.5 m/s: corners at 6 s and 14 s, and no farther."""
    path = Waypoints(shape="waypoints", points_m=((0, 0, 0), (3, 0, 0), (3, 4, 0)), speed_m_per_s=0.5)
    places, heading = target_places(dive(path), np.array([0.0, 3.0, 6.0, 10.0, 14.0, 20.0]))
    expected = [(0, 0, 0), (1.5, 0, 0), (3, 0, 0), (3, 2, 0), (3, 4, 0), (3, 4, 0)]
    assert places == pytest.approx(np.array(expected))
    assert heading[1] == pytest.approx([1, 0, 0])
    assert heading[3] == pytest.approx([0, 1, 0])


@pytest.mark.parametrize(
    "path",
    [
        SPIRAL,
        Straight(shape="straight", start_m=(1.0, 0.0, 0.0), velocity_m_per_s=(0.3, -0.2, 0.1)),
        Circle(shape="circle", centre_m=(1.0, 0.0, 0.0), radius_m=2.0, turning_deg_per_s=-20.0),
        Waypoints(shape="waypoints", points_m=((0, 0, 0), (3, 1, 0), (3, 4, -1)), speed_m_per_s=0.5),
    ],
)
def test_heading_is_the_direction_of_motion(path):
    """Central difference of the place, 1e-4 s to either side: its own error is of the order of 1e-8."""
    step = 1e-4
    for time in (4.0, 5.5, 8.0):
        before, after = (target_pose(dive(path), time + sign * step) for sign in (-1, 1))
        moved = after.translation - before.translation
        yaw = np.arctan2(moved[1], moved[0])
        assert target_pose(dive(path), time).rotation.as_euler("zyx")[0] == pytest.approx(yaw, abs=1e-6)


def test_poses_at_many_times_are_those_at_each():
    swaying = dive(SPIRAL, TRAVEL.model_copy(update={"sway": SWAY}))
    times = np.linspace(0.0, 9.0, 7)
    for pose in (body_pose, target_pose):
        alone = [pose(swaying, time).as_matrix() for time in times.tolist()]
        np.testing.assert_allclose(pose(swaying, times).as_matrix(), alone, rtol=0, atol=1e-14)


SWAY = Sway(
    amplitude_m=(0.1, 0.2, 0.3), period_s=(4.0, 6.0, 8.0), turn_deg=(3.0, 4.0, 5.0), turn_period_s=(5.0, 7.0, 9.0)
)


@given(st.floats(0, 100), st.integers(0, 1000))
def test_sway_stays_within_its_amplitudes(time_s, seed):
    pose = body_pose(dive(robot=Hover(motion="hover", sway=SWAY), seed=seed), time_s)
    yaw, pitch, roll = pose.rotation.as_euler("ZYX", degrees=True)
    assert (np.abs(pose.translation - [0, 0, -DEPTH]) <= np.array([0.1, 0.2, 0.3]) + 1e-12).all()
    assert (np.abs([roll, pitch, yaw]) <= np.array([3.0, 4.0, 5.0]) + 1e-9).all()


def test_sway_comes_back_after_its_periods_and_from_the_seed():
    """Surge after 4 s, sway after 6, heave after 8: all of them after 24 s."""
    robot = Hover(motion="hover", sway=SWAY)
    first, again, other = (
        body_pose(dive(robot=robot, seed=seed), time).translation for seed, time in ((1, 2.0), (1, 26.0), (2, 2.0))
    )
    assert first == pytest.approx(again)
    assert np.abs(first - other).max() > 0.01


def test_a_robot_at_rest_is_at_its_start():
    pose = body_pose(dive(), 5.0)
    assert pose.translation == pytest.approx([0, 0, -DEPTH])
    assert pose.rotation.magnitude() == 0


TRAVEL = Travel(
    motion="waypoints",
    points_m=((0, 0, 0), (2, 0, 0), (2, 2, 0), (2, 2, 1)),
    speed_m_per_s=0.5,
    turn_rate_deg_per_s=30.0,
)


def test_travel_turns_its_bow_at_the_rate_into_each_leg():
    """A leg of 4 s along x, then 90 degrees to the left at 30 degrees/s: half way after 5.5 s, done after 7 s.

    The last leg goes straight up, and the bow stays.
    """
    for time, yaw in ((2.0, 0.0), (4.0, 0.0), (5.5, 45.0), (7.0, 90.0), (9.0, 90.0)):
        found = body_pose(dive(robot=TRAVEL), time).rotation.as_euler("ZYX", degrees=True)[0]
        assert found == pytest.approx(yaw, abs=1e-9)
    assert body_pose(dive(robot=TRAVEL), 6.0).translation == pytest.approx([2, 1, -DEPTH])
    assert body_pose(dive(robot=TRAVEL), 60.0).translation == pytest.approx([2, 2, 1 - DEPTH])


def test_travel_turns_the_short_way_and_goes_on_from_an_unfinished_turn():
    """135 degrees at 10 degrees/s do not fit into a leg of 2 s: 20 are turned, and the next turn begins there."""
    robot = Travel(
        motion="waypoints",
        points_m=((0, 0, 0), (-1, 1, 0), (-1, 2, 0)),
        speed_m_per_s=np.sqrt(2) / 2,
        turn_rate_deg_per_s=10.0,
    )
    yaw = [body_pose(dive(robot=robot), time).rotation.as_euler("ZYX", degrees=True)[0] for time in (1.0, 2.0, 3.0)]
    assert yaw == pytest.approx([10.0, 20.0, 30.0])
    west = Travel(motion="waypoints", points_m=((0, 0, 0), (-1, -1, 0)), speed_m_per_s=0.1, turn_rate_deg_per_s=10.0)
    assert body_pose(dive(robot=west), 1.0).rotation.as_euler("ZYX", degrees=True)[0] == pytest.approx(-10.0)


def test_sway_is_about_the_robots_own_axes():
    """Surge follows the bow: on a leg to the left it is along the world's y."""
    sway = Sway(amplitude_m=(0.1, 0.0, 0.0))
    robot = Travel(
        motion="waypoints", points_m=((0, 0, 0), (0, 5, 0)), speed_m_per_s=0.1, turn_rate_deg_per_s=90.0, sway=sway
    )
    still = robot.model_copy(update={"sway": Sway()})
    shift = body_pose(dive(robot=robot), 10.0).translation - body_pose(dive(robot=still), 10.0).translation
    assert shift[[0, 2]] == pytest.approx([0, 0], abs=1e-12)
    assert abs(shift[1]) > 1e-3
