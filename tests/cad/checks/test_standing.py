"""Where a rig stands beside its hull: boxes whose distances are known, and hulls that light does not get out of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from cad.checks.standing import Standing, rig_standing
from cad.hulls.port_boss import PROUD_MM
from rigs import FileHull, Rig

FRONT_MM, HALF_MM = 325.0, (130.0, 60.0)
"""Front, and half width and height, of a box about aqua2's camera at x = 302, y = 60 mm."""


def in_box(folder: Path, *, front_mm: float = FRONT_MM, **tables: dict) -> Rig:
    """aqua2 with a closed box from a file in place of its hull."""
    file = folder / f"box{front_mm:g}.stl"
    half_width, half_height = HALF_MM
    trimesh.creation.box(bounds=[[-300, -half_width, -half_height], [front_mm, half_width, half_height]]).export(file)
    return Rig.load("aqua2").with_gaze(hull=FileHull(shape="file", file=file, unit="mm"), **tables)


def places(standing: Standing) -> dict[str, tuple[float, str]]:
    return {place.name: (place.distance_mm, place.wrong) for place in standing.places}


@pytest.mark.parametrize("name", ["aqua2", "bluerov2"])
def test_the_presets_stand_as_they_can(name):
    standing = rig_standing(Rig.load(name))
    assert standing.wrong == ()
    found = places(standing)
    assert found["port's outer face"][0] == pytest.approx(PROUD_MM, abs=0.05)  # the boss is made of chords
    for end in ("fold", "base"):
        assert found[f"{end} anchor"][0] == pytest.approx(0, abs=1e-3)
    assert not standing.light.stopped.any()


def test_distances_from_a_box_are_those_of_its_sides(tmp_path):
    """M1 at 45 degrees, 95 mm in front: its lower edge is the farthest, its back's upper edge the nearest."""
    rig = in_box(tmp_path)
    fold = rig.gaze.fold_mirror
    found = places(rig_standing(rig))
    assert found["camera's pinhole"][0] == pytest.approx(302 - FRONT_MM)
    assert found["port's outer face"][0] == pytest.approx(302 + 28 - FRONT_MM)
    nearest = 302 + fold.distance_mm - fold.height_mm / 2 / np.sqrt(2)
    assert found["fold mirror M1"][0] == pytest.approx(nearest - FRONT_MM)


def test_the_nearest_points_are_at_their_distances(tmp_path):
    for place in rig_standing(in_box(tmp_path)).places:
        apart = np.linalg.norm(np.array(place.point_mm) - place.nearest_mm)
        assert apart == pytest.approx(abs(place.distance_mm), abs=1e-6)


def test_closed_skin_stops_the_light(tmp_path):
    found = places(rig_standing(in_box(tmp_path)))
    assert found["camera's pinhole"][1] == "the hull stops 100% of its light before M1"


@pytest.mark.parametrize("front_mm", [370.0, 500.0])
def test_what_is_buried_is_named(tmp_path, front_mm):
    """The box reaches past the port, and part of M1 or all of it."""
    standing = rig_standing(in_box(tmp_path, front_mm=front_mm))
    found = places(standing)
    assert found["port's outer face"][1] == "behind the hull's skin"
    assert found["fold mirror M1"][1] == "in the hull"
    assert standing.fold_mirror.inside
    assert not standing.gaze_mirror.inside
    assert found["gaze mirror M2 at rest"][1] == ""


def test_only_the_poses_that_reach_into_the_hull_are_in_it(tmp_path):
    """M2 60 mm under the axis: at rest it is clear of the box's bottom at its front, some of its poses are not."""
    standing = rig_standing(in_box(tmp_path, front_mm=380.0, gaze_mirror={"distance_mm": 90.0}))
    inside = [plate.inside for plate in standing.gaze_poses]
    assert 0 < sum(inside) < len(inside)
    assert places(standing)["gaze mirror M2 over its range"][1] == "in the hull"


def test_anchors_that_do_not_fit_are_named(tmp_path):
    mount = {"fold_anchor_mm": (270.0, 60.0, 90.0), "base_anchor_mm": (270.0, 60.0, -60.0), "base_normal": (0, 1, -1)}
    found = places(rig_standing(in_box(tmp_path, mount=mount)))
    assert found["fold anchor"] == (pytest.approx(30), "not on the hull's surface")
    assert found["base anchor"][1] == "not square to the hull's surface"


def test_a_camera_far_from_our_own_hull_is_shown_beside_it():
    rig = Rig.load("aqua2")
    away = rig.model_copy(update={"camera": rig.camera.model_copy(update={"position_mm": (900.0, 60.0, 0.0)})})
    assert places(rig_standing(away))["camera's pinhole"][0] == pytest.approx(900 - 325, abs=0.5)


def test_a_rig_without_mirrors_has_no_hull():
    with pytest.raises(ValueError, match="rig with mirrors"):
        rig_standing(Rig.load("bench"))
