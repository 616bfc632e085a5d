"""Many pieces of work, some at a time, on workers: one that fails or dies takes nothing with it."""

from __future__ import annotations

import os
import threading
import traceback
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from optics.kernels.clock import Pace
from optics.workers.cluster import (
    ADDRESS,
    THREADS_VARIABLE,
    PieceError,
    SchedulerError,
    joined_cluster,
    keep_up,
    own_cluster,
)

if TYPE_CHECKING:
    from distributed import Client, Future

LIVES = 3
"""Workers of ours that may die at a piece before it is set aside."""

SET_ASIDE = "workers died at it, so it is set aside; where memory was short, fewer at a time have more each"

LISTEN_S = 0.2
"""After which it is looked whether there are more workers now."""

_ONE_AT_A_TIME = threading.Lock()
"""A worker that was started with several threads gives them to one piece after the other."""


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


@dataclass(frozen=True, kw_only=True)
class Ended:
    """A piece of work that ended.

    Attributes
    ----------
    name : str
    value : object
        What it returned; None when it failed.
    failure : Failure or None
    """

    name: str
    value: Any
    failure: Failure | None

    def result(self) -> Any:
        """What it returned.

        Raises
        ------
        PieceError
            When it failed.
        """
        if self.failure is not None:
            raise PieceError(f"{self.name}: {self.failure.sentence}")
        return self.value


class Workers:
    """Processes that do pieces of work, as long as `open_workers` lasts."""

    def __init__(self, client: Client, *, workers: int | None, scheduler: str) -> None:
        self._client, self._workers, self._scheduler = client, workers, scheduler

    def run(self, function: Callable[..., Any], pieces: Mapping[str, tuple[Any, ...]]) -> Iterator[Ended]:
        """Do pieces of work; each is handed over as it ends, in no order.

        Parameters
        ----------
        function : callable
            What it returns comes back, so it should be small: what is large it writes down itself. A piece whose worker
            dies before that came back is done again on another, and goes on from what it finds written, or writes the
            same once more.
        pieces : mapping of str to tuple
            Its arguments, by the name of the piece.

        Yields
        ------
        Ended
            A piece that raised is not done again; one whose worker died `LIVES` times is set aside.

        Raises
        ------
        SchedulerError
            When the scheduler is lost.
        """
        import cloudpickle  # noqa: PLC0415

        waiting, left, deaths = deque(pieces), len(pieces), Counter[str]()
        working: dict[Future, str] = {}
        ends: SimpleQueue[Future] = SimpleQueue()
        while left:
            # No worker is given two: what dies with it is the piece that it was working on.
            for _ in range(min(len(waiting), self._count() - len(working))):
                name = waiting.popleft()
                future = self._client.submit(_done, cloudpickle.dumps((function, pieces[name])), pure=False)
                working[future] = name
                future.add_done_callback(ends.put)
            with suppress(Empty):
                future = ends.get(timeout=LISTEN_S)
                name = working.pop(future)
                ended = self._ended(name, future, deaths)
                if ended is None:
                    waiting.appendleft(name)
                else:
                    left -= 1
                    yield ended

    def _count(self) -> int:
        """Pieces at a time: workers come and go."""
        try:
            count: int = sum(self._client.nthreads().values())
        except OSError:
            raise self._lost() from None
        if self._workers and count < self._workers:
            keep_up(self._client.cluster, self._workers)
        return count

    def _lost(self) -> SchedulerError:
        return SchedulerError(
            f"{self._scheduler}: the scheduler was lost; what is written stays, and the same command goes on from there"
        )

    def _ended(self, name: str, future: Future, deaths: Counter[str]) -> Ended | None:
        """What became of a piece; None where its worker died and it is to be tried again."""
        try:
            value, failure = future.result()
        except Exception as error:
            # What the piece raised is not among these: that it returned (`_done`).
            if future.cancelled():
                raise self._lost() from None
            sentence = f"{type(error).__name__}: {error}"
            if type(error).__name__ == "KilledWorker":
                # A cluster of others has tried it again by itself, as often as it was told to.
                deaths[name] += getattr(error, "allowed_failures", 0) + 1
                if self._workers and deaths[name] < LIVES:
                    return None
                sentence = f"{deaths[name]} {SET_ASIDE}"
            return Ended(name=name, value=None, failure=Failure(sentence=sentence, trace=str(error)))
        return Ended(name=name, value=value, failure=failure)


@contextmanager
def open_workers(*, workers: int, scheduler: str | None = None) -> Iterator[Workers]:
    """Processes of this machine, or those of a dask cluster; they end with the block, those of a cluster stay.

    Parameters
    ----------
    workers : int
        How many processes of this machine; a cluster has its own number.
    scheduler : str, optional
        Address of a cluster's scheduler, such as ``tcp://10.0.0.1:8786``.

    Raises
    ------
    ValueError
        For no worker, or what is no address.
    SchedulerError
        When nobody answers there, or the cluster has another mirrorgaze.
    """
    _check(workers, scheduler)
    if scheduler is None:
        with own_cluster(workers) as client:
            yield Workers(client, workers=workers, scheduler="this machine")
    else:
        with joined_cluster(scheduler) as client:
            yield Workers(client, workers=None, scheduler=scheduler)


def run_many(
    function: Callable[..., Any],
    pieces: Mapping[str, tuple[Any, ...]],
    *,
    workers: int,
    scheduler: str | None = None,
) -> Iterator[Ended]:
    """Do pieces of work on workers that are there for them alone: `open_workers` and `Workers.run` in one."""
    _check(workers, scheduler)
    if pieces:
        with open_workers(workers=workers, scheduler=scheduler) as opened:
            yield from opened.run(function, pieces)


def all_ended(ends: Iterable[Ended], *told: Callable[[Ended], None]) -> dict[str, Failure]:
    """Wait for all pieces and tell of each as it ends; what went wrong, by name."""
    failures: dict[str, Failure] = {}
    for ended in ends:
        if ended.failure is not None:
            failures[ended.name] = ended.failure
        for tell in told:
            tell(ended)
    return failures


def counted(log: Callable[[str], None], done: int, total: int, what: str) -> Callable[[Ended], None]:
    """What to tell of each piece that ends: a line of how far it is and for how long still.

    `done` of the `total` were done before; `what` they are, such as dives.
    """
    if done:
        log(f"{done} of {total} {what}: done before")
    pace = Pace()
    pace.to_go(done, total)

    def tell(ended: Ended) -> None:
        nonlocal done
        done += 1
        said = "" if ended.failure is None else f", failed: {ended.failure.sentence}"
        log(f"{done} of {total} {what}{pace.to_go(done, total)}: {ended.name}{said}")

    return tell


def _check(workers: int, scheduler: str | None) -> None:
    if workers < 1:
        raise ValueError(f"expected one worker or more, got {workers}")
    if scheduler is not None and not ADDRESS.fullmatch(scheduler):
        raise ValueError(f"--scheduler {scheduler}: expected an address with a port, such as tcp://10.0.0.1:8786")


def _done(payload: bytes) -> tuple[Any, Failure | None]:
    """What a worker does with a piece; its function is loaded here, where what fails is told of the piece."""
    import cloudpickle  # noqa: PLC0415
    from distributed import get_worker  # noqa: PLC0415

    os.environ.setdefault(THREADS_VARIABLE, str(get_worker().state.nthreads))
    with _ONE_AT_A_TIME:
        try:
            function, arguments = cloudpickle.loads(payload)
            return function(*arguments), None
        except Exception as error:
            return None, Failure(sentence=f"{type(error).__name__}: {error}", trace=traceback.format_exc())
