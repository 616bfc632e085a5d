"""Rig files are found, read, and written without losing a comment."""

from __future__ import annotations

import pytest
import tomlkit

from rigs import Rig, RigError, load_document, preset_path, save_document

HULL = """[hull]
shape = "file"
file = "hull.step"
"""


def test_an_unknown_rig_is_said_with_the_presets():
    presets = r"rig 'aqua3': expected a preset \(aqua-shell, aqua2, bench, bluerov2, glider, torpedo\) or a TOML"
    with pytest.raises(FileNotFoundError, match=presets):
        Rig.load("aqua3")
    with pytest.raises(FileNotFoundError, match="did you mean 'aqua2'"):
        Rig.load("aqua")


def test_a_folder_is_not_a_rig(tmp_path):
    with pytest.raises(FileNotFoundError, match="expected a preset"):
        Rig.load(tmp_path)


def test_a_file_that_is_not_text_is_said(tmp_path):
    file = tmp_path / "rig.toml"
    file.write_bytes(b"name = \xff")
    with pytest.raises(RigError, match="byte 7: expected text in UTF-8"):
        Rig.load(file)


def test_comments_survive_loading_and_saving(tmp_path):
    original = preset_path("aqua2").read_text(encoding="utf-8")
    file = tmp_path / "rig.toml"
    document = load_document(preset_path("aqua2"))
    document["name"] = "reef"
    save_document(document, file)
    assert file.read_text(encoding="utf-8") == original.replace('name = "aqua2"', 'name = "reef"')
    assert Rig.load(file).name == "reef"


def test_a_save_that_fails_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    file = tmp_path / "rig.toml"
    file.write_text("old", encoding="utf-8")

    def fail(_document):
        raise OSError("no space left on device")

    monkeypatch.setattr(tomlkit, "dumps", fail)
    with pytest.raises(OSError, match="no space left"):
        save_document(tomlkit.document(), file)
    assert [path.name for path in tmp_path.iterdir()] == ["rig.toml"]
    assert file.read_text(encoding="utf-8") == "old"


@pytest.fixture
def own_hull(tmp_path):
    """A copy of aqua2 whose hull is a file beside it."""
    document = load_document(preset_path("aqua2"))
    document["hull"] = tomlkit.parse(HULL)["hull"]
    file = tmp_path / "rig.toml"
    save_document(document, file)
    return file


def test_a_hull_file_is_looked_for_beside_the_rig_file(own_hull):
    (own_hull.parent / "hull.step").touch()
    assert Rig.load(own_hull).gaze.hull.file == (own_hull.parent / "hull.step").resolve()


def test_a_missing_hull_file_is_said_with_the_other_problems(own_hull):
    text = own_hull.read_text(encoding="utf-8").replace("width_px = 640", "width_px = 0")
    own_hull.write_text(text, encoding="utf-8")
    with pytest.raises(RigError) as caught:
        Rig.load(own_hull)
    assert [problem.place for problem in caught.value.problems] == ["camera.width_px", "hull.file"]
    assert f"there is none at {own_hull.parent.resolve() / 'hull.step'}" in str(caught.value)


def test_a_hull_files_own_keys_are_checked(own_hull):
    text = own_hull.read_text(encoding="utf-8")
    (own_hull.parent / "hull.step").touch()
    (own_hull.parent / "hull.stl").touch()
    for said, words in (
        ('file = "hull.stl"\nunit = "km"', r"hull\.unit = 'km': expected 'mm', 'cm', 'm' or 'inch'"),
        ('file = "hull.stl"', r'hull: expected a unit, one of "mm", "cm", "m", "inch": a \.stl file does not say'),
        ('file = "hull.step"\nunit = "mm"', r'hull: expected no unit, got "mm": a \.step file says what'),
    ):
        own_hull.write_text(text.replace('file = "hull.step"', said), encoding="utf-8")
        with pytest.raises(RigError, match=words):
            Rig.load(own_hull)
