"""The hull of a rig without its mount: the surface that the mount is made for, whatever else is wrong with the rig."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from cad.assembly.hull_surface import hull_surface
from rigs import FileHull, Rig


@pytest.fixture(scope="module")
def wrong_rig() -> Rig:
    """Its anchors are nowhere near the hull, its gaze mirror is inside: no mount can be made."""
    mount = {"fold_anchor_mm": (0.0, 900.0, 0.0), "base_anchor_mm": (0.0, 0.0, 0.0)}
    return Rig.load("aqua2").with_gaze(mount=mount, gaze_mirror={"distance_mm": 20.0})


def test_it_is_the_hull_of_the_assembly(aqua2):
    found, built = hull_surface(aqua2.rig), aqua2.part("hull").mesh
    assert 1e-3 * np.asarray(found.vertices) == pytest.approx(built.vertices_m)
    assert (found.faces == built.faces).all()


def test_it_is_made_whatever_else_is_wrong(aqua2, wrong_rig):
    found = hull_surface(wrong_rig)
    assert found.volume == pytest.approx(hull_surface(aqua2.rig).volume)


def test_a_file_s_hull_is_its_surface_in_the_body_frame(wrong_rig, tmp_path):
    file = tmp_path / "ball.stl"
    trimesh.creation.icosphere(radius=0.3).export(file)
    hull = FileHull(shape="file", file=file, unit="m", position_mm=(100.0, 0.0, 0.0))
    found = hull_surface(wrong_rig.with_gaze(hull=hull))
    assert found.bounds == pytest.approx(np.array([[-200, -300, -300], [400, 300, 300]]), abs=1e-3)
