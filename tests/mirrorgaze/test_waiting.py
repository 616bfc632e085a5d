"""What the user of a command waited for."""

import pytest
import typer

from mirrorgaze.output import print_step
from mirrorgaze.waiting import with_clock
from optics.kernels.clock import Clock


@pytest.fixture(autouse=True)
def second_a_look(tmp_path, monkeypatch):
    """A clock that is a second further whenever somebody looks at it, and nothing known of other commands."""
    looked = iter(range(1000))
    monkeypatch.setattr("optics.kernels.clock.time.perf_counter", lambda: float(next(looked)))
    monkeypatch.setattr("optics.kernels.clock.time.process_time", lambda: 0.0)
    monkeypatch.setattr("optics.kernels.clock.CLOCK", Clock())
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path))


def test_what_is_waited_for_is_told_at_the_end_and_known_the_next_time(capsys):
    @with_clock
    def design():
        print_step("mount ...")
        print_step("  60 of 120 poses")
        print_step("views ...")

    design()
    lines = capsys.readouterr().err.splitlines()
    assert lines[:3] == ["mount ...", "  60 of 120 poses", "views ..."]
    assert lines[3] == "waited 3.0 s: imports 1.0 s, mount 1.0 s, views 1.0 s"
    design()
    assert capsys.readouterr().err.splitlines()[:2] == ["mount ... (1.0 s the last time)", "  60 of 120 poses"]


def test_a_result_that_is_not_good_was_waited_for_as_well(capsys):
    @with_clock
    def size():
        print_step("sizes ...")
        raise typer.Exit(1)

    with pytest.raises(typer.Exit):
        size()
    assert "sizes 1.0 s" in capsys.readouterr().err


def test_a_command_that_is_over_at_once_says_nothing(capsys):
    with_clock(lambda: None)()
    assert capsys.readouterr().err == ""
