"""Ambient light on what stands still: at every vertex of a world, the irradiance of all but the direct sun.

The sea's own light reaches a reef or a tank through what stands around, and what stands around sends light as well.
Both are gathered by the kernel that renders frames: from each vertex it looks out in many directions, through the same
water, at the same surfaces, which are lit by what was gathered before. Each iteration adds one more reflection. Open
water's light is known without any averaging: what is found is which share of it comes past the mesh, and what the mesh
sends. Where nothing is in the way there is no noise.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import Array3f32, Float32, UInt32, dr
from optics.kernels.cache import load_or_make, result_key
from optics.kernels.cache_contents import entry_path
from optics.kernels.freezing import Flat
from optics.kernels.packing import Packing, on_device, on_host, opaque_numbers, vectors
from optics.kernels.trees import leaves_of
from optics.workers.threads import woken_threads
from scenes.baking.gather_places import places_on
from scenes.baking.light_quality import LightQuality
from scenes.baking.lit_vertices import LitVertices
from scenes.baking.sample_directions import SampleDirections, scattered_density, scattered_directions
from scenes.kernels.geometry import Geometry, geometry_of, relit
from scenes.kernels.grid import GridTable
from scenes.kernels.kernel import Shape, compiled_frame
from scenes.kernels.tracing import FAR_M, FixedHit, Rays
from scenes.light.light import Light
from scenes.light.uniforms import LightTables, LightUniforms
from scenes.stage.frame import FrameArrays, Label
from scenes.stage.group_mesh import GroupMesh
from scenes.stage.records import NO_BALL, WORLD, MirrorPlate, Pose, StateRecord

LOG = logging.getLogger(__name__)

RAYS_AT_ONCE = 1 << 18
"""Number of rays gathered for at a time, which bounds memory."""

ABOUT_SUN = 4
"""One direction in this number is drawn about the sun."""

LEAST = 1e-30
LEAST_DENSITY = 1e-6
"""Light that is divided by is more than this."""

LIGHT_VERSION = 14
"""Raised when anything that is found once for a mesh under a light, and kept, comes out otherwise for the same inputs.

