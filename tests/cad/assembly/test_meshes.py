"""The cache: what is in its key, and that a hit is exact and light."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from cad.assembly import meshes as module
from cad.assembly.building_process import built
from cad.assembly.meshes import mesh_key, meshes_beside, rig_meshes
from cad.assembly.part_meshes import MESH_VERSION
from cad.hulls.hull import hull_shape
from optics.layout import Layout
from optics.mesh import Role
from rigs import BoxHull, FileHull, Rig, Water


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path))
    return tmp_path


@pytest.fixture
def kept(aqua2, cache):
    """aqua2's meshes, in the cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "_built", lambda rig, stowed: aqua2.meshes)
        rig_meshes(aqua2.rig)
    return aqua2


def printed(code):
    """What Python code prints in a process of its own."""
    run = subprocess.run([sys.executable, "-c", code], env=dict(os.environ), capture_output=True, text=True, check=True)
    return run.stdout.split()


def test_meshes_survive_the_cache_exactly(kept, monkeypatch):
    monkeypatch.setattr(module, "_built", lambda rig, stowed: pytest.fail("built again"))
    for before, after in zip(kept.meshes, rig_meshes(kept.rig), strict=True):
        assert (before.name, before.group, before.role) == (after.name, after.group, after.role)
        assert after.vertices_m.dtype == np.float64
        assert after.faces.dtype == np.int32
        np.testing.assert_array_equal(before.vertices_m, after.vertices_m)
        np.testing.assert_array_equal(before.faces, after.faces)


def test_a_hit_does_not_import_the_modelling_kernel(kept):
    code = (
        "import sys; from cad.assembly.meshes import rig_meshes; from rigs import Rig;"
        "print(len(rig_meshes(Rig.load('aqua2'))), 'build123d' in sys.modules, 'trimesh' in sys.modules)"
    )
    assert printed(code) == [str(len(kept.meshes)), "False", "False"]


@pytest.mark.skipif(sys.platform != "linux", reason="meshes are built in the process itself")
@pytest.mark.parametrize("name", ["aqua2", "glider"])
def test_meshes_are_built_beside_what_else_is_done(name, cache):
    """Around a hull of the kernel's shapes, and one from a file."""
    found = printed(
        "import sys; from cad.assembly.meshes import meshes_beside, rig_meshes; from rigs import Rig;"
        f"rig = Rig.load('{name}')\n"
        "with meshes_beside(rig): meshes = rig_meshes(rig)\n"
        "print(sum(mesh.vertices_m.sum() for mesh in meshes), 'build123d' in sys.modules, 'drjit' in sys.modules)"
    )
    built = rig_meshes(Rig.load(name))  # from the cache
    assert found == [str(sum(mesh.vertices_m.sum() for mesh in built)), "False", "False"]


@pytest.mark.skipif(sys.platform != "linux", reason="meshes are built in the process itself")
def test_a_builder_that_dies_leaves_the_work_to_who_asks(cache):
    found = printed(
        "import os; from cad.assembly.building_process import building, built\n"
        "with building('a', lambda: os._exit(1)), building('b', lambda: 1 / 0), building('c', lambda: ['mesh']):"
        " print(built('a'), built('b'), built('c'), built('c'))"
    )
    assert found == ["None", "None", "['mesh']", "None"]


@pytest.mark.skipif(sys.platform != "linux", reason="meshes are built in the process itself")
def test_a_builder_ends_when_nobody_waits_for_it_any_more():
    # It has our output, which ends with it: else this waits in vain.
    assert not printed(
        "import os; from cad.assembly.building_process import building\n"
        "with building('a', lambda: bytes(1_000_000)): os._exit(0)"
    )


def test_with_the_modelling_kernel_nobody_else_builds(aqua2, cache):
    with meshes_beside(aqua2.rig):
        assert built(mesh_key(aqua2.rig)) is None


def test_the_key_is_of_shapes_only(aqua2):
    rig, servos = aqua2.rig, aqua2.rig.gaze.servos
    key = mesh_key(rig)
    for same in ({"name": "other"}, {"description": "x"}, {"water": Water(jerlov_type="II")}):
        assert mesh_key(rig.model_copy(update=same)) == key
    slow = servos.pan.model_copy(update={"speed_deg_per_s": 1.0})
    for same in ({"servos": {"pan": slow}}, {"mount": {"colour": "black"}}):
        assert mesh_key(rig.with_gaze(**same)) == key
    wide = servos.tilt.model_copy(update={"shaft_offset_mm": 7.0})
    for other in ({"servos": {"tilt": wide}}, {"mount": {"wall_mm": 5.0}}):
        assert mesh_key(rig.with_gaze(**other)) != key


