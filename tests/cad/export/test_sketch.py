"""A rig beside its hull as a GLB file: every thing by its name, in metres, y up, red where it cannot stay."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from cad.checks.standing import rig_standing
from cad.export.glb import GLB_FROM_BODY
from cad.export.sketch import WRONG, rig_sketch, write_sketch
from rigs import Rig

AQUA2 = Rig.load("aqua2")


@pytest.fixture(scope="module")
def sketch():
    return rig_sketch(rig_standing(AQUA2))


def test_a_viewer_finds_every_thing_by_name(sketch, tmp_path):
    write_sketch(sketch, tmp_path / "show.glb")
    scene = trimesh.load_scene(tmp_path / "show.glb")
    names = {"hull", "camera", "fold_mirror", "gaze_mirror", "fold_anchor", "base_anchor", "fold_normal", "body_x"}
    assert names <= set(scene.graph.nodes_geometry)
    for surface in sketch.surfaces:
        pose, geometry = scene.graph[surface.name]
        found = trimesh.transform_points(scene.geometry[geometry].bounds, pose)
        expected = trimesh.transform_points(surface.mesh.bounds / 1000, GLB_FROM_BODY)
        assert np.sort(found, axis=0) == pytest.approx(np.sort(expected, axis=0), abs=1e-6)


def test_plates_are_closed_and_as_thick_as_the_mirrors(sketch):
    gaze = AQUA2.gaze
    for surface in sketch.surfaces[1:3]:
        mirror = getattr(gaze, surface.name)
        assert surface.mesh.is_volume
        assert surface.mesh.volume == pytest.approx(mirror.width_mm * mirror.height_mm * mirror.thickness_mm)


def test_red_is_what_cannot_stay(sketch):
    assert not [each.name for each in (*sketch.surfaces, *sketch.lines) if each.colour == WRONG]
    mount = {"fold_anchor_mm": (270.0, 60.0, 90.0)}
    wrong = rig_sketch(rig_standing(AQUA2.with_gaze(mount=mount, fold_mirror={"distance_mm": 20.0})))
    red = {each.name for each in (*wrong.surfaces, *wrong.lines) if each.colour == WRONG}
    assert {"fold_anchor", "fold_normal", "fold_mirror"} <= red
    assert not red & {"base_anchor", "base_normal", "camera", "hull"}
