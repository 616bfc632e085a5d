"""Formats of meshes: what each says about itself, and files that are none."""

from __future__ import annotations

import json
import re
import struct
import subprocess

import lib3mf
import numpy as np
import pytest
import trimesh
from build123d import Compound, Face, Pos, Solid, export_step, import_step

from cad.hulls.files import step
from cad.hulls.files.triangles import hull_files, read_hull_file, read_triangles

SIZE = (6.0, 2.0, 1.0)


def box() -> trimesh.Trimesh:
    return trimesh.creation.box(extents=SIZE)


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "glb", "gltf"])
def test_a_mesh_is_read_as_it_is(write, suffix):
    found = read_hull_file(gltf(write) if suffix == "gltf" else write(f"a.{suffix}", box()))
    assert found.size == pytest.approx(SIZE)
    assert (len(found.faces), found.forward) == (12, None)
    assert (found.unit_mm, found.up) == ((1000, "+y") if suffix in ("glb", "gltf") else (None, None))


def gltf(write):
    for name, content in trimesh.Scene(box()).export(file_type="gltf").items():
        path = write("a.gltf" if name.endswith(".gltf") else name, content)
    return path.with_name("a.gltf")


def test_a_gltf_names_its_buffers_and_misses_them(write):
    file = gltf(write)
    _, *buffers = hull_files(file)
    named = [each["uri"] for each in json.loads(file.read_text(encoding="utf-8"))["buffers"]]
    assert [buffer.name for buffer in buffers] == named
    for buffer in buffers:
        buffer.unlink()
    missing = ", ".join(named)
    with pytest.raises(ValueError, match=rf"a\.gltf: expected the files it names beside it, missing: {missing}; put"):
        read_hull_file(file)


def test_things_of_a_scene_are_where_it_puts_them(write):
    scene = trimesh.Scene()
    scene.add_geometry(box(), node_name="left")
    scene.add_geometry(box(), node_name="right", transform=trimesh.transformations.translation_matrix((0, -5, 0)))
    found = read_hull_file(write("two.glb", scene.export(file_type="glb")))
    assert [(body.name, body.triangles) for body in found.bodies] == [("left", 12), ("right", 12)]
    assert found.box == pytest.approx(np.array([[-3, -6, -0.5], [3, 1, 0.5]]))


def test_collada_carries_unit_up_axis_and_places(one_triangle_dae):
    found = read_hull_file(one_triangle_dae('<unit name="foot" meter="0.3048"/><up_axis>Z_UP</up_axis>'))
    assert (found.unit_mm, found.up, found.bodies[0].name) == (pytest.approx(304.8), "+z", "n")
    assert found.box == pytest.approx(np.array([[0, 0, 5], [3, 4, 5]]))


def test_collada_without_a_unit_is_metres_and_y_up(one_triangle_dae):
    found = read_hull_file(one_triangle_dae())
    assert (found.unit_mm, found.up) == (1000, "+y")


def test_3mf_carries_its_unit_and_places_components(tmp_path):
    """A triangle in a component at x + 10 in an item at y + 100, in centimetres."""
    library = lib3mf.get_wrapper()
    model = library.CreateModel()
    model.SetUnit(lib3mf.ModelUnit.CentiMeter)
    mesh = model.AddMeshObject()
    mesh.SetName("fin")
    corners = [(0, 0, 0), (3, 0, 0), (0, 4, 0), (0, 0, 5)]
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
    positions = [lib3mf.Position((lib3mf.Position().Coordinates.__class__)(*corner)) for corner in corners]
    triangles = [lib3mf.Triangle((lib3mf.Triangle().Indices.__class__)(*face)) for face in faces]
    mesh.SetGeometry(positions, triangles)
    group = model.AddComponentsObject()
    group.AddComponent(mesh, library.GetTranslationTransform(10, 0, 0))
    model.AddBuildItem(group, library.GetTranslationTransform(0, 100, 0))
    file = tmp_path / "fin.3mf"
    model.QueryWriter("3mf").WriteToFile(str(file))
    found = read_hull_file(file)
    assert (found.unit_mm, found.up, found.bodies[0].name) == (10, "+z", "fin")
    assert found.box == pytest.approx(np.array([[10, 100, 0], [13, 104, 5]]))


