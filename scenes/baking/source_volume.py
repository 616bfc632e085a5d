"""What a world changes of the light that water scatters: a grid of points, and directions at each.

Water shines by the light around it. Along a line of sight in the direction w it sends, per metre,

    b int p(w, w') L(w') dw',

the source function of radiative transfer. Open water's is part of its radiance F, which needs no source; near a world L
is another light, and the difference

    J(x, w) = b int p(w, w') (L(x, w') - F(w')) dw'

is found here: from each point the world is looked at in many directions. Light on its surfaces and J depend on each
other, and are found by iteration.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import Array3f32, Float32, UInt32, dr
from optics.kernels.clock import Pace
from optics.kernels.packing import padded_rows, rows_of, vectors
from scenes.baking.ambient import (
    LOG,
    RAYS_AT_ONCE,
    PlaceSizes,
    Reflection,
    Surroundings,
    cached,
    change_of_light,
    is_kept,
)
from scenes.baking.light_quality import LightQuality
from scenes.baking.lit_vertices import LitVertices
from scenes.baking.memory import give_memory_back
from scenes.baking.secant import Secant
from scenes.kernels.ambient_cube import ROW as SIDE_ROW
from scenes.kernels.ambient_cube import SIDES
from scenes.kernels.direction_grid import node_directions
from scenes.kernels.grid import GridTable, grid_axes, grid_points
from scenes.kernels.veiling_light import SOURCE_AZIMUTHS, SOURCE_ELEVATIONS, SOURCE_ROW
from scenes.light.light import Light
from scenes.stage.group_mesh import GroupMesh

SPACING_M = 0.35
INSET_M = 0.02
"""Points of the grid keep off the world's bounding box, where a basin has its walls."""

PLACES_M = PlaceSizes(iterated=0.8, kept=0.1)
"""Vertices nearer to each other share the light that they receive."""

SUN_RINGS_RAD = np.radians(np.geomspace(0.7, 15, 10))
SUN_AROUND = 12
"""Rings about the sun, and directions on each."""

CELL_HEIGHTS, CELL_TURNS = 400, 800
"""Cells of the sphere, each of which belongs to the direction nearest to it."""

ELEVATION_BLOCK_RAD, AZIMUTH_BLOCK_RAD = np.pi / 6, np.pi / 3
"""Directions are looked in block by block."""

KEPT = "light on the world", "light that the water scatters", "light in the water"
"""Names of what is kept of a world."""

QUARTERS = 4
"""Of the rays, after each of which the log says how long the rest takes."""

RINGS, AROUND = 64, 48
"""Points at which the phase function is taken to share out a direction's light, by angle and around."""


def lit_world(mesh: GroupMesh, light: Light, quality: LightQuality) -> tuple[GroupMesh, GridTable, GridTable]:
    """World with the irradiance at its vertices by all but the direct sun, and what it changes of the water's light.

    From the cache when it can be: its source volume as `scenes.kernels.veiling_light` takes it, and the irradiance of
    planes as `scenes.kernels.ambient_cube` does.
    """
    axes = grid_axes(mesh, spacing_m=SPACING_M, most=quality.grid_points, inset_m=INSET_M)
    found = cache(lambda: _found(mesh, light, quality, axes))
    ambient, source, around = (
        cached(mesh, light, quality, name, lambda k=k: found()[k])  # type: ignore[misc]
        for k, name in enumerate(KEPT)
    )
    irradiance = GridTable.of(axes, rows_of(around.reshape(-1, 3), SIDE_ROW))
    # Kept as the kernels read it, and where they can: it is large.
    return replace(mesh, ambient=ambient), GridTable.of(axes, Float32(source)), irradiance


def is_world_lit(mesh: GroupMesh, light: Light, quality: LightQuality) -> bool:
    """Whether all that `lit_world` gives is in the cache."""
    return all(is_kept(mesh, light, quality, name) for name in KEPT)


def source_volume(axes: list[FloatArray], source: NDArray[np.floating]) -> GridTable:
    """Grid of sources, shape (n, elevations, azimuths, 3), as `scenes.kernels.veiling_light` takes it."""
    return GridTable.of(axes, Float32(_rows(source)))


def _rows(source: NDArray[np.floating]) -> NDArray[np.float32]:
    return padded_rows(source.reshape(-1, 3), SOURCE_ROW)


