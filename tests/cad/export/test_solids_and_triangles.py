"""STL, STEP, GLB and 3MF read back as what was built: names, places, units, colours."""

from __future__ import annotations

import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh
from build123d import import_step

from cad.colours import COLOURS
from cad.export.glb import GLB_FROM_BODY
from cad.export.step import write_step
from cad.export.triangles import write_glb

POSE = (0.4, -0.3)
FLOAT32_METRES = 1e-6
"""glTF stores single precision: 1e-7 of a length below a metre, with room for the transform."""
CHORDS = 0.01
"""Share of a curved part's volume that the triangles of its mesh cut off, at most (`cad.assembly.tessellation`)."""
STEP_ROUNDING = 1e-6
"""Relative; coordinates are written with some 15 digits, volumes are sums over curved faces."""


def test_every_stl_is_closed_and_in_millimetres(exported):
    for part in exported.assembly.parts:
        surface = trimesh.load_mesh(exported.folder / "parts" / f"{part.name}.stl")
        assert surface.is_watertight, part.name
        assert surface.volume == pytest.approx(part.solid.volume, rel=CHORDS), part.name


def test_the_step_holds_every_part_by_name_and_colour_in_its_place(exported, tmp_path):
    whole = import_step(write_step(exported.assembly, tmp_path / "posed.step", *POSE))
    assert {child.label for child in whole.children} == {part.name for part in exported.assembly.parts}
    for child in whole.children:
        part = exported.assembly.part(child.label)
        centre = exported.assembly.pose(part, *POSE).apply(np.array(tuple(part.solid.center())) / 1000)
        assert child.volume == pytest.approx(part.solid.volume, rel=STEP_ROUNDING), part.name
        assert child.is_valid, part.name
        assert 1000 * centre == pytest.approx(np.array(tuple(child.center())), abs=1e-3)
        # Open CASCADE keeps colours in single precision.
        assert tuple(child.color)[:3] == pytest.approx(np.array(COLOURS[part.role.value]) / 255, abs=1e-6)


def test_the_glb_is_metres_with_y_up(exported, tmp_path):
    path = write_glb(exported.assembly, tmp_path / "posed.glb", *POSE)
    scene = trimesh.load_scene(path)
    assert set(scene.geometry) == {part.name for part in exported.assembly.parts}
    for mesh in exported.assembly.meshes:
        part = exported.assembly.part(mesh.name)
        body = exported.assembly.pose(part, *POSE).apply(mesh.vertices_m)
        pose, geometry = scene.graph[mesh.name]
        found = trimesh.transform_points(scene.geometry[geometry].vertices, pose)
        expected = body @ GLB_FROM_BODY[:3, :3].T
        assert found.min(axis=0) == pytest.approx(expected.min(axis=0), abs=FLOAT32_METRES)
        assert found.max(axis=0) == pytest.approx(expected.max(axis=0), abs=FLOAT32_METRES)


def test_the_3mf_is_in_millimetres_with_names_and_colours(exported):
    """Read by hand from its XML (3MF core specification 1.3) and by trimesh."""
    path = exported.folder / f"{exported.assembly.rig.name}.3mf"
    core = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
    with zipfile.ZipFile(path) as archive:
        model = ElementTree.fromstring(archive.read("3D/3dmodel.model"))
    assert model.attrib["unit"] == "millimeter"
    shades = [base.attrib["displaycolor"] for base in model.iter(f"{core}base")]
    colour_of = {thing.attrib["name"]: shades[int(thing.attrib["pindex"])] for thing in model.iter(f"{core}object")}
    expected = {
        part.name: "#{:02X}{:02X}{:02X}FF".format(*COLOURS[part.role.value]) for part in exported.assembly.parts
    }
    assert colour_of == expected
    scene = trimesh.load_scene(path)
    for mesh in exported.assembly.meshes:
        part = exported.assembly.part(mesh.name)
        body = 1000 * exported.assembly.pose(part, 0.0, 0.0).apply(mesh.vertices_m)
        # Six decimals are written.
        assert scene.geometry[mesh.name].bounds == pytest.approx(np.array([body.min(0), body.max(0)]), abs=1e-4)
