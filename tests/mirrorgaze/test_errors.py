"""Bad input ends a command with a sentence and 2, failure with 1; our own mistakes are told with a file to send."""

from __future__ import annotations

import errno
import importlib
import tempfile
import tomllib
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from mirrorgaze.errors import with_exit_status
from optics.kernels.faults import HOUSE
from rigs import Rig


def outcome(command):
    application = typer.Typer(rich_markup_mode=None)
    application.command()(with_exit_status(command))
    return CliRunner().invoke(application, [])


def raised_by_us():
    Rig.load("nothing-of-that-name")


def raised_by_a_library():
    int("seven")


def test_bad_input_is_a_sentence_and_2():
    result = outcome(raised_by_us)
    assert result.exit_code == 2
    assert result.stderr.startswith("mirrorgaze: rig 'nothing-of-that-name': expected a preset")
    assert result.stdout == ""


@pytest.mark.parametrize("kind", [FileNotFoundError, FileExistsError, IsADirectoryError, PermissionError])
def test_a_wrong_path_is_named(kind):
    def command():
        raise kind(errno.EPERM, "not like this", "rig.toml")

    result = outcome(command)
    assert (result.exit_code, result.stderr) == (2, "mirrorgaze: rig.toml: not like this\n")


def test_a_full_disk_is_a_failure():
    def command():
        raise OSError(errno.ENOSPC, "No space left on device", "out.toml")

    result = outcome(command)
    assert (result.exit_code, result.stderr) == (1, "mirrorgaze: out.toml: No space left on device\n")


def test_a_missing_backend_is_a_failure():
    backend = importlib.import_module("optics.kernels.backend")

    def command():
        raise backend.BackendError("no LLVM")

    result = outcome(command)
    assert (result.exit_code, result.stderr) == (1, "mirrorgaze: no LLVM\n")


@pytest.mark.parametrize("error", [EOFError, RecursionError, KeyError, AssertionError, StopIteration])
def test_a_mistake_of_ours_is_a_sentence_and_a_file_to_send(error, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    def command():
        raise error("deep inside")

    result = outcome(command)
    (report,) = tmp_path.iterdir()
    assert result.exit_code == 1
    assert result.stderr.count("\n") == 1
    assert f"mirrorgaze: this is a mistake of the program ({error.__name__}: " in result.stderr
    assert f"please report it with {report}, which" in result.stderr
    written = report.read_text(encoding="utf-8")
    assert "Traceback" in written and "in command" in written and 'raise error("deep inside")' in written


def test_a_value_error_of_a_library_is_a_mistake_of_ours(monkeypatch):
    """Where no file can be written, what would be in it is told."""
    monkeypatch.setattr(tempfile, "tempdir", "/proc")
    result = outcome(raised_by_a_library)
    assert result.exit_code == 1
    assert result.stderr.startswith("mirrorgaze: this is a mistake of the program (ValueError: ")
    assert "in raised_by_a_library" in result.stderr


NO_MISTAKES = {
    "interrupted": (KeyboardInterrupt(), 130, "mirrorgaze: stopped\n"),
    "memory": (MemoryError(), 1, "mirrorgaze: there is not enough memory; "),
    "library": (ImportError("failed to map segment"), 1, "mirrorgaze: a library cannot be loaded (failed to map"),
    "encoding": (
        UnicodeDecodeError("utf-8", b"ab\xff", 2, 3, "invalid"),
        2,
        "mirrorgaze: expected text in UTF-8, got byte 0xff at byte 2",
    ),
    "name": (OSError(errno.ENAMETOOLONG, "File name too long", "x"), 2, "mirrorgaze: x: File name too long"),
}


@pytest.mark.parametrize(("error", "status", "sentence"), NO_MISTAKES.values(), ids=NO_MISTAKES)
def test_what_is_no_mistake_of_ours_is_a_sentence(error, status, sentence):
    def command():
        raise error

    result = outcome(command)
    assert result.exit_code == status
    assert result.stderr.startswith(sentence)


def test_a_working_folder_that_is_gone_is_told(tmp_path, monkeypatch):
    folder = tmp_path / "gone"
    folder.mkdir()
    monkeypatch.chdir(folder)
    folder.rmdir()
    result = outcome(lambda: Path("rig.toml").resolve())
    assert (result.exit_code, result.stderr.partition(";")[0]) == (
        2,
        "mirrorgaze: the working folder was deleted or moved",
    )


def test_our_packages_are_those_of_the_project():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8"))
    assert set(HOUSE) == set(project["tool"]["importlinter"]["root_packages"])
