"""A process does the newest of what it is asked, the most urgent first, and one that ends is replaced."""

import queue
import subprocess
import sys
import time

import pytest

from studio.workers import Failed, Worker

SOON_S = 600.0


@pytest.fixture
def answers():
    return queue.Queue()


@pytest.fixture
def worker(answers):
    worker = Worker(("urgent", "rest"), lambda *answer: answers.put(answer))
    yield worker
    worker.close()


def test_newest_of_each_topic_and_the_urgent_first(worker, answers):
    worker.ask("rest", "time:sleep", 0.5)
    time.sleep(0.2)
    for number in (1, 2, 3):
        worker.ask("rest", "math:sqrt", number)
    worker.ask("urgent", "math:floor", 2.5)
    assert answers.get(timeout=SOON_S) == ("rest", None)
    assert answers.get(timeout=SOON_S) == ("urgent", 2)
    assert answers.get(timeout=SOON_S) == ("rest", 3**0.5)
    assert answers.empty()


def test_what_fails_is_a_sentence_and_a_mistake_of_ours_is_reported_with_its_traceback(answers, tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    worker = Worker(("rest",), lambda *answer: answers.put(answer))
    worker.ask("rest", "rigs.files:preset_path", "nothing-of-that-name")
    assert "expected a preset" in answers.get(timeout=SOON_S)[1].sentence
    assert not list(tmp_path.glob("mirrorgaze-*"))
    worker.ask("rest", "json:loads", "{")
    sentence = answers.get(timeout=SOON_S)[1].sentence
    (report,) = tmp_path.glob("mirrorgaze-*")
    assert sentence.startswith("this is a mistake of the program (JSONDecodeError: ")
    assert str(report) in sentence
    assert "Traceback" in report.read_text(encoding="utf-8")
    worker.close()


def test_a_process_that_ends_is_replaced(worker, answers):
    worker.ask("rest", "os:_exit", 3)
    _, answer = answers.get(timeout=SOON_S)
    assert answer == Failed("its process ended before it was done")
    worker.ask("rest", "math:sqrt", 4.0)
    assert answers.get(timeout=SOON_S) == ("rest", 2.0)


def test_work_that_has_begun_can_be_stopped(worker, answers):
    worker.ask("rest", "time:sleep", 1000)
    while worker._running is None:
        time.sleep(0.01)
    worker.stop_work("rest")
    assert answers.get(timeout=SOON_S)[1].stopped


BEGINS_WORK = """
import time
from studio.workers import Worker
worker = Worker(("rest",), print)
worker.ask("rest", "time:sleep", 1000)
while worker._running is None:
    time.sleep(0.01)
print("runs", flush=True)
time.sleep(1000)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the system's own way to end children with their parent")
def test_a_process_ends_with_a_studio_that_is_killed():
    """The pipe that both print to is closed when the last of them has ended."""
    with subprocess.Popen([sys.executable, "-c", BEGINS_WORK], stdout=subprocess.PIPE) as studio:
        assert studio.stdout.readline() == b"runs\n"
        studio.kill()
        assert studio.communicate(timeout=SOON_S)[0] == b""