def test_what_is_printed_has_the_mounts_colour(aqua2, cache):
    """The mount's parts and no others; whether they were in the cache or not."""
    rig = aqua2.rig.with_gaze(mount={"colour": "black"})
    for _ in range(2):
        parts = rig_meshes(rig)
        assert {part.colour for part in parts if part.role is Role.MOUNT} == {"black"}
        assert {part.colour for part in parts if part.role is not Role.MOUNT} == {None}


def test_a_rig_without_mirrors_has_no_meshes(cache):
    with pytest.raises(ValueError, match="expected a rig with mirrors, got 'bench'"):
        rig_meshes(Rig.load("bench"))


RECORDED_REL = 1e-8
"""Of the sum of a fingerprint, whose largest terms are of the hull: 10 nm of it, 10 µm of a part of the mount."""
HULLS = {
    "sharp box": BoxHull(shape="box", length_mm=650, width_mm=450, height_mm=130, edge_radius_mm=0),
    "one flipper": BoxHull(shape="box", length_mm=650, width_mm=450, height_mm=130, flippers_per_side=1),
    "blunt torpedo": Rig.load("torpedo").gaze.hull.model_copy(
        update={"nose_exponent": 4.0, "nose_length_mm": 300.0, "tail_angle_deg": 15.0, "fins": 3}
    ),
    "file": FileHull(shape="file", file="hull.stl", unit="m", position_mm=(10, 20, 30), yaw_deg=10, pitch_deg=20),
}


def shapes(meshes):
    """Labels of parts, and of each part what does not hang on the order of its triangles.

    Triangles, their area (mm²) and first and second moments of where they are (cm).
    """
    labels = np.array([(mesh.name, mesh.group.value, mesh.role.value) for mesh in meshes])
    rows = []
    for mesh in meshes:
        corners = 100 * mesh.vertices_m[mesh.faces]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area, middle = np.linalg.norm(cross, axis=1) / 2, corners.mean(axis=1)
        volume = np.einsum("ni,ni->", corners[:, 0], cross) / 6
        rows.append([len(area), 100 * area.sum(), volume, *(area @ middle), *(area @ middle**2)])
    return {"labels": labels, "shapes": np.array(rows)}


@pytest.mark.parametrize("name", ["aqua2", "bluerov2", "torpedo"])
def test_kept_meshes_are_what_would_be_built_today(name, built_preset, check_recorded):
    """Every part of every preset, hull included: no change of a shape can leave stale meshes in the caches.

    The solids are build123d's, whose version is in the key as well; another version of it may fail this test too.
    """
    check_recorded(f"meshes of {name}", MESH_VERSION, rel=RECORDED_REL, **shapes(built_preset(name).meshes))


def test_kept_meshes_of_a_stowed_mirror_are_what_would_be_built_today(built_preset, check_recorded):
    meshes = built_preset("bluerov2").stowed_meshes
    check_recorded("meshes of bluerov2, stowed", MESH_VERSION, rel=RECORDED_REL, **shapes(meshes))


@pytest.mark.parametrize("name", ["sharp box", "one flipper", "blunt torpedo", "file"])
def test_kept_hulls_are_what_would_be_built_today(name, aqua2, tmp_path, check_recorded):
    """Hulls of kinds that no preset has, without the mount."""
    hull = HULLS[name]
    if isinstance(hull, FileHull):
        hull = hull.model_copy(update={"file": tmp_path / "hull.stl"})
        trimesh.creation.box(extents=(0.65, 0.26, 0.13)).export(hull.file)
    solid = hull_shape(hull, aqua2.rig.gaze.mount, aqua2.rig.port, Layout.from_rig(aqua2.rig))
    part = replace(aqua2.part("hull"), make=lambda: solid)
    check_recorded(f"hull: {name}", MESH_VERSION, rel=RECORDED_REL, **shapes([part.mesh]))
