"""Worlds by name or by the user's file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from optics.kernels.cache import load_or_make, result_key
from scenes.surfaces.surface import Surface
from scenes.worlds.blue import blue
from scenes.worlds.mesh_file import MESH_SUFFIXES, Thing, read_things
from scenes.worlds.mitsuba_file import MITSUBA_SUFFIX, read_mitsuba
from scenes.worlds.reef import REEF_VERSION, reef
from scenes.worlds.tank import tank
from scenes.worlds.world import World, packed_world, unpacked_world, world_of


def kept_reef(depth_m: float, seed: int) -> World:
    """Reef of a depth and seed (`scenes.worlds.reef`), from the cache when it can be: it takes two seconds to grow."""
    key = result_key("reef", REEF_VERSION, depth_m, seed)
    return load_or_make("world", key, lambda: reef(depth_m, seed), pack=packed_world, unpack=unpacked_world)


BUILT_IN: dict[str, Callable[[float, int], World]] = {
    "blue": lambda depth_m, seed: blue(),
    "reef": kept_reef,
    "tank": lambda depth_m, seed: tank(depth_m),
}
"""Worlds by name; each is made for a robot at a depth and from a seed."""

PLAUSIBLE_WORLD_M = (0.2, 2000.0)
"""Extent of a user's world, from a test plate to a bay."""


def world_named(name_or_path: str | Path, depth_m: float, seed: int = 0, *, unit: str = "m") -> World:
    """World by name, or from a mesh or Mitsuba scene file.

    A file's origin is put where the robot's origin is, at `depth_m` below the surface; its z is up (GLB and glTF: y is
    up, as their standard says) and its x points along the world's x, ahead of the robot.

    Parameters
    ----------
    name_or_path : str or Path
        tank, reef, blue, or a file that ends in .obj, .ply, .stl, .glb, .gltf or .xml.
    depth_m : float
        Of the robot.
    seed : int
        Of what is random in the world.
    unit : {"m", "mm", "inch"}
        Of a mesh file that does not say so itself.

    Raises
    ------
    ValueError
        For an unknown name, and for a file that cannot be used.
    """
    if str(name_or_path) in BUILT_IN:
        return BUILT_IN[str(name_or_path)](depth_m, seed)
    path = Path(name_or_path)
    suffix = path.suffix.lower()
    notes: tuple[str, ...] = ()
    if suffix in MESH_SUFFIXES:
        things = read_things(path, unit=unit, plausible_m=PLAUSIBLE_WORLD_M)
    elif suffix == MITSUBA_SUFFIX:
        things, notes = read_mitsuba(path)
    else:
        names, endings = ", ".join(sorted(BUILT_IN)), ", ".join((*MESH_SUFFIXES, MITSUBA_SUFFIX))
        raise ValueError(f"expected a world ({names}) or a file that ends in {endings}, got {str(name_or_path)!r}")
    return world_of(path.stem, [_below(thing, depth_m) for thing in things], notes)


def _below(thing: Thing, depth_m: float) -> Thing:
    name, each = thing
    vertices = each.vertices_m - np.array([0.0, 0.0, depth_m])
    return name, Surface(vertices_m=vertices, faces=each.faces, material=each.material, colour=each.colour)
