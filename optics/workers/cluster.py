"""The processes that do the work: of this machine, or of a dask cluster that somebody else has started."""

from __future__ import annotations

import asyncio
import importlib.metadata
import logging
import os
import re
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

DISTRIBUTION = "mirrorgaze"

THREADS_VARIABLE = "MIRRORGAZE_THREADS"
"""As `optics.kernels.backend` reads it, which a worker loads with its first piece and not before."""

ADDRESS = re.compile(r"((tcp|tls|ws|wss|ucx)://)?[^/:\s]+:\d{1,5}|((tcp|tls)://)?\[[0-9a-fA-F:]+\]:\d{1,5}")
"""Of a scheduler, as dask has it."""

ANSWER_S = 10
"""How long a scheduler may take to answer."""

CLOSE_S = 1
"""And how long it may take to say goodbye."""

END_S = 10
"""How long processes of ours may take to end, of which each may be just starting."""

UNSAID = "ignore::UserWarning:multiprocessing.resource_tracker"

SETTINGS: dict[str, Any] = {
    # What is tried again waits for a free worker, not behind a piece that would be suspected with it.
    "distributed.scheduler.allowed-failures": 0,
    # A worker that is to come back may take long on a busy machine, and would be ended when it is there.
    "distributed.deploy.lost-worker-timeout": "1h",
    # What a worker holds is what its piece needs: there is nothing to write to disk, and waiting frees nothing.
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
}


class WorkersError(RuntimeError):
    """Workers cannot do what they were to do."""


class PieceError(WorkersError):
    """A piece of work failed that nothing can go on without."""


class SchedulerError(WorkersError):
    """The scheduler of a cluster is not there, or not one that can be worked with."""


@contextmanager
def own_cluster(workers: int) -> Iterator[Client]:
    """Processes of this machine, heard on its loopback alone; each has its share of the cores and of the memory."""
    import dask  # noqa: PLC0415
    from distributed import Client, LocalCluster  # noqa: PLC0415
    from distributed.system import MEMORY_LIMIT  # noqa: PLC0415

    _keep_quiet()
    threads = os.environ.get(THREADS_VARIABLE) or str(max(1, (os.cpu_count() or 1) // workers))
    with dask.config.set(SETTINGS):
        with _interrupts_held_back():
            cluster = LocalCluster(
                n_workers=0,
                threads_per_worker=1,
                host="127.0.0.1",
                dashboard_address=None,
                scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},  # or it asks for a port that others ask for
                silence_logs=logging.CRITICAL,
                memory_limit=MEMORY_LIMIT // workers,
                env={THREADS_VARIABLE: threads},
            )
        client = Client(cluster, set_as_default=False)
        try:
            cluster.scale(workers)
            yield client
        finally:
            _end(cluster, client)


def keep_up(cluster: LocalCluster, workers: int) -> None:
    """Start workers again that died just as they began: those their nannies miss."""
    cluster.loop.add_callback(_revive, cluster)
    cluster.scale(workers)


def _revive(cluster: LocalCluster) -> None:
    from distributed.core import Status  # noqa: PLC0415

    for name, nanny in list(cluster.workers.items()):
        if nanny.status in {Status.closed, Status.failed}:
            del cluster.workers[name]  # and another takes its place
        elif nanny.status == Status.running and nanny.process and nanny.process.status == Status.stopped:
            # It does nothing where the nanny has begun to.
            asyncio.ensure_future(nanny.instantiate())  # noqa: RUF006


@contextmanager
def joined_cluster(address: str) -> Iterator[Client]:
    """A cluster that is there already, and stays.

    Raises
    ------
    SchedulerError
        When nobody answers there, or its workers have another mirrorgaze.
    """
    import dask  # noqa: PLC0415
    from distributed import Client  # noqa: PLC0415

    _keep_quiet()
    with dask.config.set({"distributed.comm.timeouts.connect": ANSWER_S}):
        try:
            client = Client(address, timeout=ANSWER_S, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            raise SchedulerError(
                f"--scheduler {address}: no dask scheduler answers within {ANSWER_S} s ({error}); start one with "
                "`dask scheduler`, or leave the option out to work on this machine"
            ) from None
        try:
            _same_versions(address, client)
            yield client
        finally:
            client.close(timeout=CLOSE_S)


def _same_versions(address: str, client: Client) -> None:
    ours = importlib.metadata.version(DISTRIBUTION)
    found = client.run(importlib.metadata.version, DISTRIBUTION, on_error="return")
    for worker, theirs in found.items():
        if theirs != ours:
            said = f"none ({theirs})" if isinstance(theirs, Exception) else theirs
            raise SchedulerError(f"--scheduler {address}: expected mirrorgaze {ours} on worker {worker}, got {said}")


def _end(cluster: LocalCluster, client: Client) -> None:
    """End the processes at once, also those that are at work: what they finished is written."""
    for nanny in list(cluster.workers.values()):
        nanny.close_gracefully()  # or it starts another
        if nanny.pid is not None:
            with suppress(ProcessLookupError):
                os.kill(nanny.pid, signal.SIGKILL)
    # Whom this does not reach in time sees the end of this process, and ends with it.
    with suppress(TimeoutError):
        client.close(timeout=CLOSE_S)
    with suppress(TimeoutError):
        cluster.close(timeout=END_S)


def _keep_quiet() -> None:
    """What becomes of a piece we say ourselves, once; dask logs each end of a connection as well."""
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Let the threads and processes that begin here, and those that these begin, never hear of Ctrl-C: we end them.

    One that comes meanwhile is raised after the block.
    """
    # It starts with the first process, and would let signals through where it starts. What Ctrl-C leaves behind it
    # removes, of which nobody needs to hear.
    sys.warnoptions.append(UNSAID)
    resource_tracker.ensure_running()
    sys.warnoptions.remove(UNSAID)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
