"""Ambient light on what stands still: at every vertex of a world, the irradiance of all but the direct sun.

The sea's own light reaches a reef or a tank through what stands around, and what stands around sends light as well.
Both are gathered by the kernel that renders frames: from each vertex it looks out in many directions, through the same
water, at the same surfaces, which are lit by what was gathered before. Each iteration adds one more reflection. What is
averaged over the directions is the difference that the surroundings make to open water, whose light is known without
any averaging: where nothing is in the way there is no noise.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray, aligned
from optics.kernels.backend import Array3f32, Float32, UInt32, dr
from optics.kernels.cache import load_or_make, result_key
from optics.kernels.freezing import Flat
from optics.kernels.packing import Packing
from optics.kernels.trees import leaves_of
from scenes.baking.light_quality import LightQuality
from scenes.baking.sample_directions import spiral_azimuth
from scenes.kernels.geometry import geometry_of
from scenes.kernels.grid import GridTable
from scenes.kernels.kernel import Shape, compiled_frame
from scenes.kernels.tracing import FAR_M, FixedHit, Rays
from scenes.light.light import Light
from scenes.light.uniforms import LightUniforms
from scenes.stage.group_mesh import GroupMesh, vertex_normals
from scenes.stage.records import NO_BALL, WORLD, Pose, StateRecord

LOG = logging.getLogger(__name__)

RAYS_AT_ONCE = 1 << 21
"""Memory is bounded by gathering for so many rays at a time."""

INSET = 0.05
"""How far towards the middles of its faces a vertex looks out from: at an edge it lies in the next face's plane."""

OFFSET_M = 1e-3

LIGHT_VERSION = 4
"""Raised when anything that is found once for a mesh under a light, and kept, comes out otherwise for the same inputs.

One number for all of it, here and in the modules that call `cached`: most of it is found from the rest.
"""


def with_ambient(mesh: GroupMesh, light: Light, quality: LightQuality) -> GroupMesh:
    """The mesh with the irradiance at its vertices by all but the direct sun; from the cache when it can be."""
    if not len(mesh.faces):
        return mesh
    ambient = cached(mesh, light, quality, "light on the robot", lambda: ambient_light(mesh, light, quality))
    return replace(mesh, ambient=ambient)


def cached(
    mesh: GroupMesh,
    light: Light,
    quality: LightQuality,
    name: str,
    make: Callable[[], FloatArray],
    *,
    places: Sequence[FloatArray] = (),
) -> FloatArray:
    """Array that comes from a mesh under a light, kept on disk.

    `places` are whatever else it comes from. The log tells what is not there yet: it takes seconds to a minute.
    """

    def found() -> FloatArray:
        LOG.info("finding the %s; it is kept for the next time", name)
        return make()

    key = light_key(name, mesh, light, quality, places)
    return load_or_make(name, key, found, pack=lambda made: {"values": made}, unpack=lambda stored: stored["values"])


def light_key(
    name: str, mesh: GroupMesh, light: Light, quality: LightQuality, places: Sequence[FloatArray] = ()
) -> str:
    """Key of what comes from a mesh under a light and from places: all that the kernels take of them, and how finely.

    Coarse light cannot be taken for good light.
    """
    surface = mesh.vertices_m, mesh.faces, mesh.material, mesh.colour, leaves_of(mesh.mirrors)
    lit = light.field_nodes, light.ambient_nodes, leaves_of(light.uniforms(1.0))
    return result_key(name, LIGHT_VERSION, surface, lit, asdict(quality), places)


def ambient_light(mesh: GroupMesh, light: Light, quality: LightQuality) -> FloatArray:
    """Irradiance at the vertices, shape (n, 3), once its reflections have settled."""
    reflection = Reflection(mesh, light, quality)
    before = reflection.open_water
    for _ in range(quality.reflections):
        ambient = reflection.once(before)
        if change_of_light(before, ambient) < quality.settled:
            return ambient
        before = ambient
    return before


class Reflection:
    """What the vertices of a mesh receive from each other.

    Attributes
    ----------
    open_water : array, shape (n, 3)
        Irradiance at the vertices by all but the direct sun if the mesh hid nothing and sent nothing.
    """

    def __init__(self, mesh: GroupMesh, light: Light, quality: LightQuality):
        self._mesh, self._light, self._quality = mesh, light, quality
        self._normals = vertex_normals(mesh.vertices_m, mesh.faces)
        self._origins = _inset(mesh) + self._normals * OFFSET_M
        self.open_water = light.open_water_irradiance(-self._origins[:, 2], self._normals)
        self._unseen = gathered(None, self._origins, self._normals, light, quality)

    def once(self, ambient: FloatArray, source: GridTable | None = None) -> FloatArray:
        """Irradiance at the vertices, shape (n, 3), when the mesh is lit by what is given: one more reflection.

        `source` is what the mesh changes of the water's light (`scenes.baking.source_volume`).
        """
        lit = replace(self._mesh, ambient=ambient)
        seen = gathered(lit, self._origins, self._normals, self._light, self._quality, source)
        return np.maximum(self.open_water + seen - self._unseen, 0)


def change_of_light(before: FloatArray, ambient: FloatArray) -> float:
    """By what share a reflection has changed the mean light at the vertices, in the channel where it is largest."""
    return float((np.abs((ambient - before).mean(axis=0)) / ambient.mean(axis=0)).max())


