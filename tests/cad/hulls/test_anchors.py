"""Anchors: the point and the normal a flange is bolted to, by number, by name, or asked of the hull's surface."""

from __future__ import annotations

import re

import numpy as np
import pytest
import trimesh
from build123d import Box, export_step

from cad.hulls.anchors import anchor_problems, base_anchor, fold_anchor, hull_planes, nearest_on_surface
from cad.hulls.step_file import step_planes, step_solid
from rigs import FileHull, HullPlane, Mount, Rig

AQUA2 = Rig.load("aqua2")


def with_mount(rig: Rig, **changes) -> Rig:
    return rig.with_gaze(mount=changes)


def box_mesh(rig: Rig) -> trimesh.Trimesh:
    """AQUA's body without flippers and fillets."""
    return trimesh.creation.box(extents=(650, 0.58 * 450, 130))


@pytest.fixture
def on_a_sphere(tmp_path):
    """AQUA's mount on a hull that is a sphere of 300 mm radius, from a file."""
    path = tmp_path / "sphere.stl"
    trimesh.creation.icosphere(subdivisions=5, radius=300).export(path)
    return AQUA2.with_gaze(hull=FileHull(shape="file", file=path, unit="mm"))


@pytest.mark.parametrize("name", ["aqua2", "bluerov2"])
def test_the_presets_are_bolted_to_top_and_bottom(name):
    rig = Rig.load(name)
    assert fold_anchor(rig).point_mm == rig.gaze.mount.fold_anchor_mm
    assert fold_anchor(rig).normal == (0, 0, 1)
    assert base_anchor(rig).normal == (0, 0, -1)


def test_a_named_plane_gives_the_height_and_the_normal():
    rig = with_mount(AQUA2, fold_anchor_mm=(270.0, 60.0, 0.0), fold_plane="top")
    assert fold_anchor(rig).point_mm == (270, 60, 65)
    assert fold_anchor(with_mount(rig, fold_plane="left")).point_mm == pytest.approx((270, 0.58 * 225, 0))
    assert fold_anchor(with_mount(rig, fold_plane="front")).point_mm == pytest.approx((325, 60, 0))


def test_an_unknown_plane_is_refused_with_the_known_ones():
    with pytest.raises(ValueError, match=r"mount\.base_plane = 'botom': .*right, top\); did you mean 'bottom'\?"):
        base_anchor(with_mount(AQUA2, base_plane="botom"))


def test_a_file_hull_has_the_planes_it_declares(on_a_sphere):
    deck = HullPlane(point_mm=(0.0, 0.0, 250.0), normal=(0.0, 0.0, 2.0))
    hull = on_a_sphere.gaze.hull.model_copy(update={"planes": {"deck": deck}})
    rig = with_mount(on_a_sphere.with_gaze(hull=hull), fold_plane="deck")
    assert set(hull_planes(hull)) == {"deck"}
    assert fold_anchor(rig).point_mm == (276, 60, 250)
    assert fold_anchor(rig).normal == (0, 0, 1)


def test_the_normal_of_a_file_hull_is_that_of_its_surface(on_a_sphere):
    """On a sphere about the origin the normal is the direction to the point, to half a facet: 1.1 degrees here."""
    direction = np.array([0.48, 0.36, 0.8])
    rig = with_mount(on_a_sphere, fold_anchor_mm=tuple(300 * direction))
    assert np.dot(fold_anchor(rig).normal, direction) > np.cos(np.radians(1.2))
    assert anchor_problems(with_mount(rig, base_anchor_mm=(0.0, 0.0, -300.0)), rig_surface(on_a_sphere)) == []


def rig_surface(rig: Rig) -> trimesh.Trimesh:
    return trimesh.load_mesh(rig.gaze.hull.file)


def test_a_step_files_named_face_is_a_plane(tmp_path):
    """A box of 600 x 200 x 100 mm with one face named in the file; its middle is one of the six."""
    path = tmp_path / "hull.step"
    export_step(Box(600, 200, 100), path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("ADVANCED_FACE(''", "ADVANCED_FACE('deck'", 1), encoding="utf-8")
    hull = FileHull(shape="file", file=path, position_mm=(0.0, 0.0, 7.0))
    rig = with_mount(AQUA2.with_gaze(hull=hull), fold_anchor_mm=(1.0, 2.0, 10.0), fold_plane="deck")
    anchor = fold_anchor(rig)
    normal, half = np.array(anchor.normal), np.array([300, 100, 50])
    assert sorted(abs(normal)) == pytest.approx([0, 0, 1])
    assert (np.array(anchor.point_mm) - [0, 0, 7]) @ normal == pytest.approx(abs(normal) @ half)
    with pytest.raises(ValueError, match=r"mount\.fold_plane = 'dek': .*did you mean 'deck'"):
        fold_anchor(with_mount(rig, fold_plane="dek"))


