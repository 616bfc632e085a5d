"""Benchmarks and commands in processes of their own, and what these took of the processor and of memory."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
CACHE, KERNELS = "MIRRORGAZE_CACHE", "DRJIT_CACHE_DIR"
"""Where results and compiled kernels are kept."""


@dataclass(frozen=True, kw_only=True)
class Finished:
    """What a process came to: its exit status, its processor time with that of its children, and what it said.

    The memory is the most that it, or a child, has held.
    """

    status: int
    processor_s: float
    memory_gb: float
    output: str
    said: str


def finished(arguments: Sequence[str], *, folder: Path, name: str, variables: Mapping[str, str]) -> Finished:
    """Run Python with arguments and wait for it; what it prints stays in NAME.stdout and NAME.stderr of its folder."""
    files = [folder / f"{name}.{stream}" for stream in ("stdout", "stderr")]
    with files[0].open("w") as output, files[1].open("w") as errors:
        process = subprocess.Popen(
            [sys.executable, *arguments],
            cwd=folder,
            env={**os.environ, **variables, "PYTHONPATH": str(ROOT)},
            stdout=output,
            stderr=errors,
        )
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    printed, said = (file.read_text(encoding="utf-8") for file in files)
    return Finished(
        status=process.returncode,
        processor_s=used.ru_utime + used.ru_stime,
        memory_gb=used.ru_maxrss / 1e6,
        output=printed,
        said=said,
    )


def measured(module: str) -> list[dict[str, Any]]:
    """Rows of a module's `run`, called in a process of its own."""
    with ProcessPoolExecutor(max_workers=1, mp_context=get_context("spawn")) as process:
        return process.submit(_rows, module).result()


def _rows(module: str) -> list[dict[str, Any]]:
    # Not in `__main__`: a new process does not find there what `python -m` has run.
    rows: list[dict[str, Any]] = importlib.import_module(module).run()
    return rows
