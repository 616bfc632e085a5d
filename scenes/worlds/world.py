"""What there is around the robot, as triangles with a material for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from scenes.surfaces.surface import Surface, joined


@dataclass(frozen=True, kw_only=True)
class World:
    """Surroundings in the world frame (x east, y north, z up, surface at z = 0).

    Attributes
    ----------
    name : str
    vertices_m : array, shape (n, 3)
    faces : array, shape (m, 3)
        Counter-clockwise seen from the water; none in open water.
    material : array, shape (m,)
        `Material` of each face.
    colour : array, shape (n, 3), float32
        Factors on the material's reflectance in the red, green and blue part of the spectrum
        (`scenes.light.materials.colour_basis`); ones: the material as it was measured.
    instance : array, shape (m,), int32
        Position in `instance_names` of the thing that each face belongs to.
    instance_names : tuple of str
        What can be told apart in a mask: a wall, a rock, a head of coral.
    notes : tuple of str
        What of a user's file is not used, one sentence each.
    """

    name: str
    vertices_m: FloatArray
    faces: NDArray[np.int32]
    material: NDArray[np.int32]
    colour: NDArray[np.float32]
    instance: NDArray[np.int32]
    instance_names: tuple[str, ...]
    notes: tuple[str, ...] = ()


def world_of(name: str, things: Sequence[tuple[str, Surface]], notes: tuple[str, ...] = ()) -> World:
    """World of named things, each an instance, in the given order."""
    whole = joined([each for _, each in things])
    sizes = [len(each.faces) for _, each in things]
    return World(
        name=name,
        vertices_m=whole.vertices_m,
        faces=whole.faces,
        material=whole.material,
        colour=whole.colour,
        instance=np.repeat(np.arange(len(things), dtype=np.int32), sizes),
        instance_names=tuple(thing for thing, _ in things),
        notes=notes,
    )


def packed_world(world: World) -> dict[str, NDArray[Any]]:
    """World as named arrays, to be kept."""
    return {field.name: np.array(getattr(world, field.name)) for field in fields(world) if field.name != "notes"}


def unpacked_world(arrays: Mapping[str, NDArray[Any]]) -> World:
    """World of what `packed_world` gives; it has no notes, which are of a user's file."""
    words: dict[str, Any] = {"name": str(arrays["name"]), "instance_names": tuple(arrays["instance_names"].tolist())}
    return World(**{**arrays, **words})