class WorldLight(NamedTuple):
    """What is found of a world's light, and kept.

    Attributes
    ----------
    ambient : array, shape (n, 3)
        Irradiance at its vertices by all but the direct sun.
    source : array, shape (k * elevations * azimuths * SOURCE_ROW,)
        What it changes of the light that water scatters, at the points of a grid, as `source_volume` has it.
    around : array, shape (k, sides, 3)
        What it changes of the irradiance of planes there (`scenes.kernels.ambient_cube`).
    """

    ambient: FloatArray
    source: NDArray[np.float32]
    around: NDArray[np.float32]


def _found(mesh: GroupMesh, light: Light, quality: LightQuality, axes: list[FloatArray]) -> WorldLight:
    """Light that has settled on few places and a coarse grid, and then once more on more of them, and twice on all.

    What a coarse grid cannot tell a finer one is local: it needs no more than two iterations.
    """
    around, vertices = Surroundings.of(mesh, light), LitVertices.of(mesh, light)
    ambient, volume = _settled(vertices, around, quality, _coarser(axes, 3))
    finer = _coarser(axes, 2)
    water_of_finer, water = _Water(light, grid_points(finer)), _Water(light, grid_points(axes))
    reflection = Reflection(vertices, around, PLACES_M.kept, quality.directions)
    rays = RaysToGo(water_of_finer.rays + reflection.rays + 2 * water.rays)
    source, _ = water_of_finer.source(around, ambient, volume, rays)
    volume = source_volume(finer, source)
    ambient = reflection.once(ambient, volume)
    rays.traced(reflection.rays)
    give_memory_back()  # before what takes most
    source, _ = water.source(around, ambient, volume, rays)
    give_memory_back()
    # In corners a coarse grid lets light into shadows: what scatters twice there is 2 % too bright after one iteration.
    volume = source_volume(axes, source)
    del source  # as large as all else is
    source, sides = water.source(around, ambient, volume, rays)
    del volume
    return WorldLight(ambient=ambient, source=_rows(source), around=sides)


