"""What makes a stage of long work count as done before, and what does not."""

from __future__ import annotations

import io
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

import reports.progress as module
from cad.assembly.meshes import mesh_key
from cad.assembly.part_meshes import MESH_VERSION
from cad.checks.printing.slicer import SLICE_VERSION
from cad.export.drawings.manifest import rig_hash
from cad.hulls.hull_mesh_key import HULL_MESH_VERSION, hull_mesh_key
from optics.water.radiative_transfer.field import RADIANCE_VERSION
from reports.progress import Stages, today, work_key
from rigs import FileHull, Rig
from rigs.atomic_files import write_text
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


def made(text: str) -> tuple[str, list[Path]]:
    return text, []


def raised() -> tuple[str, list[Path]]:
    raise ValueError("nothing is written on bad input")


KILLED = """
import os, signal, sys
from pathlib import Path
from reports.progress import Stages
from rigs import Rig
from rigs.atomic_files import atomic_file

folder = Path(sys.argv[1])

def work():
    if sys.argv[2] == "in a file":
        with atomic_file(folder / "poses.csv") as partial:
            partial.write_text("half")
            os.kill(os.getpid(), signal.SIGKILL)
    (folder / "poses.csv").write_text("whole")
    os.kill(os.getpid(), signal.SIGKILL)

if sys.argv[2] == "in the mark":
    os.fsync = lambda descriptor: os.kill(os.getpid(), signal.SIGKILL)
Stages.open(folder, Rig.load("bench"), print).run("poses", str, work)
"""


@pytest.mark.parametrize("where", ["in the mark", "in a file", "behind a file"])
def test_killed_in_the_first_stage_the_folder_is_gone_on_with(tmp_path, where):
    folder = tmp_path / "out"
    child = subprocess.run([sys.executable, "-c", KILLED, str(folder), where], check=False)
    assert child.returncode == -signal.SIGKILL
    stages = Stages.open(folder, Rig.load("bench"), print)
    assert stages.done == {}

    def work() -> tuple[str, list[Path]]:
        write_text(folder / "poses.csv", "whole")
        return "poses", [folder / "poses.csv"]

    stages.run("poses", str, work)
    assert sorted(path.name for path in folder.iterdir()) == [".stages.json", "poses.csv"]


@pytest.mark.parametrize("how", ["empty", "cut", "flipped", "no text", "null", "another table", "deep"])
def test_stages_that_cannot_be_read_are_made_again(tmp_path, how):
    rig = Rig.load("bench")
    Stages.open(tmp_path, rig, print).run("poses", str, lambda: made("first"))
    state = tmp_path / ".stages.json"
    whole = state.read_bytes()
    attacked = {
        "empty": b"",
        "cut": whole[: len(whole) // 2],
        "flipped": whole.replace(b"first", b"fjrst"),
        "no text": b"\xff\xfe",
        "null": b"null",
        "another table": b'{"key": 1}',
        "deep": b"[" * 100_000,
    }
    state.write_bytes(attacked[how])
    said: list[str] = []
    again = Stages.open(tmp_path, rig, said.append)
    assert said[0].startswith(f"{state}: cannot be read, so all stages are made again (")
    assert again.run("poses", str, lambda: made("second")) == "second"
    assert Stages.open(tmp_path, rig, said.append).run("poses", str, raised) == "second"


@pytest.mark.parametrize("new", [True, False])
def test_a_first_stage_that_fails_leaves_nothing(tmp_path, new):
    folder = tmp_path / "out"
    if not new:
        folder.mkdir()
    with pytest.raises(ValueError, match="bad input"):
        Stages.open(folder, Rig.load("bench"), print).run("poses", str, raised)
    assert [path.name for path in tmp_path.rglob("*")] == ([] if new else ["out"])


def test_a_folder_of_something_else_is_refused(tmp_path):
    (tmp_path / "diary.txt").write_text("mine")
    with pytest.raises(FileExistsError, match="expected a new folder, an empty one or that of an earlier run"):
        Stages.open(tmp_path, Rig.load("bench"), print)
