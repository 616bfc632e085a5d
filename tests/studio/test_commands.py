"""Commands of the page: the lines that are shown are the ones that run; they end, fail and stop with a sentence."""

import queue
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app
from rigs.files import PRESETS
from studio.commands import Runner, share_done
from studio.lines import change_line, command_line, dive_words, search_words, size_words, view_line
from studio.results import ViewRequest
from studio.surroundings import Surroundings

SOON_S = 600.0


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(PRESETS.parents[1]))
    runner, ends = Runner(tmp_path), queue.Queue()

    def run(*words, stop=False):
        assert runner.run(words, ends.put)
        assert not runner.run(words, ends.put)
        if stop:
            runner.stop()
        return ends.get(timeout=SOON_S)

    return run


def test_a_command_says_what_it_did(run):
    end = run("gaze", "aqua2", "--q1-deg", "10", "--q2-deg", "5")
    assert end.good
    assert "azimuth" in "\n".join(end.lines)


def test_a_command_that_fails_says_why(run):
    end = run("gaze", "nothing")
    assert not end.good
    assert not end.stopped
    assert "expected a preset" in end.lines[-1]


def test_a_command_can_be_stopped(run):
    end = run("design", "aqua2", stop=True)
    assert end.stopped
    assert not end.good


def test_lines_tell_how_far_a_command_is():
    assert share_done("dive: 180 of 720, 12 s left") == 0.25
    assert share_done("figures ...") is None
    assert share_done("0 of 0") is None


@pytest.mark.parametrize(
    "words",
    [
        size_words("my.toml", "0.2", (-60.0, 60.0), (-30.0, 30.0)),
        search_words("my.toml", "out", 2000),
        search_words("my.toml", "out", 2000, 3),
        dive_words(Path("my.toml"), "out/dive", 15, Surroundings(world="reef")),
        shlex.split(
            view_line(
                "my.toml",
                ViewRequest(rig=None, surroundings=Surroundings(world="reef", water="1C"), q1_deg=-3.5, q2_deg=2.0),
            )
        )[1:],
    ],
    ids=lambda words: words[0],
)
def test_options_are_those_of_the_command_line(words):
    # Without a rig file, or a dive's, the options are read and the file is missed.
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 2
    assert "my.toml" in result.output
    assert "No such option" not in result.output


def test_python_of_a_change():
    assert (
        change_line({"camera.position_mm": [1.0, 2.0, 3.0]}) == "rig = rig.with_(camera__position_mm=[1.0, 2.0, 3.0])"
    )
    assert command_line(["size", "my rig.toml"]) == "mirrorgaze size 'my rig.toml'"
