"""Hull files that are broken, huge or in the wrong unit: repaired, simplified, or refused with a sentence."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from cad.hulls import hull_mesh, mesh_simplification
from cad.hulls.hull_mesh import hull_notes, posed, read_hull_solid, read_hull_surface
from cad.hulls.hull_mesh_key import HULL_MESH_VERSION
from cad.hulls.mesh_repair import manifold
from cad.hulls.mesh_simplification import decimated, surface_distance
from cad.hulls.wrapping import solid_field
from rigs import FileHull, Rig

VOLUME = 600 * 200 * 100


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path / "cache"))


def box(subdivisions: int = 3) -> trimesh.Trimesh:
    """Box of 600 x 200 x 100 mm in 768 triangles."""
    mesh = trimesh.creation.box(extents=(600, 200, 100))
    for _ in range(subdivisions):
        mesh = mesh.subdivide()
    return mesh


def written(tmp_path, mesh: trimesh.Trimesh, name: str = "hull.stl", unit: str = "mm") -> FileHull:
    path = tmp_path / name
    mesh.export(path)
    return FileHull(shape="file", file=path, unit=unit)


def without(mesh: trimesh.Trimesh, faces) -> trimesh.Trimesh:
    keep = np.ones(len(mesh.faces), dtype=bool)
    keep[faces] = False
    return trimesh.Trimesh(mesh.vertices, mesh.faces[keep], process=False)


def is_good(mesh: trimesh.Trimesh, volume: float = VOLUME, rel: float = 1e-6) -> bool:
    return bool(mesh.is_watertight and mesh.is_winding_consistent and mesh.volume == pytest.approx(volume, rel=rel))


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply"])
def test_a_good_mesh_is_taken_as_it_is(tmp_path, suffix):
    read = read_hull_solid(written(tmp_path, box(), f"hull.{suffix}"))
    assert read.notes == ()
    assert is_good(read.surface)
    assert len(read.surface.faces) == 768


def test_an_ascii_stl_in_metres_is_read_too(tmp_path):
    path = tmp_path / "hull.stl"
    path.write_text(box(0).apply_scale(0.001).export(file_type="stl_ascii"), encoding="utf-8")
    assert is_good(read_hull_solid(FileHull(shape="file", file=path, unit="m")).surface)


def test_unit_and_pose_are_applied(tmp_path):
    hull = written(tmp_path, box(0).apply_scale(1 / 25.4), unit="inch")
    moved = hull.model_copy(update={"position_mm": (10.0, 20.0, 30.0), "yaw_deg": 90.0})
    assert posed(moved, read_hull_surface(moved).surface).bounds == pytest.approx(
        np.array([[-90, -280, -20], [110, 320, 80]]), abs=1e-3
    )


def test_small_holes_are_closed_and_said(tmp_path):
    """The rims are three triangles' sides; up to a tenth of the diagonal of 640 mm is closed."""
    mesh = box(5)
    hull = written(tmp_path, without(mesh, [0, 500, 1000]))
    read = read_hull_solid(hull)
    assert is_good(read.surface)
    assert read.notes[0].startswith("closed 3 holes, the longest rim ")
    rig = Rig.load("aqua2").with_gaze(hull=hull)
    assert hull_notes(rig) == [f"hull.stl: {read.notes[0]}"]


def test_triangles_that_face_the_wrong_way_are_turned(tmp_path):
    mesh = box()
    mesh.faces[[5, 70, 71]] = mesh.faces[[5, 70, 71], ::-1]
    read = read_hull_solid(written(tmp_path, mesh))
    assert read.notes == ()
    assert is_good(read.surface)


def test_a_surface_inside_out_is_turned(tmp_path):
    mesh = box()
    read = read_hull_solid(written(tmp_path, trimesh.Trimesh(mesh.vertices, mesh.faces[:, ::-1], process=False)))
    assert read.notes == ()
    assert is_good(read.surface)


