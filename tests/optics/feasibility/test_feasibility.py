"""Impossible rigs are named by the number to change; possible ones pass."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from optics.feasibility.envelope import box_distance, cylinder_distance
from optics.feasibility.feasibility import feasibility_problems
from rigs import Rig, preset_names


def changed(name: str, **values: Any) -> Rig:
    """Preset with other values; the names are dotted keys with two underscores for the dot."""
    document = Rig.load(name).model_dump()
    for key, value in values.items():
        *sections, last = key.split("__")
        section = document
        for step in sections:
            section = section[step]
        section[last] = value
    return Rig.model_validate(document)


@pytest.mark.parametrize("name", preset_names())
def test_presets_can_be_built(name: str) -> None:
    assert feasibility_problems(Rig.load(name)) == []


@pytest.mark.parametrize(
    ("name", "values", "place", "expected"),
    [
        ("bench", {"port__aperture_diameter_mm": 1e-5}, "port.aperture_diameter_mm", "one pixel"),
        ("aqua2", {"fold_mirror__thickness_mm": 40.0}, "fold_mirror.thickness_mm", "less than 40"),
        ("aqua2", {"gaze_mirror__thickness_mm": 45.0}, "gaze_mirror.thickness_mm", "less than 40"),
        ("aqua2", {"joints__pan__max_deg": 90.0}, "joints.pan.max_deg", r"at most 77\.5: the travel of servos\.pan"),
        ("aqua2", {"joints__tilt__min_deg": 5.0}, "joints.tilt.min_deg", "at most 0"),
        ("aqua2", {"joints__tilt__max_deg": -1.0}, "joints.tilt.max_deg", "at least 0"),
        ("aqua2", {"joints__tilt__offset_deg": -15.0}, "joints.tilt.min_deg", r"-47\.5: there M2 turns its back"),
        # Half the plate's height along the slope is 31.8 mm: its upper edge is level with the port's face at 59.8 mm.
        ("aqua2", {"fold_mirror__distance_mm": 50.0}, "fold_mirror.distance_mm", "into it"),
        ("bluerov2", {"fold_mirror__distance_mm": 75.0}, "fold_mirror.distance_mm", "in front of the port"),
        ("aqua2", {"gaze_mirror__distance_mm": 80.0}, "gaze_mirror.distance_mm", "into M1"),
        ("bluerov2", {"fold_mirror__distance_mm": 100.0, "gaze_mirror__distance_mm": 85.0}, "gaze_mirror", "the port"),
        ("aqua2", {"camera__position_mm": (250.0, 60.0, 0.0)}, "camera.position_mm", "47.0 mm inside"),
        ("aqua2", {"camera__position_mm": (502.0, 60.0, 0.0)}, "camera.position_mm", "177.0 mm away"),
        ("aqua2", {"fold_mirror__distance_mm": 75.0, "hull__height_mm": 300.0}, "gaze_mirror", "M2 outside the hull"),
        ("aqua2", {"camera__yaw_deg": 180.0}, "fold_mirror.distance_mm", "M1 outside the hull"),
        ("bluerov2", {"camera__position_mm": (110.0, 150.0, 50.0)}, "fold_mirror.distance_mm", "M1 outside the hull"),
        ("aqua2", {"mount__fold_anchor_mm": (270.0, 60.0, 80.0)}, "mount.fold_anchor_mm", "15.0 mm outside"),
        ("aqua2", {"mount__base_anchor_mm": (270.0, 60.0, -50.0)}, "mount.base_anchor_mm", "15.0 mm inside"),
    ],
)
def test_what_is_impossible_is_named(name: str, values: dict[str, Any], place: str, expected: str) -> None:
    problems = feasibility_problems(changed(name, **values))
    assert [p for p in problems if p.place.startswith(place) and re.search(expected, p.expected)], problems


def test_tilted_port_turns_the_view_past_a_small_fold_mirror() -> None:
    # A camera of 0.2 deg behind a window tilted by 45 deg looks beside a mirror of 1 mm: Snell bends the axis away.
    rig = changed(
        "aqua2",
        camera__fx_px=2e5,
        camera__fy_px=2e5,
        port__normal=(1.0, 0.0, 1.0),
        port__distance_mm=10.0,
        fold_mirror__width_mm=1.0,
        fold_mirror__height_mm=1.0,
        fold_mirror__thickness_mm=0.1,
    )
    assert ["M1 in the camera's view" in p.expected for p in feasibility_problems(rig)].count(True) == 1


def test_gaze_mirror_too_small_and_far_to_be_met_is_reported() -> None:
    rig = changed(
        "aqua2",
        camera__fx_px=2e5,
        camera__fy_px=2e5,
        port__normal=(0.2, 0.0, 1.0),
        gaze_mirror__distance_mm=3000.0,
        gaze_mirror__width_mm=1.0,
        gaze_mirror__height_mm=1.0,
        gaze_mirror__thickness_mm=0.1,
    )
    assert [p.place for p in feasibility_problems(rig)] == ["gaze_mirror.distance_mm"]


def test_all_problems_come_at_once() -> None:
    rig = changed(
        "aqua2",
        joints__pan__max_deg=90.0,
        gaze_mirror__thickness_mm=45.0,
        mount__fold_anchor_mm=(0.0, 0.0, 0.0),
    )
    places = [problem.place for problem in feasibility_problems(rig)]
    assert {"joints.pan.max_deg", "gaze_mirror.thickness_mm", "mount.fold_anchor_mm"} <= set(places)


def test_rounded_box_is_a_box_with_a_ball_rolled_over_it() -> None:
    # Along an edge's diagonal the surface lies (sqrt 2 - 1) r inside the sharp corner.
    half_size, radius = np.array([3.0, 2.0, 1.0]), 0.5
    corner = np.array([3.0, 2.0, 0.0])
    assert box_distance(corner, half_size) == pytest.approx(0, abs=1e-15)
    assert box_distance(corner, half_size, radius) == pytest.approx((np.sqrt(2) - 1) * radius, abs=1e-15)
    assert box_distance(np.zeros(3), half_size, radius) == pytest.approx(-1)


def test_distance_to_a_cylinder() -> None:
    points = np.array([[0.0, 0, 0], [3, 0, 0], [0, 0, 6], [5, 0, 8]])
    np.testing.assert_allclose(cylinder_distance(points, 2.0, 4.0), [-2, 1, 2, 5])
