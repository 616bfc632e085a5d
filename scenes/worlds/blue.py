"""Open water far from everything: nothing to hit; what there is to see is the light, the target and the snow."""

from __future__ import annotations

from scenes.worlds.world import World, world_of


def blue() -> World:
    """World without faces."""
    return world_of("blue", [])