def test_triangles_given_twice_and_slivers_are_dropped(tmp_path):
    mesh = box()
    doubled = np.vstack([mesh.faces, mesh.faces[:7], [[3, 3, 4]]])
    read = read_hull_solid(written(tmp_path, trimesh.Trimesh(mesh.vertices, doubled, process=False)))
    assert read.notes == ("dropped 7 triangles given twice",)
    assert is_good(read.surface)


def test_a_crack_is_joined(tmp_path):
    """The upper half of a box lies 0.02 mm above the lower; a crack is up to 1e-4 of the diagonal, 0.06 mm."""
    mesh = box()
    upper = mesh.triangles_center[:, 2] > 0
    soup = mesh.triangles.copy()
    soup[upper, :, 2] += 0.02
    faces = np.arange(3 * len(soup)).reshape(-1, 3)
    read = read_hull_solid(written(tmp_path, trimesh.Trimesh(soup.reshape(-1, 3), faces, process=False)))
    assert [note.split(" along ")[0] for note in read.notes] == ["joined cracks"]
    assert is_good(read.surface, rel=1e-3)  # 0.02 of 100 mm


def test_overlapping_shells_are_united_and_cavities_stay(tmp_path):
    """Two boxes that share 100 x 200 x 100 mm, and a cavity of 50 mm in one of them."""
    second = box()
    second.apply_translation((500, 0, 0))
    cavity = trimesh.creation.box(extents=(50, 50, 50))
    cavity.invert()
    read = read_hull_solid(written(tmp_path, trimesh.util.concatenate([box(), second, cavity])))
    assert read.notes == ("united 3 shells",)
    assert is_good(read.surface, 2 * VOLUME - 100 * 200 * 100 - 50**3)


def test_a_shell_that_is_inside_out_beside_a_good_one_is_turned(tmp_path):
    second = box(0)
    second.apply_scale(0.5)
    second.apply_translation((400, 0, 0))
    second.invert()
    read = read_hull_solid(written(tmp_path, trimesh.util.concatenate([box(), second])))
    assert read.notes == ("united 2 shells",)
    assert is_good(read.surface, VOLUME * (1 + 1 / 8) - 50 * 100 * 50)


def test_a_large_mesh_is_simplified_with_a_measured_distance():
    """An ellipsoid of 327,680 triangles; the surfaces' distance bounds that of their volumes."""
    mesh = trimesh.creation.icosphere(subdivisions=7, radius=1)
    mesh.apply_scale((800, 115, 115))
    simple = decimated(mesh, most=20_000)
    distance = surface_distance(mesh, simple)
    assert len(simple.faces) <= 20_000
    assert simple.is_watertight
    assert 0 < distance < 2
    assert abs(simple.volume - mesh.volume) < distance * mesh.area


def test_a_huge_mesh_is_thinned_first_and_stays_closed(tmp_path, monkeypatch):
    """The grid's first step is 1600 mm / 4096; a corner moves by at most its diagonal, 0.68 mm, or twice that."""
    monkeypatch.setattr(mesh_simplification, "MOST_AT_ONCE", 100_000)
    monkeypatch.setattr(mesh_simplification, "MOST_TRIANGLES", 90_000)
    mesh = trimesh.creation.icosphere(subdivisions=7, radius=1)
    mesh.apply_scale((800, 115, 115))
    hull = written(tmp_path, mesh)
    (note,) = read_hull_surface(hull).notes
    assert note.startswith("simplified from 327,") and note.endswith(" mm away")
    assert float(note.split("at most ")[1].split()[0]) < 3
    assert read_hull_solid(hull).surface.is_watertight


def test_the_distance_of_shifted_boxes_is_the_shift():
    """Long triangles too: the candidates come from a lattice on them."""
    moved = box(0)
    moved.apply_translation((0, 0, 3))
    assert surface_distance(box(0), moved) == pytest.approx(3, abs=1e-9)
    assert surface_distance(box(0), box(4)) == pytest.approx(0, abs=1e-9)


