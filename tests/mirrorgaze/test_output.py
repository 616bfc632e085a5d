"""What commands print while they work."""

import pytest

from mirrorgaze.output import print_progress
from optics.kernels import clock


@pytest.fixture(autouse=True)
def pace_of_one_a_second(monkeypatch):
    counted = iter(range(100_000))
    monkeypatch.setattr(clock.time, "perf_counter", lambda: float(next(counted)))


def test_a_file_gets_a_line_for_every_tenth(capsys):
    """Under pytest stderr is no terminal; 1800 images are ten lines, three images three."""
    for done in range(1, 1801):
        print_progress("bag", done, 1800)
    lines = capsys.readouterr().err.splitlines()
    assert [line.partition(",")[0] for line in lines] == [f"bag: {tenth} of 1800" for tenth in range(180, 1801, 180)]
    assert lines[4] == "bag: 900 of 1800, 15 min 0 s to go"
    for done in range(1, 4):
        print_progress("bag", done, 3)
    assert capsys.readouterr().err.splitlines() == ["bag: 1 of 3", "bag: 2 of 3, 1.0 s to go", "bag: 3 of 3"]


def test_a_terminal_gets_one_line(capsys, monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    for done in (1, 2, 3):
        print_progress("bag", done, 3)
    first, second, third = ("█" * filled + "░" * (20 - filled) for filled in (6, 13, 20))
    assert capsys.readouterr().err == (
        f"\r{first} bag: 1 of 3\x1b[K\r{second} bag: 2 of 3, 1.0 s to go\x1b[K\r{third} bag: 3 of 3\x1b[K\n"
    )