def test_named_faces_stand_where_those_of_the_posed_solid_do(tmp_path):
    """All six of a box that is moved and turned about each axis, as build123d has them."""
    path = tmp_path / "hull.step"
    export_step(Box(600, 200, 100), path)
    names = iter("abcdef")
    text = path.read_text(encoding="utf-8")
    path.write_text(re.sub(r"ADVANCED_FACE\(''", lambda _: f"ADVANCED_FACE('{next(names)}'", text), encoding="utf-8")
    hull = FileHull(shape="file", file=path, position_mm=(10, -20, 30), yaw_deg=40, pitch_deg=-25, roll_deg=70)
    faces = [(tuple(face.center()), tuple(face.normal_at())) for face in step_solid(hull).faces()]
    planes = step_planes(hull)
    assert sorted(planes) == list("abcdef")
    for plane in planes.values():
        assert min(np.abs(np.subtract(plane, face)).max() for face in faces) < 1e-9


def test_a_point_off_the_surface_and_a_wrong_normal_are_problems_with_numbers():
    rig = with_mount(AQUA2, fold_anchor_mm=(270.0, 60.0, 71.5), base_normal=(0.0, 1.0, -1.0))
    off, tilted = anchor_problems(rig, box_mesh(rig))
    assert (off.place, off.expected) == (
        "mount.fold_anchor_mm",
        "a point on the hull; the nearest is (270.0, 60.0, 65.0), 6.5 mm away",
    )
    assert tilted.place == "mount.base_normal"
    assert "(0.000, 0.000, -1.000) at this anchor: they are 45.0 degrees apart" in tilted.expected


def test_a_plane_beside_the_hull_is_a_problem():
    """The top's plane goes on beyond the hull's edge; a flange does not."""
    rig = with_mount(AQUA2, fold_anchor_mm=(400.0, 60.0, 0.0), fold_plane="top")
    assert [p.place for p in anchor_problems(rig, box_mesh(rig))] == ["mount.fold_anchor_mm"]


def test_an_edge_has_the_normals_of_both_its_faces():
    nearest, normals, gap = nearest_on_surface(trimesh.creation.box(extents=(2, 2, 2)), (0.3, 1.0, 2.0))
    assert nearest == pytest.approx((0.3, 1, 1))
    assert gap == pytest.approx(1)
    assert {tuple(normal) for normal in np.round(normals, 9)} == {(0, 1, 0), (0, 0, 1)}


def test_name_and_normal_together_are_refused():
    with pytest.raises(ValueError, match="expected base_plane or base_normal, got both"):
        Mount.model_validate(AQUA2.gaze.mount.model_dump() | {"base_plane": "top", "base_normal": (0, 0, 1)})


def test_facets_of_a_coarse_mesh_are_not_its_normal(tmp_path):
    """A roof of ridges 12 mm apart whose flanks slope by 20 degrees: a flange lies on it as on the level."""
    x = np.arange(-100.0, 101.0, 6.0)
    heights = np.tile([0.0, 6 * np.tan(np.radians(20))], len(x))[: len(x)]
    top = np.array([[a, b, h] for b in (-100.0, 100.0) for a, h in zip(x, heights, strict=True)])
    n = len(x)
    quads = [((i, i + 1, n + i), (i + 1, n + i + 1, n + i)) for i in range(n - 1)]
    roof = trimesh.Trimesh(top, np.array(quads).reshape(-1, 3), process=False)
    rig = with_mount(
        AQUA2.with_gaze(hull=FileHull(shape="file", file=tmp_path / "roof.stl", unit="mm")),
        fold_anchor_mm=(3.0, 0.0, 3 * np.tan(np.radians(20))),
        fold_normal=(0.0, 0.0, 1.0),
        base_normal=(0.0, 0.0, -1.0),
    )
    places = [problem.place for problem in anchor_problems(rig, roof)]
    assert places == ["mount.base_anchor_mm"]
    leaning = with_mount(rig, fold_normal=(0.0, 0.3, 1.0))
    assert "mount.fold_normal" in [problem.place for problem in anchor_problems(leaning, roof)]