def test_the_outcome_is_cached_by_content(tmp_path, monkeypatch):
    hull = written(tmp_path, without(box(5), [0]))
    first = read_hull_solid(hull)
    monkeypatch.setattr(hull_mesh, "_made_solid", lambda _: pytest.fail("made again"))
    again = read_hull_solid(hull.model_copy(update={"file": hull.file.rename(tmp_path / "other.stl")}))
    assert (again.notes, again.surface.volume) == (first.notes, first.surface.volume)


def dented_through() -> trimesh.Trimesh:
    """A box whose top is dented so deeply that it comes out at the bottom."""
    mesh = box()
    x, y, z = mesh.vertices.T
    mesh.vertices[(z > 49) & (abs(x) < 160) & (abs(y) < 60), 2] = -150
    return mesh


def files_to_wrap():
    mesh = box(0)
    rim = np.linalg.norm(np.diff(mesh.triangles[0][[0, 1, 2, 0]], axis=0), axis=1).sum()
    corners = np.array([[0, 0, 0], [600, 0, 0], [0, 200, 0], [0, 0, 100], [0, -200, 0]])
    fans = trimesh.Trimesh(corners, [[0, 1, 2], [0, 1, 3], [0, 1, 4]], process=False)
    return {
        "open": (without(mesh, [0]), f"1 hole with {rim:.0f} mm of open edge in all"),
        "fans": (fans, "1 edge of more than two triangles"),
        "through": (dented_through(), "of its edges going through itself"),
    }


@pytest.mark.parametrize("name", ["open", "fans", "through"])
def test_what_small_repairs_do_not_close_is_wrapped(tmp_path, monkeypatch, name):
    """The surface stays as it is; the solid is closed, around all of it, and says why and how near it is."""
    monkeypatch.setattr(solid_field, "CELLS_ALONG", 40)
    mesh, words = files_to_wrap()[name]
    hull = written(tmp_path, mesh, f"{name}.stl")
    assert read_hull_surface(hull).surface.area == pytest.approx(mesh.area)
    assert read_hull_surface(hull).notes == ()
    read = read_hull_solid(hull)
    assert read.surface.is_watertight
    assert (read.surface.bounds[0] <= mesh.bounds[0]).all() and (read.surface.bounds[1] >= mesh.bounds[1]).all()
    (note,) = read.notes
    assert note.startswith("its solid is a wrap of ") and words in note and " mm of the file's surface" in note


def test_bodies_apart_are_kept_joined_or_left(tmp_path, monkeypatch):
    monkeypatch.setattr(solid_field, "CELLS_ALONG", 40)
    second, crumb = box(0), trimesh.creation.box(extents=(5, 5, 5))
    second.apply_scale(0.5)
    second.apply_translation((700, 0, 0))
    crumb.apply_translation((0, 300, 0))
    hull = written(tmp_path, trimesh.util.concatenate([box(), second, crumb]))
    pair = written(tmp_path, trimesh.util.concatenate([box(), second]), "pair.stl")
    found = {keep: read_hull_solid(hull.model_copy(update={"keep": keep})) for keep in ("all", "largest")}
    found["joined"] = read_hull_solid(pair.model_copy(update={"keep": "joined"}))
    assert is_good(found["all"].surface, VOLUME * (1 + 1 / 8))
    apart = '2 bodies that do not touch; hull.keep = "joined" joins them, "largest" leaves the others out'
    assert found["all"].notes == (apart, "left out 1 part: 5 mm at (0, 300, 0), in the file's axes")
    assert is_good(found["largest"].surface)
    both = "left out 2 parts: 300 mm at (700, 0, 0), 5 mm at (0, 300, 0), in the file's axes"
    assert found["largest"].notes == (both,)
    assert found["joined"].surface.body_count == 1
    assert "2 bodies that do not touch and are to be joined" in found["joined"].notes[0]
    assert found["joined"].notes[1].startswith("joined 2 bodies by bars of up to ")


def refused_files():
    mesh = box(0)
    nan = mesh.vertices.copy()
    nan[3, 1] = np.nan
    return {
        "nan": (trimesh.Trimesh(nan, mesh.faces, process=False), "that are not a number or infinite"),
        "flat": (trimesh.Trimesh(mesh.vertices[[0, 1, 1]], [[0, 1, 2]], process=False), "got none that has an area"),
    }


