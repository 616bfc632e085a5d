"""Processes beside the page: each does one thing at a time, and of each topic only the newest of what is asked.

Frozen kernels do not bear scenes that other threads of their process make meanwhile, and building solids holds the
interpreter for seconds; so neither happens in the page's own process.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pkgutil import resolve_name
from typing import Any, Protocol

from optics.kernels.child_programs import end_with_parent
from optics.kernels.faults import sentence_of

JOIN_S = 5.0
"""How long a process that was told to end may take, before it is killed."""


@dataclass(frozen=True)
class Failed:
    """What went wrong with a piece of work, in a sentence; `stopped` when that was asked for."""

    sentence: str
    stopped: bool = False


class Asked(Protocol):
    """What the studio needs of a worker."""

    def ask(self, topic: str, work: str, *arguments: Any) -> None:
        """Do a piece of work; an older one of the topic that has not begun is dropped."""

    def stop_work(self, topic: str) -> None:
        """Drop the work of a topic, also when it has begun."""

    def close(self) -> None:
        """End."""


class Worker:
    """A process that does the newest of what is asked.

    Parameters
    ----------
    topics : tuple of str
        What can be asked for, the most urgent first.
    answered : callable
        Takes topic and result, or a `Failed`; called from a thread of its own.
    nice : int
        How much the process stands back behind others.
    """

    def __init__(self, topics: tuple[str, ...], answered: Callable[[str, Any], None], *, nice: int = 0) -> None:
        self._topics, self._answered, self._nice = topics, answered, nice
        self._pending: dict[str, tuple[str, tuple[Any, ...]]] = {}
        self._condition = threading.Condition()
        self._closed = False
        self._running: str | None = None
        self._stopped = False
        self._process: SpawnProcess | None = None
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def ask(self, topic: str, work: str, *arguments: Any) -> None:
        """Do a piece of work, a function such as "studio.views:see"; an older one that has not begun is dropped.

        By its name: the page's process does not load what the other needs for it.
        """
        with self._condition:
            self._pending[topic] = (work, arguments)
            self._condition.notify()

    def stop_work(self, topic: str) -> None:
        """Drop the work of a topic; when it has begun its process ends, and the next piece gets a fresh one."""
        with self._condition:
            self._pending.pop(topic, None)
            if self._running == topic and self._process is not None:
                self._stopped = True
                self._process.terminate()

    def close(self) -> None:
        """End the process."""
        with self._condition:
            self._closed = True
            self._condition.notify()
            process = self._process
        if process is not None:
            process.terminate()
        self._thread.join(JOIN_S)
        if process is not None and process.is_alive():
            process.kill()

    def _serve(self) -> None:
        pipe: Connection | None = None
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._pending or self._closed)
                if self._closed:
                    return
                topic = min(self._pending, key=self._topics.index)
                work, arguments = self._pending.pop(topic)
                if pipe is None or self._process is None or not self._process.is_alive():
                    pipe = self._start()
                self._running, self._stopped = topic, False
            try:
                pipe.send((work, arguments))
                answer = pipe.recv()
            except (EOFError, OSError):
                pipe, answer = None, None
            with self._condition:
                self._running = None
                if self._closed:
                    return
            if pipe is None:
                answer = Failed("its process ended before it was done", stopped=self._stopped)
            self._answered(topic, answer)

    def _start(self) -> Connection:
        context = get_context("spawn")
        ours, theirs = context.Pipe()
        self._process = context.Process(target=_work, args=(theirs, self._nice), daemon=True)
        self._process.start()
        theirs.close()
        return ours


def _work(pipe: Connection, nice: int) -> None:
    """Answer until the other end is closed."""
    # Ctrl-C at the terminal reaches all processes of a command; the page's ends the others.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
    os.nice(nice)
    while True:
        try:
            work, arguments = pipe.recv()
        except (EOFError, OSError):
            return
        pipe.send(_done(work, arguments))


def _done(work: str, arguments: tuple[Any, ...]) -> Any:
    try:
        return resolve_name(work)(*arguments)
    except Exception as error:
        return Failed(sentence_of(error))
