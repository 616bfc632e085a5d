"""What tests of several rooms share."""

from __future__ import annotations

import hashlib
import json
import os
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer.testing
from hypothesis import HealthCheck, settings
from xdist.scheduler import LoadFileScheduling

RECORDED = Path(__file__).parent / "recorded_results.json"
"""Version and fingerprint of small cases of each kind of result that the cache keeps."""

SHARING_FOLDERS = ("tests/cad/checks", "tests/cad/export")
"""Whose files share solids, checks and an export that take half a minute to make."""

# Dr.Jit's threads look for work all the time: two processes with two each take a third of the machine from each other.
# The processes that tests begin, and the notebooks', inherit the share.
WORKERS = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
if WORKERS > 1:
    os.environ.setdefault("MIRRORGAZE_THREADS", str(max(1, (os.cpu_count() or 1) // WORKERS)))

# How long an example takes says how busy the machine is, and the first one of a test compiles a kernel. CI
# draws the same examples every time, so that it fails for a change and not by chance; on a desk they are new each time.
settings.register_profile(
    "any machine",
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    derandomize=os.environ.get("CI") == "true",
)
settings.load_profile("any machine")


class Sharing(LoadFileScheduling):
    """A file's tests go to one process, which makes what they share once; so do those of a folder whose files share."""

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.split("::", maxsplit=1)[0]
        folder = file.rpartition("/")[0]
        return next((sharing for sharing in SHARING_FOLDERS if folder.startswith(sharing)), file)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadFileScheduling:
    return Sharing(config, log)


@pytest.fixture(scope="session", autouse=True)
def no_slicer():
    """Hides the slicer that this machine may have, which takes 20 s for a mount; tests of slicing name it."""
    rooms = ("cad.checks.printing.slicer", "cad.export.printing.plate_slices", "cad.export.printing.prints")
    with pytest.MonkeyPatch.context() as patch:
        for room in rooms:
            patch.setattr(f"{room}.slicer_path", lambda: None)
        yield


@pytest.fixture(scope="session", autouse=True)
def one_command_line():
    """Makes the command line and its forty commands once, and not for each of the hundreds of calls: 0.04 s each."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(typer.testing, "_get_command", cache(typer.testing._get_command))
        yield


@pytest.fixture(scope="module")
def rough_light():
    """Coarse light for commands, which know full and draft light alone, in tests of what does not depend on it.

    A robot's takes two seconds instead of fifteen. In the cache it has a key of its own.
    """
    from scenes.baking.light_quality import LightQuality

    with pytest.MonkeyPatch.context() as patch:
        for finer in ("full", "draft"):
            patch.setattr(LightQuality, finer, LightQuality.coarse)
        yield


def fingerprint(array):
    """Words as their digest; numbers as their size and some sums, weighted so that each one counts."""
    if array.dtype.kind == "U":
        return hashlib.sha256("\n".join(array.ravel()).encode()).hexdigest()[:16]
    values = np.asarray(array, dtype=np.float64).ravel()
    weights = np.cos(np.multiply.outer([0.0, 1.0, 2.0], np.arange(values.size)))
    return [values.size, float(np.abs(values).sum()), *(weights @ values).tolist()]


@pytest.fixture
def check_recorded():
    """Fails when a kept result has changed and its version has not: what is in caches would be stale.

    The result is right or wrong by other tests. When it has changed on purpose, raise the version and record what the
    failure prints in `recorded_results.json`.
    """

    def check(case, version, *, rel, **arrays):
        found = {"version": version} | {name: fingerprint(array) for name, array in arrays.items()}
        recorded = json.loads(RECORDED.read_text(encoding="utf-8")).get(case, {"version": None})
        told = f'raise the version, then record "{case}": {json.dumps(found)}'
        assert recorded["version"] == version, told
        assert recorded.keys() == found.keys(), told
        for name, numbers in found.items():
            if isinstance(numbers, list):
                size, scale, *sums = recorded[name]
                assert numbers[0] == size, told
                np.testing.assert_allclose(numbers[1:], [scale, *sums], rtol=0, atol=rel * scale, err_msg=told)
            else:
                assert numbers == recorded[name], told

    return check
