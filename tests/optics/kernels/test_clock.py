"""The clock of a command: every second is counted once, and what took long is known the next time."""

import json
import subprocess
import sys
import time

import pytest

from optics.kernels import clock as clock_module
from optics.kernels.clock import IMPORTS, REST, TIMES_FILE, Clock, Pace, duration, kept_times, last_time


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path))
    return tmp_path


@pytest.fixture
def seconds(monkeypatch):
    """A time that stands still until somebody waits."""

    class Seconds:
        now = 100.0

        def wait(self, seconds):
            self.now += seconds

    made = Seconds()
    monkeypatch.setattr(clock_module.time, "perf_counter", lambda: made.now)
    monkeypatch.setattr(clock_module.time, "process_time", lambda: 1.5)
    return made


def test_every_second_is_counted_once(seconds):
    """1.5 s before the clock was there, 0.5 s of imports, and parts that interrupt each other."""
    clock = Clock()
    clock.restart()
    seconds.wait(0.5)
    clock.begin("light")
    seconds.wait(3)
    with clock.inside("light on the world"):
        seconds.wait(40)
    seconds.wait(1)
    clock.begin("frame")
    seconds.wait(5)
    clock.told_apart(4.5, "compile")
    clock.begin(None)
    seconds.wait(2)
    whole, parts = clock.waited()
    assert parts == {IMPORTS: 2, "light": 4, "light on the world": 40, "frame": 0.5, "compile": 4.5, REST: 2}
    assert whole == sum(parts.values()) == 53
    # A half second of 53 is told with the rest.
    told = "imports 2.0 s, light 4.0 s, light on the world 40 s, compile 4.5 s, rest 2.5 s"
    assert clock.sentence() == f"waited 53 s: {told}"


def test_a_part_that_fails_has_ended(seconds):
    clock = Clock()
    with pytest.raises(RuntimeError), clock.inside("slice"):
        seconds.wait(2)
        raise RuntimeError
    seconds.wait(1)
    assert clock.waited()[1] == {IMPORTS: 2.5, "slice": 2, REST: 0}


def test_parts_of_one_kind_of_work_are_one_in_the_sum(seconds):
    clock = Clock()
    for name in ("checks: solids", "export: drawings", "checks: slicer"):
        clock.begin(name)
        seconds.wait(10)
    assert clock.sentence() == "waited 32 s: imports 1.5 s, checks 20 s, export 10 s"


def test_a_command_that_told_nothing_says_nothing(seconds):
    clock = Clock()
    clock.restart()
    seconds.wait(1)
    assert clock.sentence() == ""
    clock.restart()
    assert clock.waited() == (0, {REST: 0})


def test_what_took_long_is_known_the_next_time(seconds, folder):
    clock = Clock()
    clock.begin("views")
    seconds.wait(250)
    clock.begin("report")
    seconds.wait(0.1)
    assert last_time("views") == ""
    clock.keep()
    assert last_time("views") == " (4 min 10 s the last time)"
    assert last_time("report") == ""
    assert set(json.loads((folder / TIMES_FILE).read_text())) == {IMPORTS, "views"}


@pytest.mark.parametrize("content", [b"[1]", b'{"views": "long"}', b"\xff", b"{", b'{"views": NaN}', b"[" * 100_000])
def test_times_that_cannot_be_read_are_not_known(folder, content):
    (folder / TIMES_FILE).write_bytes(content)
    assert kept_times() == {}


def test_the_rest_is_told_by_the_pace_since_the_first_report(seconds):
    """Going on from frame 500: 10 more in 2 s, 480 to do. The 500 were another day's."""
    pace = Pace()
    assert pace.to_go(510, 1000) == ""
    seconds.wait(2)
    assert pace.to_go(520, 1000) == ", 96 s to go"
    seconds.wait(96)
    assert pace.to_go(1000, 1000) == ""


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.04, "0.0 s"), (9.94, "9.9 s"), (9.96, "10 s"), (119.4, "119 s"), (120, "2 min 0 s"), (7500, "2 h 5 min")],
)
def test_durations_are_said_as_people_do(seconds, words):
    assert duration(seconds) == words


def test_imports_are_counted_from_the_beginning_of_the_process():
    """A child that computes for a while before it loads the clock."""
    busy = "import time\nwhile time.process_time() < 0.3: pass\nfrom optics.kernels.clock import CLOCK"
    code = f"{busy}\nCLOCK.restart()\nprint(CLOCK.waited()[1]['imports'])"
    start = time.perf_counter()
    child = subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.PIPE, text=True)
    assert 0.3 <= float(child.stdout) <= time.perf_counter() - start
