"""Work on workers: results, failures, deaths, and the end of everything with the process that asked for it."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from optics.workers import cluster
from optics.workers.cluster import SchedulerError
from optics.workers.run import LIVES, SET_ASIDE, all_ended, counted, open_workers, run_many
from tests.optics.workers.some_work import square

LONGEST_S = 600.0
"""What is at work after that was left behind: no machine is so slow that it only has not seen it yet."""

CHECKOUT = Path(__file__).parents[3]


def pieces(folder, count, kills=()):
    """Pieces 0 to count; those of `kills` end their worker when they are tried first."""
    folder.mkdir()
    return {str(number): (str(folder), number, number in kills) for number in range(count)}


@pytest.mark.parametrize(("workers", "kills"), [(1, ()), (2, range(3)), (4, (1, 2))])
def test_the_same_bytes_whatever_the_workers_and_who_dies(workers, kills, tmp_path):
    work = pieces(tmp_path / "out", 6, kills)
    ends = list(run_many(square, work, workers=workers))
    assert sorted((each.name, each.value, each.failure) for each in ends) == [(str(n), n * n, None) for n in range(6)]
    found = {file.name: file.read_bytes() for file in (tmp_path / "out").glob("*.square")}
    assert found == {f"{number}.square": str(number**2).encode() for number in range(6)}
    # What was killed was tried again. A kill may cost one piece more, done by that worker and not handed over yet; that
    # may be one that was killed before.
    tried = [len((tmp_path / f"out/{number}.tried").read_bytes()) for number in range(6)]
    assert all(times >= 2 for number, times in enumerate(tried) if number in kills)
    assert sum(tried) <= 6 + 2 * len(kills)


def test_what_fails_or_kills_does_not_keep_the_others(tmp_path):
    """One with a megabyte of message, one that ends three workers, and one that is well."""
    told: list[str] = []
    work = pieces(tmp_path / "out", 1) | {
        "raises": (str(tmp_path / "out"), -1, False),
        "kills": (str(tmp_path / "out"), -2, False),
    }
    failures = all_ended(run_many(square, work, workers=1), counted(told.append, 1, 4, "pieces"))
    assert set(failures) == {"raises", "kills"}
    assert failures["raises"].sentence.startswith("ValueError: xxx")
    assert "some_work.py" in failures["raises"].trace
    assert failures["kills"].sentence == f"3 {SET_ASIDE}"
    assert len((tmp_path / "out/-2.tried").read_bytes()) == LIVES
    assert told[0] == "1 of 4 pieces: done before"
    assert any(line.startswith("4 of 4 pieces: ") for line in told)
    assert any(line.endswith(f"kills, failed: 3 {SET_ASIDE}") for line in told)


def test_nothing_to_do():
    assert list(run_many(print, {}, workers=2)) == []


@pytest.mark.parametrize("address", ["nowhere", "http://127.0.0.1:8786", "tcp://127.0.0.1"])
def test_what_is_no_address_is_refused(address):
    with pytest.raises(ValueError, match="expected an address with a port"):
        list(run_many(print, {}, workers=1, scheduler=address))


def test_nobody_answers(monkeypatch):
    """A port that was free a moment ago."""
    monkeypatch.setattr(cluster, "ANSWER_S", 1)
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    with pytest.raises(SchedulerError, match=rf"tcp://127.0.0.1:{port}: no dask scheduler answers"):
        list(run_many(print, {"1": (1,)}, workers=1, scheduler=f"tcp://127.0.0.1:{port}"))


CLUSTER = """
import time
from optics.workers.cluster import own_cluster
if __name__ == "__main__":
    with own_cluster(1) as client:
        print(client.scheduler.address, flush=True)
        time.sleep(3600)
"""


def test_a_cluster_works_until_it_is_lost(tmp_path):
    """Of a cluster that somebody else has started, and is killed after two pieces of five; the rest is done here."""
    (tmp_path / "cluster.py").write_text(CLUSTER)
    path = os.environ | {"PYTHONPATH": str(CHECKOUT)}
    there = subprocess.Popen([sys.executable, tmp_path / "cluster.py"], env=path, stdout=subprocess.PIPE, text=True)
    address = there.stdout.readline().strip()
    work = pieces(tmp_path / "out", 5)
    with there, open_workers(workers=9, scheduler=address) as joined:
        ends = joined.run(square, work)
        done = [next(ends), next(ends)]
        there.kill()
        with pytest.raises(SchedulerError, match=f"{address}: the scheduler was lost"):
            done.extend(ends)
    assert all(each.failure is None for each in done)
    left = {name: piece for name, piece in work.items() if name not in {each.name for each in done}}
    assert left
    assert all(each.failure is None for each in run_many(square, left, workers=1))
    assert len(list((tmp_path / "out").glob("*.square"))) == 5


def parent_at_work(tmp_path):
    """A parent in a group of its own, and the files of its two processes, which hold their numbers."""
    (tmp_path / "main.py").write_text(
        "import signal\n"
        "from mirrorgaze.interrupts import exit_on_interrupt, stopping_says\n"
        "from tests.optics.workers.some_work import endless\n"
        "from optics.workers.run import run_many\n"
        "if __name__ == '__main__':\n"
        # As at a terminal: what a shell starts in the background, these tests say, inherits that Ctrl-C is ignored.
        "    signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "    exit_on_interrupt()\n"
        "    with stopping_says('stopped in the middle'):\n"
        f"        list(run_many(endless, {{str(n): ({str(tmp_path)!r}, n) for n in range(3)}}, workers=2))\n"
    )
    parent = subprocess.Popen(
        [sys.executable, "main.py"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(CHECKOUT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    began: list[Path] = []
    while len(began) < 2 or not all(file.read_text() for file in began):
        assert parent.poll() is None, parent.communicate()
        began = list(tmp_path.glob("*.began"))
        time.sleep(0.05)
    return parent, [int(file.read_text()) for file in began]


def is_running(number):
    try:
        return Path(f"/proc/{number}/stat").read_text().rsplit(") ", 1)[1][0] != "Z"
    except FileNotFoundError:
        return False


def wait_for_the_end(numbers):
    ended = time.monotonic() + LONGEST_S
    while any(map(is_running, numbers)) and time.monotonic() < ended:
        time.sleep(0.05)
    assert not [number for number in numbers if is_running(number)]


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks Linux which processes run")
@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGKILL], ids=["Ctrl-C", "killed"])
def test_its_end_is_that_of_all_it_started(by, tmp_path):
    """Ctrl-C goes to the whole group, as a terminal does it, and only the parent speaks; killed it cannot."""
    parent, numbers = parent_at_work(tmp_path)
    if by == signal.SIGINT:
        os.killpg(parent.pid, by)
    else:
        parent.kill()
    wait_for_the_end(numbers)
    said = parent.communicate()
    if by == signal.SIGINT:
        assert (parent.returncode, *said) == (130, "", "mirrorgaze: stopped in the middle\n")