def test_step_may_hold_solids_and_loose_faces(tmp_path):
    file = tmp_path / "two.step"
    sheet = Face.make_rect(100, 40)
    export_step(Compound([Solid.make_box(600, 200, 100), Pos(700, 0, 0) * Solid.make_box(10, 10, 10), sheet]), file)
    found = read_hull_file(file)
    assert (len(found.bodies), found.unit_mm) == (3, 1)
    assert found.box == pytest.approx(np.array([[-50, -20, 0], [710, 200, 100]]))
    vertices, faces = read_triangles(file, None)
    area = trimesh.Trimesh(vertices, faces, process=False).area
    assert area == pytest.approx(2 * (600 * 200 + 600 * 100 + 200 * 100) + 600 + 100 * 40)


def test_triangles_are_millimetres_and_a_unit_overrules_the_file(write, one_triangle_dae):
    for file, unit, factor in (
        (write("a.stl", box()), "cm", 10),
        (write("a.glb", box()), None, 1000),
        (write("a.glb", box()), "inch", 25.4),
    ):
        vertices, faces = read_triangles(file, unit)
        assert np.ptp(vertices, axis=0) == pytest.approx(np.array(SIZE) * factor)
        assert (len(vertices), len(faces)) == (8, 12)
    with pytest.raises(ValueError, match=r"expected a unit \(mm, cm, m, inch\), got none"):
        read_triangles(write("a.stl", box()), None)


def ply(corners: str, faces: str, properties: str = "xyz") -> str:
    counts = len(corners.splitlines()), len(faces.splitlines())
    lines = [f"property float {letter}" for letter in properties]
    head = ["ply", "format ascii 1.0", f"element vertex {counts[0]}", *lines, f"element face {counts[1]}"]
    return "\n".join([*head, "property list uchar int vertex_indices", "end_header", corners, faces, ""])


CORNERS = "0 0 0\n1 0 0\n0 1 0"
BINARY_STL = struct.pack("<80sI", b"binary", 3) + bytes(2 * 50)

WRONG = {
    "empty.stl": (b"", "expected a mesh, got an empty file"),
    "text.stl": (b"hello", "expected (a mesh|triangles), got"),
    "zeros.stl": (b"\x00" * 200, "expected (a mesh|triangles), got"),
    "none.stl": (b"solid nothing\nendsolid nothing\n", "expected (a mesh|triangles), got"),
    "cut.stl": (BINARY_STL, "expected 3 triangles in a binary STL, got 2: the file is cut off or no STL"),
    "pointer.stl": (
        b"version https://git-lfs.github.com/spec/v1\noid sha256:0",
        "expected a mesh, got a pointer of Git",
    ),
    "page.dae": (b"\n<!DOCTYPE html><html></html>", "expected a mesh, got a web page; download the file itself"),
    "text.obj": (b"hello", "expected (a mesh|triangles), got"),
    "text.ply": (b"hello", "expected (a mesh|triangles), got"),
    "far.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n", "expected (a mesh|triangles)"),
    "far.ply": (ply(CORNERS, "3 0 1 7"), "expected triangles of the corners 0 to 2, got 1 of 1 with others, 0 to 7"),
    "negative.ply": (ply(CORNERS, "3 0 1 -2"), "expected triangles of the corners 0 to 2"),
    "flat.ply": (ply("0 0\n1 0\n0 1", "3 0 1 2", "xy"), "expected (a mesh|corners of three coordinates)"),
    "nan.ply": (ply("0 0 nan\n1 0 0\n0 1 0", "3 0 1 2"), "expected finite corners, got 1 of 3"),
    "points.ply": (ply(CORNERS, ""), "expected triangles, got a cloud of 3 points; make a surface of it first"),
    "text.glb": (b"hello", "expected a mesh, got what cannot be read as one"),
    "text.gltf": (b"hello", "expected glTF, got what cannot be read as one"),
    "text.dae": (b"hello", "expected COLLADA, got what cannot be read as one"),
    "text.3mf": (b"hello", "expected 3MF, got what cannot be read as one"),
    "text.step": (b"hello", "expected a STEP file"),
    "text.urdf": (b"hello", r"expected a URDF, got what is no XML .*; get the robot's description again"),
    "none.urdf": (
        b"<robot name='a'/>",
        "expected one link that is no joint's child, got no link at all; expected links with",
    ),
    "text.sdf": (b"<robot/>", "expected an SDF, whose first element is sdf, got robot; get the robot's"),
    "hull.blend": (b"hello", r"expected a file that ends in \.stl, \.obj"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_no_mesh_is_refused_in_a_sentence(write, name, capfd):
    content, words = WRONG[name]
    with pytest.raises(ValueError, match=rf"{name}: {words}") as refusal:
        read_hull_file(write(name, content))
    assert "\n" not in str(refusal.value)
    assert capfd.readouterr() == ("", ""), "what a library writes itself belongs into the sentence"


def test_a_cut_off_collada_and_one_with_corners_that_are_not_there_are_refused(one_triangle_dae):
    with pytest.raises(ValueError, match=r"fin\.dae: expected "):
        read_hull_file(one_triangle_dae(last=9))
    file = one_triangle_dae()
    file.write_bytes(file.read_bytes()[:700])
    with pytest.raises(ValueError, match="expected COLLADA, got what cannot be read as one"):
        read_hull_file(file)


def test_no_file_is_said(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none\.stl: expected a file, found nothing"):
        read_hull_file(tmp_path / "none.stl")


def test_a_corner_beyond_all_measure_is_refused_before_anything_is_computed_with_it(write):
    """The square of an area of such triangles is no number any more."""
    far = box()
    far.vertices[0, 0] = 3e30
    with pytest.raises(ValueError, match=r"far\.stl: expected corners within 1e\+12 of the origin, got one at 3e\+30"):
        read_hull_file(write("far.stl", far))


@pytest.fixture
def step_file(tmp_path, monkeypatch):
    """A box as STEP, and a cache that knows nothing of it."""
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path / "cache"))
    file = tmp_path / "box.step"
    export_step(Solid.make_box(*SIZE), str(file))
    return file


