"""Work in processes: results, failures, deaths, and the end of everything at Ctrl-C."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from dives.ensembles.processes import Failure, run_in_processes

LONGEST_S = 600.0
"""What is at work after that was left behind: no machine is so slow that it only has not seen it yet."""

WORK = '''
"""What the processes do: each writes its number beside it, but for some."""

import os, signal, time
from pathlib import Path


def work(folder, number):
    if number == 3:
        raise ValueError("three is not wanted")
    if number == 4:
        os.kill(os.getpid(), signal.SIGKILL)
    if number == 5:
        raise RuntimeError("x" * 1_000_000)
    (Path(folder) / f"{number}.began").write_text(str(os.getpid()))
    if number >= 100:
        time.sleep(3600)
    (Path(folder) / str(number)).write_text(str(os.getpid()))
'''


@pytest.fixture
def work(tmp_path, monkeypatch):
    (tmp_path / "some_work.py").write_text(WORK)
    monkeypatch.syspath_prepend(tmp_path)
    import some_work

    yield some_work.work
    del sys.modules["some_work"]


def test_each_piece_is_done_once_in_a_process_of_its_own(work, tmp_path):
    told: list[tuple[str, Failure | None]] = []
    jobs = {str(number): (str(tmp_path), number) for number in range(3)}
    assert run_in_processes(work, jobs, workers=2, finished=lambda *ended: told.append(ended)) == {}
    assert sorted(told) == [("0", None), ("1", None), ("2", None)]
    processes = {(tmp_path / name).read_text() for name in jobs}
    assert len(processes) == 3
    assert str(os.getpid()) not in processes


def test_what_fails_or_dies_does_not_keep_the_others(work, tmp_path):
    """Killed is what a machine without memory does; a megabyte of message is more than a pipe holds at a time."""
    jobs = {str(number): (str(tmp_path), number) for number in (3, 4, 5, 6)}
    told: dict[str, Failure | None] = {}
    failures = run_in_processes(work, jobs, workers=2, finished=told.__setitem__)
    assert set(failures) == {"3", "4", "5"}
    assert failures["3"].sentence == "ValueError: three is not wanted"
    assert "some_work.py" in failures["3"].trace
    assert failures["4"].sentence == f"the process died with exit status -{int(signal.SIGKILL)}"
    assert failures["5"].sentence.startswith("RuntimeError: xxx")
    assert (tmp_path / "6").exists()
    assert told == failures | {"6": None}


def test_nothing_to_do():
    assert run_in_processes(print, {}, workers=2, finished=print) == {}


def parent_at_work(tmp_path):
    """A parent in a group of its own, and the files of its two processes, which hold their numbers."""
    (tmp_path / "some_work.py").write_text(WORK)
    (tmp_path / "main.py").write_text(
        "import signal\n"
        "import some_work\n"
        "from dives.ensembles.processes import run_in_processes\n"
        "if __name__ == '__main__':\n"
        # As at a terminal: what a shell starts in the background, these tests say, inherits that Ctrl-C is ignored.
        "    signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        f"    jobs = {{str(n): ({str(tmp_path)!r}, n) for n in (100, 101, 102)}}\n"
        "    try:\n"
        "        run_in_processes(some_work.work, jobs, workers=2, finished=print)\n"
        "    except KeyboardInterrupt:\n"
        "        print('stopped')\n"
    )
    parent = subprocess.Popen(
        [sys.executable, "main.py"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(Path.cwd())])},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    began = [tmp_path / "100.began", tmp_path / "101.began"]
    while not all(file.exists() and file.read_text() for file in began):
        assert parent.poll() is None, parent.communicate()
        time.sleep(0.05)
    return parent, began


def is_running(number):
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    return Path(f"/proc/{number}/stat").read_text().rsplit(") ", 1)[1][0] != "Z"


@pytest.mark.skipif(os.name != "posix", reason="signals to a group of processes")
def test_ctrl_c_ends_all_of_it_quietly(tmp_path):
    """As a terminal does it: the signal goes to the whole group. Nothing is left, and only the parent speaks."""
    parent, began = parent_at_work(tmp_path)
    os.killpg(parent.pid, signal.SIGINT)
    out, err = parent.communicate()
    assert (out, err) == ("stopped\n", "")
    assert not (tmp_path / "102.began").exists()
    for file in began:
        with pytest.raises(ProcessLookupError):
            os.kill(int(file.read_text()), 0)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks Linux which processes run")
def test_killed_it_leaves_nothing_at_work(tmp_path):
    """The parent has no time to end anything; what it started sees that it is gone."""
    parent, began = parent_at_work(tmp_path)
    parent.kill()
    # Not for the end of its output, which its processes hold open as long as they live.
    assert parent.wait() == -signal.SIGKILL
    ended = time.monotonic() + LONGEST_S
    while any(is_running(int(file.read_text())) for file in began) and time.monotonic() < ended:
        time.sleep(0.05)
    assert not [file.name for file in began if is_running(int(file.read_text()))]
    parent.communicate()