def gathered(  # noqa: PLR0917
    mesh: GroupMesh | None,
    origins: FloatArray,
    normals: FloatArray,
    light: Light,
    quality: LightQuality,
    source: GridTable | None = None,
) -> FloatArray:
    """Irradiance at points from some directions, by channel, shape (n, 3); without a mesh that of open water."""
    directions = int(np.clip(quality.rays // len(origins), quality.fewest_directions, quality.most_directions))
    # The light's numbers hold how it divides within a channel at one depth: the middle of what is lit.
    around = Surroundings(mesh, light, depth_m=float(np.median(-origins[:, 2])), source=source)
    parts = []
    at_once = max(1, RAYS_AT_ONCE // directions)
    for start in range(0, len(origins), at_once):
        origin, direction = _outward(
            origins[start : start + at_once], normals[start : start + at_once], directions, start
        )
        seen = around.radiance(origin, direction)
        # Directions are spread as the cosine: irradiance is pi times their mean radiance.
        parts.append(
            np.pi * np.stack([channel.numpy().reshape(-1, directions).mean(axis=1) for channel in seen], axis=-1)
        )
    return np.concatenate(parts)


class Surroundings:
    """What a lit mesh shows along any rays of the world frame; open water without a mesh. Its tables are kept."""

    def __init__(self, mesh: GroupMesh | None, light: Light, *, depth_m: float, source: GridTable | None = None):
        geometry = geometry_of({} if mesh is None else {WORLD: mesh}, light.towards_sun)
        self._geometry = replace(geometry, source=source)
        self.tables = light.tables(without_peak=True)
        self._flat_geometry, self._flat_tables = Flat(self._geometry), Flat(self.tables)
        uniforms = light.uniforms(depth_m)
        still = StateRecord(
            poses={WORLD: Pose.of(np.eye(4))},
            mirrors=(mesh and mesh.mirrors) or {},
            towards_sun=light.towards_sun,
            clearance_m=0.0,
            ball=NO_BALL,
        )
        light_packing, state_packing = Packing.of(uniforms), Packing.of(still)
        self._records = light_packing.upload(uniforms), state_packing.upload(still)
        self._shape = Shape(
            light=light_packing,
            state=state_packing,
            wavelengths=len(light.bands.wavelength_nm),
            lanes=0,
            states=1,
            eyes=0,
            truth=False,
        )
        self.uniforms: LightUniforms = light_packing.unpack(self._records[0], UInt32(0))

    @property
    def scene(self) -> Any:
        """The mesh as Mitsuba traces it."""
        return self._geometry.groups[WORLD].scene

    def radiance(self, origin: Any, direction: Any) -> list[Any]:
        """Radiance by channel, without the direct sun and what surrounds it closely."""
        nothing = FixedHit(distance=dr.full(Float32, FAR_M, 1), face=dr.zeros(UInt32, 1))
        gain = dr.full(Float32, 1.0, dr.width(origin))
        rays = Rays(origin=origin, direction=direction, gain=gain, prefix=(nothing,))
        dr.eval(rays)
        frame = compiled_frame(self._shape)(Flat(rays), self._flat_geometry, self._flat_tables, *self._records)
        return list(frame.rgb)


def _outward(origins: FloatArray, normals: FloatArray, count: int, first: int) -> tuple[Any, Any]:
    """Rays (origins, directions) from vertices into the half-space before them, spread as the cosine, each turned."""
    lane = dr.arange(UInt32, len(origins) * count)
    vertex, sample = lane // count, lane % count
    radius = dr.sqrt((Float32(sample) + 0.5) / count)
    sine, cosine = dr.sincos(spiral_azimuth(vertex + first, sample))
    columns = [
        [dr.gather(Float32, Float32(aligned(column, np.float32)), vertex) for column in array.T]
        for array in (origins, normals)
    ]
    origin, normal = Array3f32(*columns[0]), Array3f32(*columns[1])
    across, along = _axes(normal)
    height = dr.safe_sqrt(1 - dr.square(radius))
    direction = across * (radius * cosine) + along * (radius * sine) + normal * height
    return origin, direction


def _axes(normal: Any) -> tuple[Any, Any]:
    """Two axes across a normal, without a branch (Duff et al. 2017, JCGT 6, 1)."""
    sign = dr.select(normal.z >= 0, Float32(1), Float32(-1))
    a = -1 / (sign + normal.z)
    b = normal.x * normal.y * a
    first = Array3f32(1 + sign * dr.square(normal.x) * a, sign * b, -sign * normal.x)
    return first, Array3f32(b, sign + dr.square(normal.y) * a, -normal.y)


def _inset(mesh: GroupMesh) -> FloatArray:
    """Vertices, moved a little towards the middles of the faces around them."""
    middles = mesh.vertices_m[mesh.faces].mean(axis=1)
    corners = mesh.faces.ravel()
    count = np.bincount(corners, minlength=len(mesh.vertices_m))
    around = np.stack(
        [
            np.bincount(corners, np.repeat(column, 3), minlength=len(mesh.vertices_m)) / np.maximum(count, 1)
            for column in middles.T
        ],
        axis=1,
    )
    return np.where(count[:, np.newaxis] > 0, mesh.vertices_m + INSET * (around - mesh.vertices_m), mesh.vertices_m)
