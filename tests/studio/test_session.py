"""A rig file being changed: comments and bytes, undo, autosave, saving; no page, no browser."""

from pathlib import Path

import pytest

from rigs import Rig, RigError
from rigs.files import PRESETS
from studio.session import GESTURE_S, Session

COMMENT = "# nominal (d1 of figure 3)"


class Clock:
    """Seconds that pass when one says so."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def session(tmp_path, clock):
    return Session("aqua2", folder=tmp_path, clock=clock)


def test_begins_with_the_bytes_of_the_file(session):
    assert session.text == (PRESETS / "aqua2.toml").read_text()
    assert not session.recovered
    assert not session.can_undo


def test_a_change_keeps_comments_and_every_other_line(session):
    before = session.text
    rig = session.change({"fold_mirror.distance_mm": 101.5})
    assert rig.gaze.fold_mirror.distance_mm == 101.5
    changed = [
        (old, new) for old, new in zip(before.splitlines(), session.text.splitlines(), strict=True) if old != new
    ]
    assert len(changed) == 1
    assert COMMENT in changed[0][1]


def test_undo_and_redo_restore_the_bytes(session, clock):
    texts = [session.text]
    for width in (70.0, 75.0, 82.5):
        clock.now += 2 * GESTURE_S
        session.change({"gaze_mirror.width_mm": width})
        texts.append(session.text)
    for text in reversed(texts[:-1]):
        assert session.undo()
        assert session.text == text
        assert session.autosave.read_text() == text
    assert not session.undo()
    for text in texts[1:]:
        assert session.redo()
        assert session.text == text
    assert not session.redo()


def test_dragging_a_slider_is_one_step(session, clock):
    before = session.text
    for width in (71.0, 72.0, 73.0, 74.0):
        clock.now += GESTURE_S / 4
        session.change({"gaze_mirror.width_mm": width})
    session.change({"gaze_mirror.height_mm": 90.0})
    session.undo()
    assert session.rig.gaze.gaze_mirror.width_mm == 74.0
    session.undo()
    assert session.text == before


def test_a_change_that_makes_no_rig_changes_nothing(session):
    before = session.text
    with pytest.raises(RigError, match=r"gaze_mirror\.width_mm"):
        session.change({"gaze_mirror.width_mm": -5.0})
    assert session.text == before
    assert not session.can_undo


def test_the_next_session_goes_on_and_can_undo_to_the_file(session, tmp_path):
    before = session.text
    session.change({"gaze_mirror.width_mm": 66.0})
    after = session.text
    # Killed: nothing is closed.
    again = Session("aqua2", folder=tmp_path)
    assert again.recovered
    assert again.text == after
    again.undo()
    assert again.text == before


def test_an_autosaved_file_that_is_no_rig_is_left_out(session, tmp_path):
    session.autosave.write_text("name = ")
    again = Session("aqua2", folder=tmp_path)
    assert not again.recovered
    assert again.text == session.text


def test_saves_a_rig_file_with_its_comments(session, tmp_path):
    session.change({"gaze_mirror.width_mm": 66.0})
    file = session.save(tmp_path / "mine.toml")
    assert COMMENT in file.read_text()
    assert Rig.load(file) == session.rig
    with pytest.raises(FileNotFoundError, match="existing folder"):
        session.save(tmp_path / "nowhere" / "mine.toml")


def test_files_that_a_rig_names_are_found_from_every_folder(tmp_path):
    session = Session("glider", folder=tmp_path)
    assert session.rig.gaze.hull.file.samefile(PRESETS / "glider.ply")
    (tmp_path / "deep").mkdir()
    saved = Rig.load(session.save(tmp_path / "deep" / "mine.toml"))
    assert saved.gaze.hull.file.samefile(PRESETS / "glider.ply")


def test_a_rig_without_mirrors_is_refused(tmp_path):
    with pytest.raises(ValueError, match="rig with mirrors"):
        Session("bench", folder=tmp_path)


def test_a_users_file_is_kept_beside_it(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text((PRESETS / "aqua2.toml").read_text())
    session = Session(str(file))
    session.change({"gaze_mirror.width_mm": 66.0})
    assert session.autosave.parent == tmp_path
    assert file.read_text() == (PRESETS / "aqua2.toml").read_text()
    session.save(Path(file))
    assert Rig.load(file).gaze.gaze_mirror.width_mm == 66.0
    session.undo()
    session.back_to_file()
    assert session.rig.gaze.gaze_mirror.width_mm == 66.0


def test_nothing_is_left_of_a_session_that_changed_nothing(session):
    session.change({"gaze_mirror.width_mm": 66.0})
    session.close()
    assert session.autosave.is_file()
    session.undo()
    session.close()
    assert not session.autosave.exists()
