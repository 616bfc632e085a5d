"""What is exported reads back as what was built, and is the same bytes the next time."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from build123d import import_step

from cad.export import GLB_FROM_BODY, export_mount

POSE = (0.4, -0.3)
FLOAT32_METRES = 1e-6
"""glTF stores single precision: 1e-7 of a length below a metre, with room for the transform."""


@pytest.fixture(scope="module")
def exported(built, tmp_path_factory):
    folder = tmp_path_factory.mktemp(built.rig.name) / "new" / "mount"
    return folder, export_mount(built.rig, folder, *POSE)


def test_the_folder_holds_what_is_returned_and_nothing_else(built, exported):
    folder, paths = exported
    assert sorted(paths) == sorted(folder.iterdir())
    assert list(folder.parent.iterdir()) == [folder]
    assert [path.name for path in paths[:-2]] == [f"{mesh.name}.stl" for mesh in built.meshes]


def test_every_stl_is_closed_and_in_millimetres(built, exported):
    folder, _ = exported
    for part in built.assembly.parts:
        surface = trimesh.load_mesh(folder / f"{part.name}.stl")
        assert surface.is_watertight, part.name
        assert surface.volume == pytest.approx(part.solid.volume, rel=0.01), part.name


def test_the_step_holds_every_part_by_name_in_its_place(built, exported):
    folder, _ = exported
    whole = import_step(folder / f"{built.rig.name}.step")
    assert {child.label for child in whole.children} == {part.name for part in built.assembly.parts}
    for child in whole.children:
        part = built.assembly.part(child.label)
        centre = built.assembly.pose(part, *POSE).apply(np.array(tuple(part.solid.center())) / 1000)
        assert child.volume == pytest.approx(part.solid.volume, rel=1e-6)
        assert 1000 * centre == pytest.approx(np.array(tuple(child.center())), abs=1e-3)


def test_the_glb_is_metres_with_y_up(built, exported):
    folder, _ = exported
    scene = trimesh.load_scene(folder / f"{built.rig.name}.glb")
    assert set(scene.geometry) == {part.name for part in built.assembly.parts}
    for mesh in built.meshes:
        part = built.assembly.part(mesh.name)
        body = built.assembly.pose(part, *POSE).apply(mesh.vertices_m)
        pose, geometry = scene.graph[mesh.name]
        found = trimesh.transform_points(scene.geometry[geometry].vertices, pose)
        expected = body @ GLB_FROM_BODY[:3, :3].T
        assert found.min(axis=0) == pytest.approx(expected.min(axis=0), abs=FLOAT32_METRES)
        assert found.max(axis=0) == pytest.approx(expected.max(axis=0), abs=FLOAT32_METRES)
    top = scene.geometry["fold_bracket"].vertices[:, 1].max()
    assert top == pytest.approx(scene.bounds[1, 1], abs=0.2)


def test_a_second_export_gives_the_same_bytes(built, exported, tmp_path):
    for path in export_mount(built.rig, tmp_path / "again", *POSE):
        assert path.read_bytes() == (exported[0] / path.name).read_bytes(), path.name
