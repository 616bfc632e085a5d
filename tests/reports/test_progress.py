"""What makes a stage of long work count as done before, and what does not."""

from __future__ import annotations

import io

import numpy as np
import pytest
import trimesh

import reports.progress as module
from cad.assembly.meshes import MESH_VERSION, mesh_key
from cad.checks.printing.slicer import SLICE_VERSION
from cad.export.drawings.manifest import rig_hash
from cad.hulls.hull_mesh import HULL_MESH_VERSION, hull_mesh_key
from optics.water.radiative_transfer.field import RADIANCE_VERSION
from reports.progress import today, work_key
from rigs import FileHull, Rig
from scenes.baking.ambient import LIGHT_VERSION, light_key
from scenes.baking.light_quality import LightQuality
from scenes.light.light import underwater_light
from scenes.light.materials import Material
from scenes.stage.frame import Label
from scenes.stage.group_mesh import GroupMesh

TRIANGLE = GroupMesh(
    vertices_m=np.eye(3),
    faces=np.array([[0, 1, 2]], dtype=np.int32),
    material=np.array([Material.TILE_WHITE], dtype=np.int32),
    label=np.array([Label.WORLD], dtype=np.int32),
    instance=np.zeros(1, dtype=np.int32),
)


@pytest.fixture
def rig(tmp_path):
    """aqua2 on a box from a file."""
    file = tmp_path / "hull.stl"
    trimesh.creation.box(extents=(650, 260, 130)).export(file)
    return Rig.load("aqua2").with_gaze(hull=FileHull(shape="file", file=file, unit="mm"))


def test_work_is_done_anew_for_another_rig_hull_file_setting_or_version(rig, monkeypatch):
    before = work_key(rig, "coverage 1.0")
    assert work_key(rig, "coverage 1.0") == before
    assert work_key(rig, "coverage 2.0") != before
    assert work_key(rig.model_copy(update={"name": "other"}), "coverage 1.0") != before
    monkeypatch.setattr(module, "STAGES_VERSION", module.STAGES_VERSION + 1)
    assert work_key(rig, "coverage 1.0") != before
    monkeypatch.undo()
    trimesh.creation.box(extents=(650, 261, 130)).export(rig.gaze.hull.file)
    assert work_key(rig, "coverage 1.0") != before


def test_stages_count_every_version_of_what_is_kept():
    kept = RADIANCE_VERSION, HULL_MESH_VERSION, MESH_VERSION, SLICE_VERSION, LIGHT_VERSION
    assert module.physics_versions() == kept


def test_a_comment_makes_nothing_again(rig, monkeypatch):
    """No key reads a source file: what a comment says cannot be in it."""
    light = underwater_light(rig.water)
    opened, open_file = [], io.open

    def noted(file, *arguments, **settings):
        opened.append(str(file))
        return open_file(file, *arguments, **settings)

    monkeypatch.setattr(io, "open", noted)
    of_light = light_key("light", TRIANGLE, light, LightQuality.full())
    for key in (mesh_key(rig), hull_mesh_key(rig.gaze.hull), of_light, work_key(rig)):
        assert len(key) == 64
    assert str(rig.gaze.hull.file) in opened
    assert [file for file in opened if file.endswith(".py")] == []


def test_what_its_owner_calls_a_rig_makes_nothing_again(rig):
    named = rig.with_(revision="B")
    assert work_key(named) == work_key(rig)
    assert rig_hash(named) == rig_hash(rig)
    assert mesh_key(named) == mesh_key(rig)


def test_the_day_is_the_environment_s_where_it_says_one(monkeypatch):
    """1767225600 s after 1970 began 2026; a second before it was the year before."""
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1767225600")
    assert today() == "2026-01-01"
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1767225599")
    assert today() == "2025-12-31"
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    with pytest.raises(ValueError, match=r"SOURCE_DATE_EPOCH=yesterday: expected seconds since 1970"):
        today()
