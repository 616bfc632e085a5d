"""A program that we have started ends with us."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

BEGINS_A_PROGRAM = """
import subprocess, sys
from optics.kernels.child_programs import ENDS_WITH_US
subprocess.run([*ENDS_WITH_US, sys.executable, "-c", "import time; print('runs', flush=True); time.sleep(1000)"])
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the system's own way to end children with their parent")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_a_program_ends_with_us_also_where_we_are_killed(how):
    """The pipe that it prints to is closed by its end alone: our own end of it went with us."""
    arguments = [sys.executable, "-c", BEGINS_A_PROGRAM]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as ours:
        assert ours.stdout is not None
        assert ours.stdout.readline() == b"runs\n"
        ours.send_signal(how)
        ours.wait()
        assert ours.stdout.read() == b""
