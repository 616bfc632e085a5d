"""A rig's meshes built in a process of their own, beside whatever else a view of the rig needs.

The modelling kernel, and what it leaves behind, take 0.4 GB; that process gives them back when it ends.
"""

from __future__ import annotations

import gc
import multiprocessing
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection

from optics.mesh import PartMesh

Build = Callable[[], Sequence[PartMesh]]

LOADED = {"build123d", "drjit"}
"""A process that has the modelling kernel builds as fast itself. One that has Dr.Jit may have its threads, of which a
copy of the process would have none."""

_BEGUN: dict[str, Connection] = {}
"""What is heard of the processes that build, by the key of the meshes."""


@contextmanager
def building(key: str, build: Build) -> Iterator[None]:
    """Build meshes in a copy of this process, to be asked for by their key (`built`); the context ends it.

    On Linux alone, and before any of `LOADED` is there: else there is no other process.
    """
    if sys.platform != "linux" or LOADED & sys.modules.keys():
        yield
        return
    context = multiprocessing.get_context("fork")
    ours, its = context.Pipe(duplex=False)
    process = context.Process(target=_build, args=(build, ours, its), daemon=True)
    process.start()
    its.close()
    _BEGUN[key] = ours
    try:
        yield
    finally:
        _BEGUN.pop(key, None)
        process.kill()
        process.join()
        ours.close()


def built(key: str) -> Sequence[PartMesh] | None:
    """Meshes that another process builds, waited for; None where there is none, or where it failed."""
    heard = _BEGUN.pop(key, None)
    with suppress(EOFError):
        return None if heard is None else heard.recv()
    return None


def _build(build: Build, ours: Connection, its: Connection) -> None:
    # An interrupt from the keyboard reaches both processes, and ends this one at once. Where the other one dies, nobody
    # reads any more, and this one ends when it has built.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    ours.close()
    # It ends before there is garbage worth collecting: looking for it takes a twentieth of its time.
    gc.disable()
    # What cannot be built is told by who is asked for it.
    with suppress(Exception):
        its.send(build())
    its.close()
