"""The cache: what is in its key, that a hit is exact and light, and that damage is repaired."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from cad import meshes as module
from cad.meshes import load_meshes, mesh_key, rig_meshes, save_meshes
from optics.mesh import Role
from rigs import Rig, Water


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path))
    return tmp_path


def test_meshes_survive_the_cache_exactly(aqua2, tmp_path):
    path = tmp_path / "deep" / "meshes.npz"
    save_meshes(path, aqua2.meshes)
    assert [entry.name for entry in path.parent.iterdir()] == ["meshes.npz"]
    for before, after in zip(aqua2.meshes, load_meshes(path), strict=True):
        assert (before.name, before.group, before.role) == (after.name, after.group, after.role)
        assert after.vertices_m.dtype == np.float64
        assert after.faces.dtype == np.int32
        np.testing.assert_array_equal(before.vertices_m, after.vertices_m)
        np.testing.assert_array_equal(before.faces, after.faces)


def test_a_hit_does_not_import_the_modelling_kernel(aqua2, cache):
    save_meshes(cache / f"{mesh_key(aqua2.rig)}.npz", aqua2.meshes)
    code = (
        "import sys; from cad.meshes import rig_meshes; from rigs import Rig;"
        "print(len(rig_meshes(Rig.load('aqua2'))), 'build123d' in sys.modules, 'trimesh' in sys.modules)"
    )
    found = subprocess.run(
        [sys.executable, "-c", code], env=dict(os.environ), capture_output=True, text=True, check=True
    )
    assert found.stdout.split() == [str(len(aqua2.meshes)), "False", "False"]


def test_a_damaged_file_is_made_again(aqua2, cache, monkeypatch):
    monkeypatch.setattr(module, "_build", lambda rig, stowed: aqua2.meshes)
    path = cache / f"{mesh_key(aqua2.rig)}.npz"
    path.write_bytes(b"PK\x03\x04 not an archive")
    assert len(rig_meshes(aqua2.rig)) == len(aqua2.meshes)
    assert len(load_meshes(path)) == len(aqua2.meshes)


def test_the_key_is_of_shapes_only(aqua2):
    rig, servos = aqua2.rig, aqua2.rig.servos
    key = mesh_key(rig)
    slow = servos.model_copy(update={"pan": servos.pan.model_copy(update={"speed_deg_per_s": 1.0})})
    black = rig.mount.model_copy(update={"colour": "black"})
    others = {"water": Water(jerlov_type="II")}, {"servos": slow}, {"mount": black}
    for same in ({"name": "other"}, {"description": "x"}, *others):
        assert mesh_key(rig.model_copy(update=same)) == key
    wide = servos.model_copy(update={"tilt": servos.tilt.model_copy(update={"shaft_offset_mm": 7.0})})
    thick = rig.mount.model_copy(update={"wall_mm": 5.0})
    for other in ({"servos": wide}, {"mount": thick}):
        assert mesh_key(rig.model_copy(update=other)) != key


def test_what_is_printed_has_the_mounts_colour(aqua2, cache):
    """The mount's parts and no others; whether they were in the cache or not."""
    mount = aqua2.rig.mount.model_copy(update={"colour": "black"})
    for _ in range(2):
        parts = rig_meshes(aqua2.rig.model_copy(update={"mount": mount}))
        assert {part.colour for part in parts if part.role is Role.MOUNT} == {"black"}
        assert {part.colour for part in parts if part.role is not Role.MOUNT} == {None}


def test_a_rig_without_mirrors_has_no_meshes(cache):
    with pytest.raises(ValueError, match="expected a rig with mirrors, got 'bench'"):
        rig_meshes(Rig.load("bench"))
