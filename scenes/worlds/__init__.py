"""Worlds: what there is around the robot."""

from __future__ import annotations

from collections.abc import Callable

from scenes.worlds.catalogue import BUILT_IN, world_named
from scenes.worlds.tank import tank
from scenes.worlds.world import World

WORLDS: dict[str, Callable[[float], World]] = {"tank": tank}
"""Worlds that the stage offers; `world_named` makes all of them."""

__all__ = ["BUILT_IN", "WORLDS", "World", "world_named"]
