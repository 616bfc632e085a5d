"""What tests of several rooms share."""

from __future__ import annotations

from typing import Any

import pytest

GATHERED: dict[str, Any] = {}


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
        patch.setattr(source_volume, "LOOKS", 16)
        patch.setattr(source_volume, "MOST_POINTS", 6)
        patch.setattr(source_volume, "MOST_TURNS", 0)
        yield
