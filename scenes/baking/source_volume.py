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

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from optics.kernels.arrays import FloatArray
from optics.kernels.packing import rows_of, vectors
from scenes.baking.ambient import LOG, RAYS_AT_ONCE, Reflection, Surroundings, cached, change_of_light
from scenes.baking.light_quality import LightQuality
from scenes.kernels.direction_grid import node_directions
from scenes.kernels.grid import GridTable, grid_axes, grid_points
from scenes.kernels.veiling_light import SOURCE_AZIMUTHS, SOURCE_ELEVATIONS, SOURCE_ROW
from scenes.light.light import Light
from scenes.stage.group_mesh import GroupMesh

SPACING_M = 0.35
INSET_M = 0.02
"""Points of the grid keep off the world's bounding box, where a basin has its walls."""

LARGE_GRID = 5000
"""Points, from which on most iterations are made on a grid with an eighth of them: three or so are left for all."""

SUN_RINGS_RAD = np.radians(np.geomspace(0.7, 15, 10))
SUN_AROUND = 12
"""Rings about the sun, and directions on each."""

RINGS, AROUND = 64, 48
"""Points at which the phase function is taken to share out a direction's light, by angle and around."""


def lit_world(mesh: GroupMesh, light: Light, quality: LightQuality) -> tuple[GroupMesh, GridTable]:
    """World with the irradiance at its vertices by all but the direct sun, and its source volume.

    From the cache when it can be; the volume is as `scenes.kernels.veiling_light` takes it.
    """
    axes = grid_axes(mesh, spacing_m=SPACING_M, most=quality.grid_points, inset_m=INSET_M)
    found = cache(lambda: _iterated(mesh, light, quality, axes))
    ambient = cached(mesh, light, quality, "light on the world", lambda: found()[0])
    source = cached(mesh, light, quality, "light that the water scatters", lambda: found()[1])
    return replace(mesh, ambient=ambient), source_volume(axes, source)


def source_volume(axes: list[FloatArray], source: FloatArray) -> GridTable:
    """Grid of sources, shape (n, elevations, azimuths, 3), as `scenes.kernels.veiling_light` takes it."""
    return GridTable.of(axes, rows_of(source.reshape(-1, 3), SOURCE_ROW))


