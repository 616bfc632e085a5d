"""Rigs against hulls known by a distance alone: a wall and a ball, in closed form."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from optics.feasibility.envelope import HullDistance, plate_points, sphere_distance
from optics.feasibility.hull_room import closest_gaze_mirror, hull_problems
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import FileHull, Rig

HULL = FileHull(shape="file", file="hull.stl", unit="mm")
RIG = Rig.load("aqua2").with_gaze(hull=HULL, mount={"fold_anchor_mm": (270, 60, 65), "base_anchor_mm": (270, 60, 65)})
"""Camera at x = 302, port's face at 330, M1 at 397 mm; both anchors 65 mm above the camera."""


def wall(height_mm: float) -> HullDistance:
    """All that is behind x = `height_mm`."""
    return lambda points_m: points_m[..., 0] - height_mm / 1000


def found(hull: HullDistance, rig: Rig = RIG) -> dict[str, str]:
    return {problem.place: problem.expected for problem in hull_problems(rig, hull)}


def first_number(pattern: str, text: str) -> float:
    match = re.search(pattern, text)
    assert match, text
    return float(match[1])


def test_a_file_s_hull_is_not_guessed_at() -> None:
    assert list(hull_problems(RIG)) == []


def test_a_port_behind_a_wall_is_told_how_far_ahead_to_go() -> None:
    problem = found(wall(340))["camera.position_mm"]
    assert "10.0 mm inside, the nearest skin at [340.0, 60.0, 0.0]" in problem
    assert "10 mm along its view, at [312.0, 60.0, 0.0], it is outside" in problem
    assert 'hull.window = "cut"' in problem


@pytest.mark.parametrize(("height_mm", "further_mm"), [(380, 0), (400, 0), (450, 0)])
def test_mirrors_behind_a_wall_come_out_with_the_camera(height_mm: float, further_mm: float) -> None:
    # The lowest point of M1's plate is as far behind its centre as its height and thickness reach at 45 degrees.
    problem = found(wall(height_mm))["fold_mirror.distance_mm"]
    reach = (RIG.gaze.fold_mirror.height_mm / 2) / np.sqrt(2)
    assert first_number(r"reaches ([\d.]+) mm", problem) == pytest.approx(height_mm - 397 + reach, abs=0.06)
    assert "moved with the camera, it is clear" in problem


def test_mirror_in_front_of_a_wall_is_told_its_distance() -> None:
    # Here the port looks out and M1's plate is in the wall: a smaller d1.
    near = RIG.with_gaze(fold_mirror={"distance_mm": 50.0})
    problem = found(wall(330), near)["fold_mirror.distance_mm"]
    reach = (near.gaze.fold_mirror.height_mm / 2) / np.sqrt(2)
    needed = 330 - 302 + reach
    assert first_number(r"distance_mm = (\d+) clears", problem) == pytest.approx(needed, abs=1.0)


def test_gaze_mirror_beside_a_ball_is_as_near_as_all_its_poses_say() -> None:
    layout = Layout.from_rig(RIG)
    centre = layout.body_from_gimbal.translation
    for offset in ([0.06, 0, 0], [0, 0.03, 0.05], [0.0, 0.08, 0.02]):
        ball = _ball(centre + np.array(offset), 0.02)
        q = layout.joint_grid(25)
        frames = layout.moving_frames(*q.T)[1]
        plate = np.column_stack([plate_points(RIG.gaze.gaze_mirror), np.ones(1922)])
        all_of_it = min(float(ball((frame @ plate.T).T[:, :3]).min()) for frame in frames)
        assert closest_gaze_mirror(ball, RIG.gaze.gaze_mirror, layout).gap_m == pytest.approx(all_of_it, abs=5e-4)


def test_gaze_mirror_in_a_ball_is_told_both_ways_out() -> None:
    # A ball beyond M2 along the fold: no greater d2 helps before the ball is passed, a greater d1 does.
    layout = Layout.from_rig(RIG)
    problem = found(_ball(layout.body_from_gimbal.translation, 0.03))["gaze_mirror.distance_mm"]
    d1 = first_number(r"fold_mirror\.distance_mm = (\d+)", problem)
    d2 = first_number(r" distance_mm = (\d+)", problem)
    # Out at the latest when the sphere in which the plate turns has left the ball.
    sphere = 1000 * np.linalg.norm(plate_points(RIG.gaze.gaze_mirror), axis=1).max() + 30
    assert 30 < d1 - RIG.gaze.fold_mirror.distance_mm <= sphere + 1
    assert 30 < d2 - RIG.gaze.gaze_mirror.distance_mm <= sphere + 1


def test_anchors_are_told_the_nearest_point_of_a_ball() -> None:
    anchor = np.array([0.27, 0.06, 0.065])
    centre = anchor - [0.0, 0.0, 0.5]
    problem = found(_ball(centre, 0.4))["mount.fold_anchor_mm"]
    assert "100.0 mm outside, and the surface is at [270.0, 60.0, -35.0]" in problem


def test_a_camera_far_from_any_hull_is_told_so() -> None:
    assert "from it" in found(_ball(np.array([-5.0, 0, 0]), 0.4))["camera.position_mm"]


def _ball(centre: FloatArray, radius: float) -> Callable[[FloatArray], FloatArray]:
    return lambda points_m: sphere_distance(points_m, centre, radius)
