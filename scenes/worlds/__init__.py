"""Worlds: what there is around the robot."""

from __future__ import annotations

from collections.abc import Callable

from scenes.worlds.tank import tank
from scenes.worlds.world import World

WORLDS: dict[str, Callable[[float], World]] = {"tank": tank}
"""Worlds by name; each is made for a robot at a depth."""

__all__ = ["WORLDS", "World"]
