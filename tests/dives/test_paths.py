"""Paths of target and robot against closed forms and invariants."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dives.dive import Dive
from dives.paths import body_pose, decoy_pose, path_places, target_pose
from dives.specification import Decoy, DiveTarget
from dives.trajectories.motions import (
    Circle,
    FromFile,
    Hover,
    PathStart,
    Spiral,
    Straight,
    Sway,
    Travel,
    TravelFromFile,
    Waypoints,
)

DEPTH = 6.0


def dive(path=None, robot=None, start=None, **more):
    path = path or Straight(shape="straight", start_m=(2.0, 0.0, 0.0), velocity_m_per_s=(0.0, 0.0, 0.0))
    return Dive(
        name="trial",
        rig="aqua2",
        depth_m=DEPTH,
        duration_s=10.0,
        target=DiveTarget(path=path, start=start or PathStart()),
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
    places, heading = path_places(dive(path), path, np.array([0.0, 3.0, 6.0, 10.0, 14.0, 20.0]))
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


def test_a_spiral_that_starts_elsewhere_is_the_spiral_of_that_bearing():
    """Turned about the vertical: with azimuth alone, the same spiral with another start_bearing_deg."""
    times = np.linspace(0.0, 9.0, 7)
    turned = dive(SPIRAL, start=PathStart(azimuth_deg=52.0))
    same = dive(SPIRAL.model_copy(update={"start_bearing_deg": 52.0}))
    np.testing.assert_allclose(
        target_pose(turned, times).as_matrix(), target_pose(same, times).as_matrix(), rtol=0, atol=1e-12
    )


def test_a_path_begins_where_it_is_told_and_keeps_its_form():
    """3 m away, 30 degrees to the right and 40 up, by the definition of these angles."""
    path = Waypoints(shape="waypoints", points_m=((1, 0, 0), (1, 2, 0)), speed_m_per_s=0.5)
    start = PathStart(azimuth_deg=-30.0, elevation_deg=40.0, distance_m=3.0)
    first, last = (target_pose(dive(path, start=start), time).translation for time in (0.0, 4.0))
    level = 3 * np.cos(np.radians(40))
    assert first == pytest.approx(
        [level * np.cos(np.pi / 6), -level / 2, 3 * np.sin(np.radians(40)) - DEPTH], abs=1e-12
    )
    # From azimuth 0 it was turned by -30 degrees: the leg of 2 m along y with it.
    assert last - first == pytest.approx([1.0, np.sqrt(3), 0.0], abs=1e-12)


def write(folder, name, text):
    (folder / name).write_text(text, encoding="utf-8")
    return str(folder / name)


def test_a_file_of_a_robot_begins_at_the_start_whatever_its_frame(tmp_path):
    """In the map it goes north (y) from (10, 20, -3) at 1 m/s with its bow north: from the start, straight ahead.

    The target of the same map stays 5 m north and 1 m east of where the robot began: 5 m ahead, 1 m to the right.
    """
    rows = "time_s,x_m,y_m,z_m,yaw_deg,pitch_deg,roll_deg\n7,10,20,-3,90,10,5\n9,10,22,-3,90,10,5\n"
    robot = write(tmp_path, "r.csv", rows)
    target = write(tmp_path, "t.csv", "time_s,x_m,y_m,z_m\n0,11,25,-3\n20,11,25,-3\n")
    mapped = dive(FromFile(shape="file", file=target, frame="map"), TravelFromFile(motion="file", file=robot))
    body = body_pose(mapped, np.array([0.0, 1.0, 5.0]))
    np.testing.assert_allclose(body.translation, [[0, 0, -DEPTH], [1, 0, -DEPTH], [2, 0, -DEPTH]], atol=1e-12)
    # Pitch up by 10 degrees is a turn about y by -10; yaw is counted from the start.
    expected = [[0.0, -10.0, 5.0]] * 3
    np.testing.assert_allclose(body.rotation.as_euler("ZYX", degrees=True), expected, atol=1e-9)
    assert target_pose(mapped, 3.0).translation == pytest.approx([5.0, -1.0, -DEPTH])


def test_attitudes_of_targets_and_clocks_of_files(tmp_path):
    """The dive begins at 5 s of the file; half a turn about z in 10 s is 90 degrees after another 5 s."""
    rows = "time_s,x_m,y_m,z_m,qx,qy,qz,qw\n0,2,0,0,0,0,0,1\n10,2,0,0,0,0,1,0\n"
    path = FromFile(shape="file", file=write(tmp_path, "t.csv", rows), start_s=5.0)
    yaw = [target_pose(dive(path), time).rotation.as_euler("ZYX", degrees=True)[0] for time in (0.0, 2.0)]
    assert yaw == pytest.approx([90.0, 126.0])


def test_a_target_stays_where_its_start_moves_it():
    """At 2 m ahead, turned to 90 degrees left: 2 m to the left, with the start's axes but for the turn."""
    there = dive(Straight(shape="straight", start_m=(2.0, 0.0, 0.5), velocity_m_per_s=(0.0, 0.0, 0.0)))
    at = np.array([0.0, 10.0])
    for start, expected in ((PathStart(), [2.0, 0.0]), (PathStart(azimuth_deg=90.0), [0.0, 2.0])):
        target = DiveTarget(position_m=(2.0, 0.0, 0.5), start=start)
        pose = target_pose(there.model_copy(update={"target": target}), at)
        np.testing.assert_allclose(pose.translation, [[*expected, 0.5 - DEPTH]] * 2, atol=1e-12)
        turned = 0.0 if start.azimuth_deg is None else start.azimuth_deg
        assert pose.rotation.as_euler("ZYX", degrees=True)[:, 0] == pytest.approx([turned] * 2)


def test_decoys_stay_or_go():
    still = Decoy(position_m=(2.0, 1.0, 0.5))
    moving = Decoy(path=Straight(shape="straight", start_m=(2.0, 0.0, 0.0), velocity_m_per_s=(0.0, 0.1, 0.0)))
    at = np.array([0.0, 10.0])
    np.testing.assert_allclose(decoy_pose(dive(), still, at).translation, [[2.0, 1.0, 0.5 - DEPTH]] * 2)
    np.testing.assert_allclose(decoy_pose(dive(), moving, at).translation, [[2, 0, -DEPTH], [2, 1, -DEPTH]])
