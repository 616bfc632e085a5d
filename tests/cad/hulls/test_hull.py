"""Hulls: the user's own from a file, and the nominal ones in other sizes."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from build123d import Box, Cylinder, Pos, Sphere, export_step

from cad.assembly.assembly import build_assembly
from cad.assembly.meshes import mesh_key
from cad.checks.assembly_checks import assembly_problems
from cad.hulls.hull import closed_surface, file_hull_solid, file_hull_surface, hull_shape
from cad.hulls.wrapping import solid_field
from optics.layout import Layout
from rigs import BoxHull, FileHull


@pytest.fixture
def stl(tmp_path):
    path = tmp_path / "hull.stl"
    trimesh.creation.box(extents=(0.6, 0.2, 0.1)).export(path)
    return path


def test_an_stl_keeps_its_triangles_and_gets_unit_and_pose(stl):
    hull = file_hull_solid(FileHull(shape="file", file=stl, unit="m", position_mm=(10, 20, 30), yaw_deg=90))
    assert isinstance(hull, trimesh.Trimesh)
    assert hull.bounds == pytest.approx(np.array([[-90, -280, -20], [110, 320, 80]]), abs=1e-3)


def test_a_step_is_a_solid_in_its_own_unit(tmp_path):
    path = tmp_path / "hull.step"
    export_step(Box(600, 200, 100), path)
    hull = file_hull_solid(FileHull(shape="file", file=path, position_mm=(0, 0, 5), pitch_deg=90))
    box = hull.bounding_box()
    assert tuple(box.size) == pytest.approx((100, 200, 600), abs=1e-5)
    assert pytest.approx(5, abs=1e-6) == box.center().Z


def test_triangles_of_a_round_solid_are_closed():
    """Seams and poles of spheres have corners twice; what is open counts as no hull where places are looked for."""
    capsule = Cylinder(90, 900) + Pos(0, 0, 450) * Sphere(90) + Pos(0, 0, -450) * Sphere(90)
    surface = closed_surface(capsule.solid())
    assert surface.is_watertight
    assert surface.volume == pytest.approx(math.pi * 90**2 * (900 + 4 / 3 * 90), rel=2e-3)


def test_a_step_of_two_solids_is_triangles_and_an_unknown_kind_of_file_is_refused(tmp_path):
    path = tmp_path / "two.step"
    export_step(Box(100, 100, 100) + Pos(500, 0, 0) * Box(100, 100, 100), path)
    surface = file_hull_surface(FileHull(shape="file", file=path, position_mm=(0, 0, 5)))
    assert surface.bounds == pytest.approx(np.array([[-50, -50, -45], [550, 50, 55]]))
    assert surface.area == pytest.approx(12 * 100**2)
    with pytest.raises(ValueError, match=r"hull\.file = 'hull\.iges': expected a file that ends in \.stl"):
        file_hull_solid(FileHull(shape="file", file=tmp_path / "hull.iges", unit="mm"))


def test_a_step_that_is_none_or_of_a_doubtful_size_is_refused(tmp_path):
    path = tmp_path / "hull.step"
    path.write_text("hello", encoding="utf-8")
    with pytest.raises(ValueError, match=r"hull\.file"):
        file_hull_solid(FileHull(shape="file", file=path))
    export_step(Box(0.65, 0.2, 0.1), path)
    with pytest.raises(ValueError, match=r"a vehicle of 100 mm to 20 m, got one of 0\.65 mm in the file's own unit"):
        file_hull_solid(FileHull(shape="file", file=path))


def test_a_rig_on_an_stl_hull_is_built_checked_and_keyed_by_content(aqua2, tmp_path):
    path = tmp_path / "hull.stl"
    trimesh.creation.box(extents=(650, 260, 130)).export(path)
    rig = aqua2.rig.with_gaze(hull=FileHull(shape="file", file=path, unit="mm"))
    assembly = build_assembly(rig)
    assert len(assembly.meshes[0].faces) == 12
    assert assembly_problems(assembly, grid_steps=2) == []
    key = mesh_key(rig)
    elsewhere = path.rename(tmp_path / "sub.stl")
    moved = rig.with_gaze(hull=FileHull(shape="file", file=elsewhere, unit="mm"))
    trimesh.creation.box(extents=(650, 261, 130)).export(elsewhere)
    assert mesh_key(moved) != key


def test_a_rig_on_an_open_hull_is_built_and_seen_through_its_hole(aqua2, tmp_path, monkeypatch):
    """A box without its back: bodies touch a closed solid, rays hit its ten triangles."""
    monkeypatch.setattr(solid_field, "CELLS_ALONG", 60)
    surface = trimesh.creation.box(extents=(650, 260, 130))
    surface.update_faces(surface.face_normals[:, 0] > -0.5)
    path = tmp_path / "open.stl"
    surface.export(path)
    assembly = build_assembly(aqua2.rig.with_gaze(hull=FileHull(shape="file", file=path, unit="mm")))
    assert len(assembly.seen_meshes[0].faces) == 10
    solid = assembly.meshes[0]
    assert trimesh.Trimesh(solid.vertices_m, solid.faces, process=False).is_volume


@pytest.mark.parametrize("flippers", [0, 1, 2, 6])
@pytest.mark.parametrize("radius", [0.0, 40.0])
def test_boxes_of_other_kinds_are_one_solid(aqua2, flippers, radius):
    hull = BoxHull(
        shape="box", length_mm=650, width_mm=450, height_mm=130, edge_radius_mm=radius, flippers_per_side=flippers
    )
    rig = aqua2.rig.with_gaze(hull=hull)
    solid = hull_shape(hull, rig.gaze.mount, rig.port, Layout.from_rig(rig))
    assert pytest.approx(450, abs=1e-5) == solid.bounding_box().size.Y
    assert solid.is_valid


def test_a_camera_apart_from_its_hull_is_refused(aqua2):
    camera = aqua2.rig.camera.model_copy(update={"position_mm": (402.0, 60.0, 0.0)})
    with pytest.raises(ValueError, match=r"hull: expected one solid, got 2; look at hull and camera\.position_mm"):
        build_assembly(aqua2.rig.model_copy(update={"camera": camera}))
