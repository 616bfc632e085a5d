"""How many threads compute while a program goes from kernel to kernel.

A thread that has nothing to do looks for work for about ten milliseconds, which takes a processor from others as work
does. Where Python has about as much to do between two kernels, all of that is lost: there the threads are ended, and
begun again for the next kernel, in less than a tenth of a millisecond.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from optics.kernels.backend import dr

_RESTING: list[int] = []
"""How many threads there were before they rested, innermost last."""


@contextmanager
def resting_threads() -> Iterator[None]:
    """One thread alone within it, but where others are woken."""
    _RESTING.append(dr.thread_count())
    dr.set_thread_count(1)
    try:
        yield
    finally:
        dr.set_thread_count(_RESTING.pop())


@contextmanager
def woken_threads() -> Iterator[None]:
    """Within it all threads that rest: for kernels, which have been computed at its end."""
    if not _RESTING:
        yield
        return
    before = dr.thread_count()
    dr.set_thread_count(_RESTING[-1])
    try:
        yield
        dr.sync_thread()
    finally:
        dr.set_thread_count(before)