def _coarser(axes: list[FloatArray], times: int) -> list[FloatArray]:
    """Grid over the same box with `times` times fewer cells along each axis."""
    return [np.linspace(axis[0], axis[-1], max(len(axis) // times, 1) + 1) for axis in axes]


def _settled(
    vertices: LitVertices, around: Surroundings, quality: LightQuality, axes: list[FloatArray]
) -> tuple[FloatArray, GridTable]:
    """Irradiance at the vertices and source volume on a grid: each iteration adds one reflection and one scattering."""
    reflection = Reflection(vertices, around, PLACES_M.iterated, quality.iteration_directions)
    water = _Water(around.light, grid_points(axes))
    lit, scattered = vertices.open_water, _dark(axes)
    secant = Secant()
    for iteration in range(1, quality.iterations + 1):
        volume = source_volume(axes, scattered)
        ambient = reflection.once(lit, volume)
        source, _ = water.source(around, ambient, volume)
        change = max(change_of_light(lit, ambient), np.abs(source - scattered).mean() / water.mean_source)
        LOG.info("iteration %d of at most %d: light changed by %.1f %%", iteration, quality.iterations, 100 * change)
        if change < quality.iterations_settled:
            break
        lit, scattered = secant.following((lit, scattered), (ambient, source))
    return ambient, source_volume(axes, source)


def _dark(axes: list[FloatArray]) -> FloatArray:
    """Source of a world that changes nothing, shape (n, elevations, azimuths, 3)."""
    return np.zeros((len(grid_points(axes)), SOURCE_ELEVATIONS, SOURCE_AZIMUTHS, 3), dtype=np.float32)


class RaysToGo:
    """Says how much of all rays has been traced, and how long the others take: at each quarter of them."""

    def __init__(self, count: int):
        self._all, self._done, self._pace = count, 0, Pace()
        self._pace.to_go(0, count)

    def traced(self, count: int) -> None:
        """Count rays that have been traced."""
        quarters, self._done = QUARTERS * self._done // self._all, self._done + count
        if quarters < QUARTERS * self._done // self._all < QUARTERS:
            percent, to_go = 100 * self._done // self._all, self._pace.to_go(self._done, self._all)
            LOG.info("light on the world: %d %% of its rays are traced%s", percent, to_go)


class _Water:
    """Points of the water, and what they scatter of what they see.

    Attributes
    ----------
    mean_source : float
        Mean of open water's source at the points.
    rays : int
        Of one look at it.
    """

    def __init__(self, light: Light, points: FloatArray):
        self._points = points
        self._depth = float(-np.median(points[:, 2]))
        self._directions = sample_directions(light.towards_sun)
        self.rays = len(points) * len(self._directions)
        means = light.channel_means(self._depth)
        shares = direction_weights(light, means["molecular"], self._directions)
        self._scattering = (means["scattering"][:, np.newaxis, np.newaxis] * shares).astype(np.float32)
        self._sides = side_weights(self._directions).astype(np.float32)
        # Open water's radiance depends on the height alone.
        heights, self._height = np.unique(points[:, 2], return_inverse=True)
        column = np.stack([0 * heights, 0 * heights, heights], axis=-1)
        self._open_water = self._seen(Surroundings.of(None, light, depth_m=self._depth), column)
        self.mean_source = float(self._scattered(self._open_water)[self._height].mean())

    def source(
        self, around: Surroundings, ambient: FloatArray, volume: GridTable, rays: RaysToGo | None = None
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Source at the points, shape (n, elevations, azimuths, 3), and irradiance of planes, shape (n, sides, 3).

        Both as a lit mesh changes them.
        """
        lit = around.lit(ambient, volume, depth_m=self._depth)
        batches = max(1, self.rays // RAYS_AT_ONCE)
        sources = np.empty((len(self._points), SOURCE_ELEVATIONS * SOURCE_AZIMUTHS, 3), dtype=np.float32)
        sides = np.empty((len(self._points), len(SIDES), 3), dtype=np.float32)
        for part in np.array_split(np.arange(len(self._points)), batches):
            change = self._seen(lit, self._points[part]) - self._open_water[:, self._height[part]]
            sources[part] = self._scattered(change)
            sides[part] = np.moveaxis(change @ self._sides.T, 0, -1)
            if rays is not None:
                rays.traced(len(part) * len(self._directions))
        return sources.reshape(-1, SOURCE_ELEVATIONS, SOURCE_AZIMUTHS, 3), sides

    def _scattered(self, seen: FloatArray) -> FloatArray:
        """Source by radiance in all directions, shape (n, nodes, 3)."""
        return np.moveaxis(seen @ self._scattering.swapaxes(1, 2), 0, -1)

    def _seen(self, around: Surroundings, points: FloatArray) -> FloatArray:
        """Radiance in all directions, shape (3, n, directions)."""
        count = len(self._directions)
        lane = dr.arange(UInt32, len(points) * count)
        origins, directions = (
            dr.gather(Array3f32, vectors(rows), index)
            for rows, index in ((points, lane // count), (self._directions, lane % count))
        )
        seen = around.radiance(origins, directions)
        return np.stack([channel.numpy().reshape(len(points), count) for channel in seen])


def sample_directions(towards_sun: FloatArray) -> FloatArray:
    """Directions, shape (n, 3): those at which the source is known, and rings about the sun.

    Most of what water sends along a direction comes from closely about it: looked at beside it, the light would be
    scattered wider than it is. Around the sun lies what was scattered forward, which a shadow takes away.
    """
    # At the poles all azimuths are one direction.
    nodes = np.unique(np.round(node_directions(SOURCE_AZIMUTHS, SOURCE_ELEVATIONS), 12), axis=0)
    across = np.linalg.svd(towards_sun[np.newaxis])[2][1:]
    ring = np.repeat(SUN_RINGS_RAD, SUN_AROUND)[:, np.newaxis]
    around = np.tile(np.arange(SUN_AROUND) * (2 * np.pi / SUN_AROUND), len(SUN_RINGS_RAD))[:, np.newaxis]
    rings = np.cos(ring) * towards_sun + np.sin(ring) * (np.cos(around) * across[0] + np.sin(around) * across[1])
    directions = np.concatenate([nodes, rings])
    # Neighbours in a vector meet about the same: a fifth less time.
    elevation, azimuth = np.arcsin(np.clip(directions[:, 2], -1, 1)), np.arctan2(directions[:, 1], directions[:, 0])
    return directions[np.lexsort([azimuth // AZIMUTH_BLOCK_RAD, elevation // ELEVATION_BLOCK_RAD])]


def direction_weights(light: Light, molecular: FloatArray, directions: FloatArray) -> FloatArray:
    """Integral of the phase function over what of the sphere is nearest to each direction.

    Shape (3, nodes, directions): by channel, for the shares that molecules have of the scattering; without what is
    scattered by so little that it counts as not scattered.
    """
    middle, solid = _rings()
    weight = [np.repeat(light.phase_without_peak(middle, share) * solid, AROUND) for share in molecular]
    around = nearest_around_nodes(directions.tobytes())
    result = np.zeros((3, len(around), len(directions)))
    for k, numbers in enumerate(around):
        result[:, k] = [np.bincount(numbers, each, minlength=len(directions)) for each in weight]
    return result


def _rings() -> tuple[FloatArray, FloatArray]:
    """Rings of the sphere about a direction: angles of their middles, and the solid angle of a part of each."""
    ring = np.radians(np.geomspace(0.2, 180, RINGS + 1))
    ring[0] = 0
    return (ring[:-1] + ring[1:]) / 2, 2 * np.pi * (np.cos(ring[:-1]) - np.cos(ring[1:])) / AROUND


@lru_cache(maxsize=2)
def nearest_around_nodes(directions: bytes) -> NDArray[np.int16]:
    """Number of the direction that is nearest to each part of the rings about each node, shape (nodes, parts)."""
    middle, _ = _rings()
    turn = np.tile(np.arange(AROUND) * (2 * np.pi / AROUND), RINGS)[:, np.newaxis]
    ahead, aside = np.repeat(np.cos(middle), AROUND)[:, np.newaxis], np.repeat(np.sin(middle), AROUND)[:, np.newaxis]
    nearest = nearest_direction(directions)
    found = []
    for node in node_directions(SOURCE_AZIMUTHS, SOURCE_ELEVATIONS):
        across = np.linalg.svd(node[np.newaxis])[2][1:]
        parts = ahead * node + aside * (np.cos(turn) * across[0] + np.sin(turn) * across[1])
        found.append(nearest[_cell_of(parts)])
    return np.stack(found)


def side_weights(directions: FloatArray) -> FloatArray:
    """Integral of the cosine to each of the six sides over what of the sphere is nearest to each direction: (6, n)."""
    nearest = nearest_direction(directions.tobytes())
    cosines = np.maximum(SIDES @ _cell_middles().T, 0) * (4 * np.pi / len(nearest))
    return np.stack([np.bincount(nearest, each, minlength=len(directions)) for each in cosines])


@lru_cache(maxsize=2)
def nearest_direction(directions: bytes) -> NDArray[np.int16]:
    """Number of the direction that is nearest to each of many cells of the sphere, all of one solid angle."""
    tree = cKDTree(np.frombuffer(directions).reshape(-1, 3))
    return np.asarray(tree.query(_cell_middles())[1], dtype=np.int16)


def _cell_middles() -> FloatArray:
    """Directions of the middles of the cells, shape (n, 3)."""
    height = (np.arange(CELL_HEIGHTS) + 0.5) * (2 / CELL_HEIGHTS) - 1
    turn = (np.arange(CELL_TURNS) + 0.5) * (2 * np.pi / CELL_TURNS) - np.pi
    level = np.sqrt(1 - height**2)[:, np.newaxis]
    axes = np.broadcast_arrays(level * np.cos(turn), level * np.sin(turn), height[:, np.newaxis])
    return np.stack(axes, axis=-1).reshape(-1, 3)


def _cell_of(directions: FloatArray) -> NDArray[np.int64]:
    """Number of the cell that directions, shape (n, 3), lie in."""
    row = np.clip((directions[:, 2] + 1) * (CELL_HEIGHTS / 2), 0, CELL_HEIGHTS - 1).astype(np.int64)
    turn = np.arctan2(directions[:, 1], directions[:, 0])
    column = np.clip((turn + np.pi) * (CELL_TURNS / (2 * np.pi)), 0, CELL_TURNS - 1).astype(np.int64)
    return row * CELL_TURNS + column
