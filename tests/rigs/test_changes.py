"""A rig changed by the names of its keys, and saved."""

import pytest

from rigs import Rig, RigError, preset_names, preset_path


def test_a_value_is_changed_by_its_place_in_the_file():
    rig = Rig.load("aqua2")
    wider = rig.with_(gaze_mirror__width_mm=90.0, water__jerlov_type="II")
    assert (wider.gaze.gaze_mirror.width_mm, wider.water.jerlov_type) == (90.0, "II")
    assert rig.gaze.gaze_mirror.width_mm == 80.0
    assert wider.with_(gaze_mirror__width_mm=80.0, water__jerlov_type=rig.water.jerlov_type) == rig


def test_a_table_comes_whole_and_goes_with_none():
    rig = Rig.load("aqua2").with_(requirements={"mount_mass_g": 500.0})
    assert rig.requirements.mount_mass_g == 500.0
    assert rig.with_(requirements=None).requirements is None


def test_what_cannot_be_is_refused_with_every_problem():
    with pytest.raises(RigError) as refused:
        Rig.load("aqua2").with_(gaze_mirror__width_mm=-5.0, camera__width_px="many", gaze_mirror__widht_mm=3.0)
    assert {problem.place for problem in refused.value.problems} == {
        "gaze_mirror.width_mm",
        "camera.width_px",
        "gaze_mirror.widht_mm",
    }
    with pytest.raises(ValueError, match="expected a table at 'name'"):
        Rig.load("aqua2").with_(name__first="a")


@pytest.mark.parametrize("name", preset_names())
def test_a_new_file_holds_the_same_rig(name, tmp_path):
    rig = Rig.load(name)
    assert Rig.load(rig.save(tmp_path / "rig.toml")) == rig


def test_saving_changes_what_differs_and_nothing_else(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(preset_path("aqua2").read_text(encoding="utf-8"), encoding="utf-8")
    before = path.read_text(encoding="utf-8").splitlines()
    rig = Rig.load(path)
    rig.save(path)
    assert path.read_text(encoding="utf-8").splitlines() == before
    rig.with_(gaze_mirror__width_mm=91.5).save(path)
    after = path.read_text(encoding="utf-8").splitlines()
    changed = [(old, new) for old, new in zip(before, after, strict=True) if old != new]
    assert [new.partition("#")[0].strip() for _, new in changed] == ["width_mm = 91.5"]
    assert changed[0][1].partition("#")[2] == changed[0][0].partition("#")[2] != ""
    assert Rig.load(path) == rig.with_(gaze_mirror__width_mm=91.5)


def test_saving_over_something_else_is_refused_and_leaves_it(tmp_path):
    path = tmp_path / "notes.toml"
    path.write_text("a = 1\n", encoding="utf-8")
    with pytest.raises(RigError):
        Rig.load("aqua2").save(path)
    assert path.read_text(encoding="utf-8") == "a = 1\n"
