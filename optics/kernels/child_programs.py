"""Other programs that we start: they end when we do."""

from __future__ import annotations

import signal
import sys

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
