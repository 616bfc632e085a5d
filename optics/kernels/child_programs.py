"""Other programs and processes that we start: they end when we do."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from multiprocessing import parent_process

PR_SET_PDEATHSIG = 1
ENDS_WITH_US = (
    ()
    if sys.platform != "linux"
    else (
        *(sys.executable, "-I", "-S", "-c"),
        f"import ctypes, os, sys; ctypes.CDLL(None).prctl({PR_SET_PDEATHSIG}, {int(signal.SIGKILL)}); "
        "os.execv(sys.argv[1], sys.argv[1:])",
    )
)
"""Said before a program's path and arguments: the system ends it when we end, also where we are killed."""


def end_with_parent() -> None:
    """Let the system end this process of multiprocessing with the thread that began it, also where that is killed."""
    parent = parent_process()
    if sys.platform == "linux" and parent is not None:
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, int(signal.SIGKILL))
        if os.getppid() != parent.pid:
            # It ended before the system knew.
            os._exit(1)