@pytest.mark.parametrize("name", ["nan", "flat"])
def test_what_is_no_surface_is_refused_with_numbers(tmp_path, name):
    mesh, words = refused_files()[name]
    with pytest.raises(ValueError) as refusal:
        read_hull_solid(written(tmp_path, mesh, f"{name}.stl"))
    assert str(refusal.value).startswith(f"hull.file = '{name}.stl': expected ")
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("content", [b"", b"solid nothing\nendsolid nothing\n", b"hello", b"\x00" * 200])
def test_what_is_no_mesh_is_refused(tmp_path, content):
    path = tmp_path / "hull.stl"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"hull\.file = 'hull\.stl': expected (a mesh|triangles)"):
        read_hull_solid(FileHull(shape="file", file=path, unit="mm"))


def test_an_unknown_kind_of_file_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"hull\.file = 'hull\.blend': expected a file that ends in \.stl"):
        read_hull_solid(FileHull(shape="file", file=tmp_path / "hull.blend", unit="mm"))


@pytest.mark.parametrize(
    ("scale", "unit", "words"),
    [
        (0.001, "mm", 'got one of 0.6 mm with unit = "mm"; unit = "m" would make it 600 mm'),
        (
            1.0,
            "m",
            'got one of 600 m with unit = "m"; unit = "mm" would make it 600 mm or unit = "cm" would make it 6 m',
        ),
        (1e9, "mm", 'got one of 6e+08 m with unit = "mm"'),
    ],
)
def test_a_wrong_unit_is_suspected(tmp_path, scale, unit, words):
    hull = written(tmp_path, box(0).apply_scale(scale), unit=unit)
    with pytest.raises(ValueError, match="expected a vehicle of 100 mm to 20 m") as refusal:
        read_hull_solid(hull)
    assert words in str(refusal.value)


def test_kept_hulls_are_what_would_be_read_today(tmp_path, check_recorded, monkeypatch):
    """An ellipsoid of more triangles than are kept and a box that overlaps it."""
    monkeypatch.setattr(hull_mesh, "decimated", lambda mesh: decimated(mesh, 600))
    ellipsoid = trimesh.creation.icosphere(subdivisions=4, radius=1)
    ellipsoid.apply_scale((400, 60, 80))
    read = read_hull_solid(written(tmp_path, trimesh.util.concatenate([ellipsoid, box(0)])))
    assert read.notes == ("united 2 shells",)
    corners = np.asarray(read.surface.triangles)
    shape = np.array([len(corners), read.surface.area, read.surface.volume, *np.abs(corners).sum(axis=(0, 1))])
    check_recorded("hull mesh", HULL_MESH_VERSION, rel=1e-6, shape=shape, notes=np.array(read.notes))


def test_kept_wraps_are_what_would_be_made_today(tmp_path, check_recorded, monkeypatch):
    """An ellipsoid without its end; how far each corner is drawn hangs on single precision, and so on the processor."""
    monkeypatch.setattr(solid_field, "CELLS_ALONG", 40)
    ellipsoid = trimesh.creation.icosphere(subdivisions=4, radius=1)
    ellipsoid.apply_scale((400, 60, 80))
    surface = read_hull_solid(written(tmp_path, without(ellipsoid, ellipsoid.triangles_center[:, 0] > 350))).surface
    check_recorded("hull wrap", HULL_MESH_VERSION, rel=1e-3, shape=np.array([surface.area, surface.volume / 1000]))


def test_triangles_that_cannot_be_written_to_make_a_body_too():
    """Those of a mesh from the cache cannot: a search on a hull's file ended there."""
    box = trimesh.creation.box((100.0, 200.0, 300.0))
    vertices, faces = np.array(box.vertices), np.array(box.faces, dtype=np.int32)
    vertices.flags.writeable = faces.flags.writeable = False
    assert manifold(vertices, faces).volume() == pytest.approx(6e6)
