"""Memory that is free, and that this process holds on to all the same."""

from __future__ import annotations

import ctypes
from contextlib import suppress

from optics.kernels.backend import dr


def give_memory_back() -> None:
    """Give back to the system what was freed: Dr.Jit keeps it for other kernels, and glibc for whoever asks next.

    For when much has been freed of which little will be needed again: to get it anew takes longer than to keep it.
    """
    dr.flush_malloc_cache()
    # Other C libraries than glibc have no such function.
    with suppress(AttributeError):
        ctypes.CDLL(None).malloc_trim(0)
