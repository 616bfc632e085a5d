"""Work in processes of its own: one that dies takes nothing with it, and all end with Ctrl-C."""

from __future__ import annotations

import os
import signal
import threading
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from multiprocessing import connection, get_context, parent_process
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Any

from optics.kernels.clock import Pace

TIMEOUT_S = 10.0
"""How long a process that was told to end may take, before it is killed."""


@dataclass(frozen=True, kw_only=True)
class Failure:
    """What went wrong with one piece of work.

    Attributes
    ----------
    sentence : str
    trace : str
        The traceback; empty when the process died without one.
    """

    sentence: str
    trace: str


@dataclass(frozen=True)
class _Running:
    name: str
    process: SpawnProcess


def run_in_processes(
    work: Callable[..., None],
    jobs: Mapping[str, tuple[Any, ...]],
    *,
    workers: int,
    finished: Callable[[str, Failure | None], None],
) -> dict[str, Failure]:
    """Do many pieces of work, some at a time, each in a fresh process; a failure does not keep the others.

    A process for each piece costs its imports, some seconds, and gives each its own memory: a compiler that aborts or a
    machine that runs out of memory ends one of them.

    Parameters
    ----------
    work : callable
        Of a module's top level, since a fresh process imports it. What it finds it writes down itself.
    jobs : mapping of str to tuple
        Its arguments, by name.
    workers : int
        How many run at a time.
    finished : callable
        Told of each as it ends: its name, and None or what went wrong.

    Returns
    -------
    dict of str to Failure
        By name, those that failed.

    Raises
    ------
    KeyboardInterrupt
        After every process has ended.
    """
    context = get_context("spawn")
    waiting = list(jobs.items())
    running: dict[Connection, _Running] = {}
    failures: dict[str, Failure] = {}
    with _interrupts_raised():
        try:
            while waiting or running:
                while waiting and len(running) < workers:
                    name, arguments = waiting.pop(0)
                    reports, theirs = context.Pipe(duplex=False)
                    process = context.Process(target=_report, args=(theirs, work, arguments), daemon=True)
                    with _interrupts_ignored():
                        process.start()
                    theirs.close()
                    running[reports] = _Running(name, process)
                # A process reports, or its end of the pipe closes with it.
                ready = connection.wait(list(running))
                for reports in [known for known in running if known in ready]:
                    ended = running.pop(reports)
                    failure = _outcome(reports, ended.process)
                    if failure is not None:
                        failures[ended.name] = failure
                    finished(ended.name, failure)
        finally:
            _end(running)
    return failures


def counted(log: Callable[[str], None], done: int, total: int, what: str) -> Callable[[str, Failure | None], None]:
    """What `run_in_processes` tells of each that ends: a line of how far it is and for how long still.

    `done` of the `total` were done before; `what` they are, such as dives.
    """
    if done:
        log(f"{done} of {total} {what}: done before")
    pace = Pace()
    pace.to_go(done, total)

    def ended(name: str, failure: Failure | None) -> None:
        nonlocal done
        done += 1
        said = "" if failure is None else f", failed: {failure.sentence}"
        log(f"{done} of {total} {what}{pace.to_go(done, total)}: {name}{said}")

    return ended


def _report(reports: Connection, work: Callable[..., None], arguments: tuple[Any, ...]) -> None:
    """Body of a process: do the work, and say what went wrong."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        work(*arguments)
    except Exception as error:
        reports.send(Failure(sentence=f"{type(error).__name__}: {error}", trace=traceback.format_exc()))
    else:
        reports.send(None)
    finally:
        reports.close()


def _end_with_parent() -> None:
    """A parent that was killed cannot end its processes, and whoever starts it again would meet them at work."""
    parent = parent_process()
    assert parent is not None  # this runs in a process that was started here
    parent.join()
    os._exit(1)


def _outcome(reports: Connection, process: SpawnProcess) -> Failure | None:
    try:
        failure: Failure | None = reports.recv()
    except EOFError:
        process.join()
        failure = Failure(sentence=f"the process died with exit status {process.exitcode}", trace="")
    reports.close()
    process.join()
    process.close()
    return failure


def _end(running: Mapping[Connection, _Running]) -> None:
    """End what still runs; dives go on from their last frame the next time."""
    for left in running.values():
        left.process.terminate()
    for reports, left in running.items():
        left.process.join(TIMEOUT_S)
        if left.process.exitcode is None:
            left.process.kill()
            left.process.join()
        reports.close()
        left.process.close()


def _interrupts_ignored() -> AbstractContextManager[None]:
    """Let a process that starts inherit that Ctrl-C is none of its business: its parent ends it."""
    return _interrupts(signal.SIG_IGN)


def _interrupts_raised() -> AbstractContextManager[None]:
    """Let Ctrl-C be raised, here where nothing but waiting goes on, so that the processes are ended."""
    return _interrupts(signal.default_int_handler)


@contextmanager
def _interrupts(handler: Any) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
