"""The export as a whole: its folder, its manifest, its bytes, and what happens when it fails."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

from cad.export import mount
from cad.export.mount import export_mount
from rigs import Rig

AGAIN = """
import sys
from pathlib import Path
from cad.assembly.assembly import build_assembly
from cad.export.mount import export_mount
from rigs import Rig
export_mount(build_assembly(Rig.load("aqua2")), Path(sys.argv[1]), log=lambda line: None)
"""


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_the_folder_holds_what_is_returned_and_nothing_else(exported):
    assert exported.files == sorted(path for path in exported.folder.rglob("*") if path.is_file())
    assert list(exported.folder.parent.iterdir()) == [exported.folder]
    assert all(line.startswith("export: ") for line in exported.progress)


def test_the_manifest_has_the_hash_of_every_file_and_the_rig(exported):
    manifest = json.loads((exported.folder / "manifest.json").read_text(encoding="utf-8"))
    others = {path.relative_to(exported.folder).as_posix(): path for path in exported.files}
    del others["manifest.json"]
    assert manifest["files"].keys() == others.keys()
    for name, path in others.items():
        assert manifest["files"][name]["sha256"] == digest(path), name
    assert manifest["rig"]["text"] == (exported.folder / "rig.toml").read_text(encoding="utf-8")
    assert manifest["rig"]["sha256"] == hashlib.sha256(manifest["rig"]["text"].encode()).hexdigest()
    assert manifest["versions"]["mirrorgaze"]


def test_the_rig_s_text_is_the_rig(exported):
    assert Rig.load(exported.folder / "rig.toml") == exported.assembly.rig


@pytest.mark.slow
def test_another_process_writes_the_same_bytes(exported, tmp_path):
    """Addresses, random identifiers, dates and the order of sets differ between processes."""
    folder = tmp_path / "again"
    subprocess.run([sys.executable, "-c", AGAIN, str(folder)], check=True)
    for path in exported.files:
        # By digests: where megabytes differ, the test's report would look for the difference without end.
        assert digest(path) == digest(folder / path.relative_to(exported.folder)), path.name


def test_nothing_is_left_of_an_export_that_failed(exported, tmp_path, monkeypatch):
    """It fails after the first files; a folder that was there before is as it was."""
    (tmp_path / "mount").mkdir()
    (tmp_path / "mount" / "manifest.json").write_text("older")

    def full_disk(*_):
        raise OSError("no space left")

    monkeypatch.setattr(mount, "write_bill_of_materials", full_disk)
    with pytest.raises(OSError, match="no space left"):
        export_mount(exported.assembly, tmp_path / "mount", log=lambda line: None)
    assert [path.name for path in tmp_path.rglob("*")] == ["mount", "manifest.json"]
    assert (tmp_path / "mount" / "manifest.json").read_text() == "older"
