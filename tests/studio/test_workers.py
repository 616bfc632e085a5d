"""A process does the newest of what it is asked, the most urgent first, and one that ends is replaced."""

import queue
import time

import pytest

from studio.workers import Failed, Worker

SOON_S = 60.0


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


def test_what_fails_is_an_answer_and_a_process_that_ends_is_replaced(worker, answers):
    worker.ask("rest", "math:sqrt", -1.0)
    topic, answer = answers.get(timeout=SOON_S)
    assert (topic, answer) == ("rest", Failed("math domain error"))
    worker.ask("rest", "os:_exit", 3)
    topic, answer = answers.get(timeout=SOON_S)
    assert answer == Failed("its process ended before it was done")
    worker.ask("rest", "math:sqrt", 4.0)
    assert answers.get(timeout=SOON_S) == ("rest", 2.0)


def test_work_that_has_begun_can_be_stopped(worker, answers):
    worker.ask("rest", "time:sleep", 1000)
    while worker._running is None:
        time.sleep(0.01)
    worker.stop_work("rest")
    assert answers.get(timeout=SOON_S)[1].stopped
