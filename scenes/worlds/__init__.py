"""Worlds: what there is around the robot."""

from scenes.worlds.catalogue import BUILT_IN, world_named
from scenes.worlds.world import World

__all__ = ["BUILT_IN", "World", "world_named"]