def test_a_step_file_is_read_in_another_process_once(step_file, monkeypatch):
    apart, asked = step._read_apart, []
    monkeypatch.setattr(step, "_read_apart", lambda file: asked.append(file) or apart(file))
    assert tuple(read_hull_file(step_file).size) == pytest.approx(SIZE)
    step._read.cache_clear()
    assert tuple(step.step_shape(step_file).bounding_box().size) == pytest.approx(SIZE, abs=1e-5)
    assert asked == [step_file]


def test_the_solid_of_a_step_file_is_the_one_that_was_written(step_file):
    """It comes from the reader's process as a boundary representation: each number is the file's own."""
    ours, own = step.step_shape(step_file), import_step(step_file)
    assert ours.volume == own.volume
    assert [tuple(vertex) for vertex in ours.vertices()] == [tuple(vertex) for vertex in own.vertices()]


@pytest.mark.parametrize(
    ("status", "sentence"),
    [
        (-11, r"box\.step: expected a STEP file, got a damaged one, on which OpenCascade fails \(signal 11\)"),
        (-9, r"box\.step: expected to read it, but the system ended the reader, as it does when memory is short"),
    ],
)
def test_a_step_file_whose_reader_ends_is_refused_and_read_again_later(step_file, monkeypatch, status, sentence):
    ended = subprocess.CompletedProcess([], status, stdout="", stderr="")
    with monkeypatch.context() as patch:
        patch.setattr(subprocess, "run", lambda *arguments, **options: ended)
        with pytest.raises(ValueError, match=sentence):
            read_hull_file(step_file)
    assert len(read_hull_file(step_file).faces) == 12


@pytest.mark.parametrize(("lost", "which"), [("EDGE_LOOP", -1), ("LINE", -3)])
def test_a_step_file_without_bounds_of_a_face_is_refused(step_file, lost, which):
    """OpenCascade has no triangles for the face, or ends its process: not each time the same."""
    text = step_file.read_text(encoding="utf-8")
    number = re.findall(rf"#(\d+) = {lost}", text)[which]
    step_file.write_text(text.replace(f"#{number} = ", f"#9{number} = "), encoding="utf-8")
    with pytest.raises(
        ValueError, match=r"box\.step: expected a STEP file, got (one with a face that has no triangles|a damaged one)"
    ):
        read_hull_file(step_file)
    assert not step.is_one_solid(step_file)


def test_an_open_solid_is_read_as_triangles(step_file):
    """Of a box without a lid the file says that it is a solid."""
    text = step_file.read_text(encoding="utf-8")
    number = re.findall(r"#(\d+) = ADVANCED_FACE", text)[-1]
    step_file.write_text(text.replace(f"#{number} = ", f"#9{number} = "), encoding="utf-8")
    assert len(read_hull_file(step_file).faces) == 10
    assert not step.is_one_solid(step_file)
