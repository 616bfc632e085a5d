"""What tests of several rooms share."""

from __future__ import annotations

from typing import Any

import pytest
from xdist.scheduler import LoadFileScheduling

GATHERED: dict[str, Any] = {}

SHARING_FOLDERS = ("tests/cad/checks", "tests/cad/export")
"""Whose files share solids, checks and an export that take half a minute to make."""


class Sharing(LoadFileScheduling):
    """A file's tests go to one process, which makes what they share once; so do those of a folder whose files share."""

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.split("::", maxsplit=1)[0]
        folder = file.rpartition("/")[0]
        return folder if folder in SHARING_FOLDERS else file


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadFileScheduling:
    return Sharing(config, log)


@pytest.fixture(scope="module")
def rough_light():
    """Light between surfaces from 4 directions instead of 256, for tests of what does not hang on it.

    A robot's takes two seconds instead of fifteen. It never gets into the cache, which is for good light only.
    """
    from scenes import ambient, ambient_volume, robot_light, source_volume, water_shade, world_shade

    def gathered_once(mesh, light, name, make, *, places=()):
        key = f"{ambient._key(mesh, light, places)}-{name}"
        if key not in GATHERED:
            GATHERED[key] = make()
        return GATHERED[key]

    with pytest.MonkeyPatch.context() as patch:
        for module in (ambient, ambient_volume, source_volume, water_shade, world_shade):
            patch.setattr(module, "cached", gathered_once)
        patch.setattr(ambient, "LEAST_DIRECTIONS", 4)
        patch.setattr(ambient, "MOST_DIRECTIONS", 4)
        patch.setattr(robot_light, "LOOKS", 4)
        patch.setattr(source_volume, "MOST_POINTS", 6)
        patch.setattr(source_volume, "MOST_TURNS", 2)
        yield
