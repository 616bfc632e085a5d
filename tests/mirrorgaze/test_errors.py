"""Bad input ends a command with a sentence and 2, failure with 1; our own mistakes keep their traceback."""

from __future__ import annotations

import errno
import importlib
import tomllib
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from mirrorgaze.errors import HOUSE, with_exit_status
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


def test_a_value_error_of_a_library_keeps_its_traceback():
    result = outcome(raised_by_a_library)
    assert result.exit_code == 1
    assert isinstance(result.exception, ValueError)


def test_our_packages_are_those_of_the_project():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8"))
    assert set(HOUSE) == set(project["tool"]["importlinter"]["root_packages"])
