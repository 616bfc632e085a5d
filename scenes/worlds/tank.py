"""Calibration basin: checkered walls that tell where the camera looks, and checkerboards with known corners."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from optics.kernels.arrays import FloatArray
from scenes.light.materials import Material
from scenes.surfaces.surface import Surface, surface
from scenes.worlds.checkerboard import Checkerboard
from scenes.worlds.world import World, world_of

TANK_SIZE_M = (8.0, 8.0)
TANK_DEPTH_BELOW_ROBOT_M = 1.5
TILE_M = 0.25

BOARD_COLUMNS, BOARD_ROWS, BOARD_SQUARE_M = 10, 7, 0.08
"""Squares of each board and their side: 0.96 x 0.72 m with the margin."""

BOARD_PLACES = {
    "board ahead": ((3.2, -1.3, -0.25), -22.0, 0.0),
    "board to the left": ((-0.6, 3.2, -0.3), 100.0, 12.0),
    "board on the floor": ((0.9, -2.0, -1.15), -65.0, -50.0),
}
"""Each board's middle from the robot (metres), azimuth and elevation at which it is looked at squarely (degrees)."""


def tank(depth_m: float) -> World:
    """Square basin with checkered walls and floor around a robot at `depth_m`; open above.

    The walls' tiles are 0.25 m; each wall has its own pair of greys or a coloured band, so that an image shows where
    the camera looks: yellow ahead (+x), orange to the left (+y), grey behind, dark to the right. Before the walls stand
    the boards of `tank_boards`.
    """
    half_x, half_y = TANK_SIZE_M[0] / 2, TANK_SIZE_M[1] / 2
    floor = -(depth_m + TANK_DEPTH_BELOW_ROBOT_M)
    up = np.array([0.0, 0.0, -floor])
    corners = [np.array([x, y, floor]) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    corners = [corner * [half_x, half_y, 1] for corner in corners]
    south_west, south_east, north_east, north_west = corners
    east, north = np.array([2 * half_x, 0.0, 0.0]), np.array([0.0, 2 * half_y, 0.0])
    sides = {
        "floor": (south_west, east, north, Material.TILE_WHITE, Material.TILE_GREY),
        "east wall": (south_east, up, north, Material.TILE_WHITE, Material.TILE_YELLOW),
        "north wall": (north_east, up, -east, Material.TILE_WHITE, Material.TILE_ORANGE),
        "west wall": (north_west, up, -north, Material.TILE_WHITE, Material.TILE_GREY),
        "south wall": (south_west, up, east, Material.TILE_WHITE, Material.TILE_BLACK),
    }
    boards = [(board.name, board.surface()) for board in tank_boards(depth_m)]
    return world_of("tank", [(side, _tiled(*parts)) for side, parts in sides.items()] + boards)


def tank_boards(depth_m: float) -> list[Checkerboard]:
    """Checkerboards of the tank around a robot at `depth_m`, with the world coordinates of their corners."""
    return [
        Checkerboard(
            name=name,
            columns=BOARD_COLUMNS,
            rows=BOARD_ROWS,
            square_m=BOARD_SQUARE_M,
            world_from_board=RigidTransform.from_components(
                np.array(place) - [0.0, 0.0, depth_m], _seen_from(azimuth_deg, elevation_deg)
            ),
        )
        for name, (place, azimuth_deg, elevation_deg) in BOARD_PLACES.items()
    ]


def _seen_from(azimuth_deg: float, elevation_deg: float) -> Rotation:
    """Axes of a board that is looked at squarely along a direction: right, down, into the board."""
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    into = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
    return Rotation.from_matrix(np.stack([right, np.cross(into, right), into], axis=-1))


def _tiled(corner: FloatArray, first: FloatArray, second: FloatArray, even: Material, odd: Material) -> Surface:
    """Checkered parallelogram; `first x second` points into the water."""
    counts = [max(1, round(float(np.linalg.norm(edge)) / TILE_M)) for edge in (first, second)]
    i, j = np.meshgrid(np.arange(counts[0] + 1), np.arange(counts[1] + 1), indexing="ij")
    vertices = corner + (i / counts[0])[..., np.newaxis] * first + (j / counts[1])[..., np.newaxis] * second
    index = i * (counts[1] + 1) + j
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=2).reshape(-1, 3)
    checker = np.where((i + j)[:-1, :-1] % 2 == 0, int(even), int(odd))
    return surface(vertices, faces, np.repeat(checker.ravel(), 2))