One number for all of it, here and in the modules that call `cached`: most of it is found from the rest.
"""


def is_kept(
    mesh: GroupMesh, light: Light, quality: LightQuality, name: str, *, places: Sequence[FloatArray] = ()
) -> bool:
    """Whether `cached` would find such an array in the cache."""
    return entry_path(name, light_key(name, mesh, light, quality, places)).exists()


class NotKeptError(LookupError):
    """Light that was wanted from the cache alone, and is not in it; its name."""


_KEPT_ALONE: ContextVar[bool] = ContextVar("_KEPT_ALONE", default=False)


@contextmanager
def kept_light_alone() -> Iterator[None]:
    """Within it light is taken from the cache, and never found: `NotKeptError` for the first that is not there."""
    token = _KEPT_ALONE.set(True)
    try:
        yield
    finally:
        _KEPT_ALONE.reset(token)


def with_ambient(
    mesh: GroupMesh, light: Light, quality: LightQuality, apart_m: PlaceSizes, around: Callable[[], Surroundings]
) -> GroupMesh:
    """The mesh with the irradiance at its vertices by all but the direct sun, kept; `around` makes it as it is seen."""
    if not len(mesh.faces):
        return mesh

    def made() -> FloatArray:
        return ambient_light(mesh, around(), quality, apart_m)

    return replace(mesh, ambient=cached(mesh, light, quality, "light on the robot", made))


def cached(
    mesh: GroupMesh,
    light: Light,
    quality: LightQuality,
    name: str,
    make: Callable[[], NDArray[Any]],
    *,
    places: Sequence[FloatArray] = (),
) -> NDArray[Any]:
    """Array that comes from a mesh under a light, kept on disk.

    `places` are whatever else it comes from. The log says what is not there yet: it takes seconds to a minute.
    """

    def found() -> NDArray[Any]:
        LOG.info("finding the %s; it is kept for the next time", name)
        values = make()
        dr.flush_malloc_cache()  # it holds on to the memory of rays that nobody traces again
        return values

    key = light_key(name, mesh, light, quality, places)
    if _KEPT_ALONE.get() and not entry_path(name, key).exists():
        raise NotKeptError(name)
    return load_or_make(name, key, found, pack=lambda made: {"values": made}, unpack=lambda stored: stored["values"])


def light_key(
    name: str, mesh: GroupMesh, light: Light, quality: LightQuality, places: Sequence[FloatArray] = ()
) -> str:
    """Key of what comes from a mesh under a light and from places: all that the kernels take of them, and how finely.

    Coarse light cannot be taken for good light.
    """
    surface = mesh.vertices_m, mesh.faces, mesh.material, mesh.colour, leaves_of(mesh.mirrors)
    uniforms = light.uniforms(1.0)
    if not mesh.mirrors:
        # A world does not know what the mirrors of a robot are coated with.
        uniforms = replace(uniforms, mirror_fit=None)
    lit = light.field_nodes, light.ambient_nodes, leaves_of(uniforms)
    return result_key(name, LIGHT_VERSION, surface, lit, asdict(quality), places)


def ambient_light(mesh: GroupMesh, around: Surroundings, quality: LightQuality, apart_m: PlaceSizes) -> FloatArray:
    """Irradiance at the vertices, shape (n, 3), once its reflections have settled.

    They settle on few places that look in few directions; the last one is gathered on all of them in many.
    """
    vertices = LitVertices.of(mesh, around.light)
    coarse = Reflection(vertices, around, apart_m.iterated, quality.iteration_directions)
    before = vertices.open_water
    for _ in range(quality.reflections):
        ambient = coarse.once(before)
        change, before = change_of_light(before, ambient), ambient
        if change < quality.settled:
            break
    return Reflection(vertices, around, apart_m.kept, quality.directions).once(before)


@dataclass(frozen=True)
class PlaceSizes:
    """How far apart, in metres, light is gathered on a mesh: while its reflections settle, and what is kept."""

    iterated: float
    kept: float


class Reflection:
    """What the vertices of a mesh receive from each other.

    Parameters
    ----------
    vertices : LitVertices
    around : Surroundings
        The mesh as it is looked at.
    apart_m : float
        Vertices nearer to each other, that face about the same way, share what they receive.
    directions : callable
        From the area around each place to the number of directions in which it looks out.

    Attributes
    ----------
    rays : int
        Of one reflection.
    """

    def __init__(
        self,
        vertices: LitVertices,
        around: Surroundings,
        apart_m: float,
        directions: Callable[[FloatArray], NDArray[np.int64]],
    ):
        places = places_on(vertices.vertices_m, vertices.normals, vertices.double_areas_m2, apart_m)
        self._around, self._owner, self._lit_by_water = around, places.owner, vertices.open_water
        self._origins, self._normals = vertices.origins_m[places.vertices], vertices.normals[places.vertices]
        self._counts = directions(np.bincount(places.owner, vertices.double_areas_m2).astype(np.float64))
        self.rays = int(self._counts.sum())
        # The light's numbers hold how it divides within a channel at one depth: the middle of what is lit.
        self._depth_m = float(np.median(-self._origins[:, 2]))
        nothing = Surroundings.of(None, around.light, depth_m=self._depth_m)
        of_water = sum(nothing.irradiance(self._origins, self._normals, self._counts))
        self._open_water = vertices.open_water[places.vertices]
        self._share_found = self._open_water / np.maximum(of_water, LEAST)

    def once(self, ambient: FloatArray, source: GridTable | None = None) -> FloatArray:
        """Irradiance at the vertices, shape (n, 3), when the mesh is lit by what is given: one more reflection.

        `source` is what the mesh changes of the water's light (`scenes.baking.source_volume`).
        """
        lit = self._around.lit(ambient, source, depth_m=self._depth_m)
        of_mesh, past_it = lit.irradiance(self._origins, self._normals, self._counts)
        # Where nothing is in the way it is open water's exactly, and where all is, its share does not matter.
        received = of_mesh + past_it * self._share_found
        return self._lit_by_water * (received / np.maximum(self._open_water, LEAST))[self._owner]


def change_of_light(before: FloatArray, ambient: FloatArray) -> float:
    """By what share a reflection has changed the mean light at the vertices, in the channel where it is largest."""
    return float((np.abs((ambient - before).mean(axis=0)) / ambient.mean(axis=0)).max())


class Surroundings:
    """What a lit mesh shows along any rays of the world frame; open water without a mesh.

    Parameters
    ----------
    geometry : Geometry
        Of one mesh at most.
    light : Light
    tables : LightTables
    mirrors : dict of MirrorPlate
    depth_m : float
        For which the light divides within each channel.
    """

    def __init__(
        self, geometry: Geometry, light: Light, tables: LightTables, mirrors: dict[str, MirrorPlate], depth_m: float
    ):
        self.light, self.tables = light, tables
        self._geometry, self._mirrors = geometry, mirrors
        self._flat_geometry, self._flat_tables = Flat(geometry), Flat(tables)
        uniforms = light.uniforms(depth_m)
        still = StateRecord(
            poses={WORLD: Pose.of(np.eye(4))},
            mirrors=mirrors,
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
            coherent=False,
        )
        self.uniforms: LightUniforms = on_device(uniforms)

    @classmethod
    def of(cls, mesh: GroupMesh | None, light: Light, *, depth_m: float = 0.0) -> Surroundings:
        """Surroundings that a mesh is, lit as it says or, when it does not say, dark."""
        meshes, mirrors = {}, {}
        if mesh is not None:
            ambient = np.zeros_like(mesh.vertices_m) if mesh.ambient is None else mesh.ambient
            meshes, mirrors = {WORLD: replace(mesh, ambient=ambient)}, mesh.mirrors or {}
        tables = light.tables(without_peak=True)
        return cls(geometry_of(meshes, light.towards_sun), light, tables, mirrors, depth_m)

    def lit(self, ambient: FloatArray, source: GridTable | None, *, depth_m: float) -> Surroundings:
        """The same with other light on the mesh and in the water, at another depth."""
        geometry = replace(relit(self._geometry, ambient), source=source)
        return Surroundings(geometry, self.light, self.tables, self._mirrors, depth_m)

    @property
    def scene(self) -> Any:
        """The mesh as Mitsuba traces it."""
        return self._geometry.groups[WORLD].scene

    def radiance(self, origin: Any, direction: Any) -> list[Any]:
        """Radiance by channel, without the direct sun and what surrounds it closely."""
        return list(self._seen(origin, direction).rgb)

    def irradiance(
        self, origins: FloatArray, normals: FloatArray, counts: NDArray[np.int64]
    ) -> tuple[FloatArray, FloatArray]:
        """Irradiance by channel, shape (n, 3), from so many directions: of the mesh, and of the water past it."""
        result = np.empty((len(origins), 6))
        for count in np.unique(counts):
            places = np.flatnonzero(counts == count)
            at_once = max(1, RAYS_AT_ONCE // count)
            for start in range(0, len(places), at_once):
                some = places[start : start + at_once]
                result[some] = self._irradiance(origins[some], normals[some], int(count), start)
        of_mesh, past_it = np.split(result, 2, axis=1)
        return of_mesh, past_it

    def _irradiance(self, origins: FloatArray, normals: FloatArray, count: int, first: int) -> FloatArray:
        """Irradiance by channel of the mesh, and then of the water past it, shape (n, 6)."""
        *rays, weight = _outward(origins, normals, count, first, self.light.towards_sun)
        frame = self._seen(*rays)
        past = (frame.label == int(Label.OPEN_WATER)) | (frame.label == int(Label.SURFACE))
        split = [dr.select(each, c * weight, 0) for each in (~past, past) for c in frame.rgb]
        # A sum evaluates what it sums up: one by one, each by a kernel of its own.
        dr.eval(split)
        return on_host([dr.block_sum(each, count) for each in split])

    def _seen(self, origin: Any, direction: Any) -> FrameArrays:
        nothing = FixedHit(distance=dr.full(Float32, FAR_M, 1), face=dr.zeros(UInt32, 1))
        gain = dr.full(Float32, 1.0, dr.width(origin))
        rays = Rays(origin=origin, direction=direction, gain=gain, prefix=(nothing,))
        with woken_threads():
            dr.eval(rays)
            found: FrameArrays = compiled_frame(self._shape)(
                Flat(rays), self._flat_geometry, self._flat_tables, *self._records
            )
        return found


def _outward(
    origins: FloatArray, normals: FloatArray, count: int, first: int, towards_sun: FloatArray
) -> tuple[Any, Any, Any]:
    """Rays (origins, directions) from vertices, and the weights by which their radiance adds up to irradiance.

    They are spread as the cosine, each vertex's turned; but some are drawn about the sun by the angle of scattering,
    where open water is brightest by far. A direction that either might have taken counts by both densities (Veach &
    Guibas 1995, SIGGRAPH).
    """
    samples = SampleDirections.of(len(origins), count, first)
    # Numbers that differ from batch to batch are no part of a kernel: it would be compiled for each of them.
    vertex = samples.place - dr.opaque(UInt32, first)
    origin, normal = (dr.gather(Array3f32, vectors(rows), vertex) for rows in (origins, normals))
    sun = Array3f32(*opaque_numbers(towards_sun))
    about_sun = count // ABOUT_SUN
    about_normal = count - about_sun
    beyond = dr.opaque(UInt32, about_normal)
    spread = SampleDirections(samples.place, samples.number, about_normal)
    beside = SampleDirections(samples.place, samples.number - beyond, about_sun)
    cosine = dr.safe_sqrt(1 - spread.share)
    direction = dr.select(samples.number < beyond, spread.around(normal, cosine), scattered_directions(sun, beside))
    facing = dr.maximum(dr.dot(direction, normal), 0)
    spread_count, beside_count = opaque_numbers([about_normal, about_sun])
    density = spread_count * facing * dr.inv_pi + beside_count * scattered_density(dr.dot(direction, sun))
    return origin, direction, facing / dr.maximum(density, LEAST_DENSITY)
