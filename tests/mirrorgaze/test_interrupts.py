"""Ctrl-C ends a command with 130 wherever it is: in imports, while a kernel is recorded, while a file is written."""

from __future__ import annotations

import subprocess
import sys

import pytest

BEGIN = """
import os, signal, sys, time
from pathlib import Path
from mirrorgaze.interrupts import exit_on_interrupt

def interrupted():
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(60)
"""

IMPORTS = """
class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == "mirrorgaze.cli":
            interrupted()

sys.meta_path.insert(0, Finder())
from mirrorgaze.__main__ import main
main()
"""

KERNEL = """
exit_on_interrupt()
from optics.kernels.backend import Float64, dr
calls = []

def body(x):
    if not calls:
        calls.append(0)
        interrupted()
    return (x + 1,)

dr.while_loop((dr.zeros(Float64, 4),), lambda x: x < 9, body)
"""

FILES = """
exit_on_interrupt()
from rigs.atomic_files import atomic_file, atomic_files
with atomic_file(Path("rig.toml")) as partial, atomic_files(Path("mount")) as scratch:
    partial.write_text("half")
    (scratch / "half").write_text("half")
    interrupted()
"""

CAUGHT = """
exit_on_interrupt()
try:
    interrupted()
except BaseException:
    print("nothing of ours may be raised in other people's code")
"""


@pytest.mark.parametrize("code", [IMPORTS, KERNEL, FILES, CAUGHT], ids=["imports", "kernel", "files", "caught"])
def test_ctrl_c_ends_a_command_wherever_it_is(tmp_path, code):
    child = subprocess.run(
        [sys.executable, "-c", BEGIN + code], cwd=tmp_path, capture_output=True, text=True, timeout=600, check=False
    )
    assert (child.returncode, child.stdout, child.stderr) == (130, "", "mirrorgaze: stopped\n")
    assert list(tmp_path.iterdir()) == []


def test_code_that_listens_itself_is_left_alone():
    code = (
        BEGIN
        + """
exit_on_interrupt()
from tracking.loop.offline import until_interrupted
with until_interrupted() as stopped:
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(0.2)
    print(stopped())
"""
    )
    child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=600, check=False)
    assert (child.returncode, child.stdout, child.stderr) == (0, "True\n", "")