def _iterated(
    mesh: GroupMesh, light: Light, quality: LightQuality, axes: list[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Irradiance at the vertices and source at the points, of a large grid beginning with those of a coarser one."""
    reflection = Reflection(mesh, light, quality)
    ambient, source = reflection.open_water, _dark(axes)
    if len(source) > LARGE_GRID:
        coarse = [np.linspace(axis[0], axis[-1], len(axis) // 2 + 1) for axis in axes]
        ambient, found = _settled(mesh, light, quality, reflection, coarse, ambient, _dark(coarse))
        source = resampled(coarse, found, axes)
    return _settled(mesh, light, quality, reflection, axes, ambient, source)


def _dark(axes: list[FloatArray]) -> FloatArray:
    """Source of a world that changes nothing, shape (n, elevations, azimuths, 3)."""
    return np.zeros((len(grid_points(axes)), SOURCE_ELEVATIONS, SOURCE_AZIMUTHS, 3), dtype=np.float32)


def _settled(  # noqa: PLR0917
    mesh: GroupMesh,
    light: Light,
    quality: LightQuality,
    reflection: Reflection,
    axes: list[FloatArray],
    ambient: FloatArray,
    source: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Irradiance and source once they have settled: each iteration adds one reflection and one scattering."""
    water = _Water(light, grid_points(axes))
    for iteration in range(1, quality.iterations + 1):
        volume = source_volume(axes, source)
        lit, ambient = ambient, reflection.once(ambient, volume)
        scattered, source = source, water.source(replace(mesh, ambient=ambient), volume)
        change = max(change_of_light(lit, ambient), np.abs(source - scattered).mean() / water.mean_source)
        LOG.info("iteration %d of at most %d: light changed by %.1f %%", iteration, quality.iterations, 100 * change)
        if change < quality.iterations_settled:
            break
    return ambient, source


def resampled(axes: list[FloatArray], source: FloatArray, finer: list[FloatArray]) -> FloatArray:
    """Source, shape (n, elevations, azimuths, 3), on the points of another grid over the same box: linear between."""
    values = source.reshape(*(len(axis) for axis in axes), -1)
    for k, (nodes, places) in enumerate(zip(axes, finer, strict=True)):
        weights = np.stack([np.interp(places, nodes, unit) for unit in np.eye(len(nodes))], axis=1)
        values = np.moveaxis(np.tensordot(weights.astype(np.float32), values, axes=(1, k)), 0, k)
    return values.reshape(-1, *source.shape[1:])


class _Water:
    """Points of the water, and what they scatter of what they see.

    Attributes
    ----------
    mean_source : float
        Mean of open water's source at the points.
    """

    def __init__(self, light: Light, points: FloatArray):
        self._light, self._points = light, points
        self._depth = float(-np.median(points[:, 2]))
        self._directions = sample_directions(light.towards_sun)
        means = light.channel_means(self._depth)
        shares = direction_weights(light, means["molecular"], self._directions)
        self._scattering = (means["scattering"][:, np.newaxis, np.newaxis] * shares).astype(np.float32)
        # Open water's radiance depends on the height alone.
        heights, self._height = np.unique(points[:, 2], return_inverse=True)
        column = np.stack([0 * heights, 0 * heights, heights], axis=-1)
        self._open_water = self._seen(Surroundings(None, light, depth_m=self._depth), column)
        self.mean_source = float(self._scattered(self._open_water)[self._height].mean())

    def source(self, mesh: GroupMesh, volume: GridTable) -> FloatArray:
        """Source at the points beside a lit mesh, shape (n, elevations, azimuths, 3)."""
        around = Surroundings(mesh, self._light, depth_m=self._depth, source=volume)
        pieces = max(1, len(self._points) * len(self._directions) // RAYS_AT_ONCE)
        parts = []
        for part in np.array_split(np.arange(len(self._points)), pieces):
            change = self._seen(around, self._points[part]) - self._open_water[:, self._height[part]]
            parts.append(self._scattered(change))
        return np.concatenate(parts).reshape(-1, SOURCE_ELEVATIONS, SOURCE_AZIMUTHS, 3)

    def _scattered(self, seen: FloatArray) -> FloatArray:
        """Source by radiance in all directions, shape (n, nodes, 3)."""
        return np.moveaxis(seen @ self._scattering.swapaxes(1, 2), 0, -1)

    def _seen(self, around: Surroundings, points: FloatArray) -> FloatArray:
        """Radiance in all directions, shape (3, n, directions)."""
        count = len(self._directions)
        origins, directions = np.repeat(points, count, axis=0), np.tile(self._directions, (len(points), 1))
        seen = around.radiance(vectors(origins), vectors(directions))
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
    return np.concatenate([nodes, rings])


def direction_weights(light: Light, molecular: FloatArray, directions: FloatArray) -> FloatArray:
    """Integral of the phase function over what of the sphere is nearest to each direction.

    Shape (3, nodes, directions): by channel, for the shares that molecules have of the scattering; without what is
    scattered by so little that it counts as not scattered.
    """
    middle, solid = _rings()
    weight = [np.repeat(light.phase_without_peak(middle, share) * solid, AROUND) for share in molecular]
    nearest = _nearest(directions.tobytes())
    result = np.zeros((3, len(nearest), len(directions)))
    for k, numbers in enumerate(nearest):
        result[:, k] = [np.bincount(numbers, each, minlength=len(directions)) for each in weight]
    return result


def _rings() -> tuple[FloatArray, FloatArray]:
    """Angles at which the phase function is taken, and the solid angle of each point there, shapes (RINGS,)."""
    ring = np.radians(np.geomspace(0.2, 180, RINGS + 1))
    ring[0] = 0
    return (ring[:-1] + ring[1:]) / 2, 2 * np.pi * (np.cos(ring[:-1]) - np.cos(ring[1:])) / AROUND


@lru_cache(maxsize=2)
def _nearest(directions: bytes) -> NDArray[np.int32]:
    """Number of the direction that is nearest to each point around each node, shape (nodes, RINGS * AROUND).

    It depends on the sun's place alone, and takes a second.
    """
    tree = cKDTree(np.frombuffer(directions).reshape(-1, 3))
    angle = np.repeat(_rings()[0], AROUND)[:, np.newaxis]
    around = np.tile(np.arange(AROUND) * (2 * np.pi / AROUND), RINGS)[:, np.newaxis]
    nodes = node_directions(SOURCE_AZIMUTHS, SOURCE_ELEVATIONS)
    result = np.empty((len(nodes), RINGS * AROUND), dtype=np.int32)
    for k, node in enumerate(nodes):
        across = np.linalg.svd(node[np.newaxis])[2][1:]
        beside = np.cos(around) * across[0] + np.sin(around) * across[1]
        result[k] = tree.query(np.cos(angle) * node + np.sin(angle) * beside)[1]
    return result
