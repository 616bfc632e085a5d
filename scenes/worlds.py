"""Worlds: what there is around the robot, as triangles with a material for each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.materials import Material

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class World:
    """Surroundings in the world frame (x east, y north, z up, surface at z = 0).

    Attributes
    ----------
    name : str
    vertices_m : array, shape (n, 3)
    faces : array, shape (m, 3)
        Counter-clockwise seen from the water.
    material : array, shape (m,)
        `Material` of each face.
    """

    name: str
    vertices_m: FloatArray
    faces: NDArray[np.int32]
    material: NDArray[np.int32]


TANK_SIZE_M = (8.0, 8.0)
TANK_DEPTH_BELOW_ROBOT_M = 1.5
TILE_M = 0.25


def tank(depth_m: float) -> World:
    """Square basin with checkered walls and floor around a robot at `depth_m`; open above.

    The walls' tiles are 0.25 m; each wall has its own pair of greys or a coloured band, so that a picture tells where
    the camera looks: yellow ahead (+x), orange to the left (+y), grey behind, dark to the right.
    """
    half_x, half_y = TANK_SIZE_M[0] / 2, TANK_SIZE_M[1] / 2
    floor = -(depth_m + TANK_DEPTH_BELOW_ROBOT_M)
    up = np.array([0.0, 0.0, -floor])
    corners = [np.array([x, y, floor]) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    corners = [corner * [half_x, half_y, 1] for corner in corners]
    south_west, south_east, north_east, north_west = corners
    east, north = np.array([2 * half_x, 0.0, 0.0]), np.array([0.0, 2 * half_y, 0.0])
    sides = [
        (south_west, east, north, Material.TILE_WHITE, Material.TILE_GREY),
        (south_east, up, north, Material.TILE_WHITE, Material.TILE_YELLOW),
        (north_east, up, -east, Material.TILE_WHITE, Material.TILE_ORANGE),
        (north_west, up, -north, Material.TILE_WHITE, Material.TILE_GREY),
        (south_west, up, east, Material.TILE_WHITE, Material.TILE_BLACK),
    ]
    return _joined("tank", [_tiled(*side) for side in sides])


WORLDS: dict[str, Callable[[float], World]] = {"tank": tank}
"""Worlds by name; each is made for a robot at a depth."""


def _tiled(
    corner: FloatArray, first: FloatArray, second: FloatArray, even: Material, odd: Material
) -> tuple[FloatArray, NDArray[np.int32], NDArray[np.int32]]:
    """Checkered parallelogram; `first x second` points into the water."""
    counts = [max(1, round(float(np.linalg.norm(edge)) / TILE_M)) for edge in (first, second)]
    i, j = np.meshgrid(np.arange(counts[0] + 1), np.arange(counts[1] + 1), indexing="ij")
    vertices = corner + (i / counts[0])[..., np.newaxis] * first + (j / counts[1])[..., np.newaxis] * second
    index = (i * (counts[1] + 1) + j).astype(np.int32)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=2).reshape(-1, 3)
    checker = np.where((i + j)[:-1, :-1] % 2 == 0, int(even), int(odd)).astype(np.int32)
    return vertices.reshape(-1, 3), faces, np.repeat(checker.ravel(), 2)


def _joined(name: str, pieces: list[tuple[FloatArray, NDArray[np.int32], NDArray[np.int32]]]) -> World:
    offsets = np.cumsum([0] + [len(vertices) for vertices, _, _ in pieces[:-1]])
    return World(
        name=name,
        vertices_m=np.concatenate([vertices for vertices, _, _ in pieces]),
        faces=np.concatenate([faces + offset for (_, faces, _), offset in zip(pieces, offsets, strict=True)]).astype(
            np.int32
        ),
        material=np.concatenate([material for _, _, material in pieces]),
    )
