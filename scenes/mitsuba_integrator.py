"""The fast light model as a Mitsuba integrator, `mirrorgaze_water`, for scenes that were not made here.

Rays of the scene's own sensor are followed over mirrors and through glass without any choice by chance; the first
surface that scatters light ends them. Water between is closed form, as in `scenes.kernels.shading`.
`docs/how-to/light_in_mitsuba.md` says what is left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from optics.kernels.backend import Bool, Float32, UInt32, dr, mi
from optics.kernels.packing import on_device
from rigs import Water
from scenes.kernels.shading import (
    Illumination,
    Segment,
    Spectrum,
    ambient_irradiance,
    channels,
    reflected_radiance,
    scattered_in,
    seen_through_surface,
)
from scenes.kernels.tracing import FAR_M, START_OFFSET_M
from scenes.light.field_table import layer
from scenes.light.light import Light, underwater_light
from scenes.light.sea import Sea
from scenes.light.sky import Daylight
from scenes.light.spectrum import water_bands
from scenes.light.sun import Sun
from scenes.light.uniforms import LightUniforms
from scenes.light.waves import Wind

NAME = "mirrorgaze_water"

LARGEST_BOUNCE_COUNT = 16
"""Delta surfaces and total reflections a ray may pass: a port and a housing's far wall take two each."""

LARGEST_GLASS_COUNT = 8
"""Panes that may stand between a surface and the sun."""

INDEX_TOLERANCE = 0.05
"""A ray is in water where the index it has come to is that close to the water's: ice and glass are farther off."""

REFRACTED_BRANCH = 1 - 2.0**-24
"""Random number at which a dielectric is left behind unless it reflects all light."""


@dataclass(kw_only=True)
class SensorPath:
    """State of the loop over segments: Dr.Jit arrays. Not frozen, as Dr.Jit writes into it.

    Attributes
    ----------
    bounce : UInt32
        Surfaces passed.
    ray : mi.Ray3f
        The next segment.
    active : Bool
        Whether it goes on.
    index : Float32
        Index of refraction of what it is in.
    throughput, rgb : list of Float32
        By wavelength, what of the light from here on arrives; by channel, the light found so far.
    lit, hit : Bool
        Whether it ends at a surface in the water; whether it hit one at all.
    """

    bounce: Any
    ray: Any
    active: Any
    index: Any
    throughput: Spectrum
    rgb: list[Any]
    lit: Any
    hit: Any


class WaterIntegrator(mi.SamplingIntegrator):  # type: ignore[misc]
    """What a camera sees in the sea: scene in metres, x east, y north, z up.

    Parameters
    ----------
    props : mi.Properties
        Any key of a rig file's `[water]` (`jerlov_type`, `iop_file`, ...); `sun_elevation_deg`, `sun_azimuth_deg` (from
        east towards north) and `cloud`; `surface_z`, the height of the sea surface in the scene (0 by default);
        `camera_in_water` (true by default; false for a camera in a housing, behind a dielectric).
    """

    def __init__(self, props: Any):
        super().__init__(props)
        self._surface_z = float(props.get("surface_z", 0.0))
        self._camera_in_water = bool(props.get("camera_in_water", True))
        self._light = light_of(props)
        self._tables = self._light.tables()
        self._uniforms: LightUniforms | None = None

    def render(  # noqa: PLR0917 - Mitsuba's own
        self,
        scene: Any,
        sensor: Any = 0,
        seed: Any = 0,
        spp: int = 0,
        develop: bool = True,
        evaluate: bool = True,
    ) -> Any:
        """Render the scene; light divides among a channel's wavelengths as it does at the sensor's depth."""
        if isinstance(sensor, int):
            sensor = scene.sensors()[sensor]
        self._uniforms = self._uniforms_for(sensor)
        return super().render(scene, sensor, seed, spp, develop, evaluate)

    def sample(self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> Any:
        """Radiance along rays, whether they hit anything, and no further values; nothing is sampled.

        Derivatives are not followed.
        """
        if self._uniforms is None:
            self._uniforms = self._uniforms_for(scene.sensors()[0])
        light = self._uniforms
        with dr.suspend_grad():
            path = self._follow(light, scene, mi.Ray3f(ray), Bool(active))
            reflected = self._lit(light, scene, path)
            rgb = [a + b for a, b in zip(path.rgb, reflected, strict=True)]
        return mi.Color3f(*rgb), path.hit, []

    def to_string(self) -> str:
        """What Mitsuba prints of a scene."""
        return f"WaterIntegrator[{self._light.daylight.sun}, surface_z = {self._surface_z:g}]"

    def _uniforms_for(self, sensor: Any) -> LightUniforms:
        height = float(sensor.world_transform().translation().z[0])
        flat_sea = Sea(light=self._light, wind=Wind(speed_m_per_s=0.0))
        light = on_device(flat_sea.uniforms(max(self._surface_z - height, 0.0)))
        self._tables = replace(self._tables, field_layer=layer(light, self._tables.field, light.reference_depth_m))
        dr.eval(light, self._tables.field_layer)
        return light

    def _follow(self, light: LightUniforms, scene: Any, ray: Any, active: Any) -> SensorPath:
        count = dr.width(ray)
        start = SensorPath(
            bounce=dr.zeros(UInt32, count),
            ray=ray,
            active=active & dr.full(Bool, True, count),
            index=dr.full(Float32, self._light.n_water if self._camera_in_water else 1.0, count),
            throughput=[dr.ones(Float32, count) for _ in light.beam_attenuation],
            rgb=[dr.zeros(Float32, count) for _ in range(3)],
            lit=dr.zeros(Bool, count),
            hit=dr.zeros(Bool, count),
        )

        def segment(path: SensorPath) -> tuple[SensorPath]:
            return (self._segment(path, light, scene),)

        found: tuple[SensorPath] = dr.while_loop((start,), lambda path: path.active, segment)
        return found[0]

    def _segment(self, path: SensorPath, light: LightUniforms, scene: Any) -> SensorPath:
        """One more segment of the path: up to the next surface, or to where the sea ends."""
        ray, active = path.ray, path.active
        found = scene.ray_intersect(ray, active)
        distance = dr.select(found.is_valid(), found.t, FAR_M)
        in_water = active & self._is_water(path.index)
        depth, rise = self._surface_z - ray.o.z, ray.d.z
        to_surface = dr.select(in_water & (rise > 0) & (depth > 0), depth / rise, FAR_M)
        at_surface = to_surface < distance
        length = dr.minimum(distance, to_surface)
        added, dimmed = scattered_in(
            light,
            self._tables,
            path.throughput,
            Segment(
                direction=ray.d,
                depth=depth,
                length=length,
                active=in_water,
                sunlit=mi.Float(1),
                end_radius=mi.Float(0),
                leans=mi.Bool(False),
                veiling_light=[mi.Float(0)] * 3,
            ),
        )
        throughput = [dr.select(in_water, after, t) for after, t in zip(dimmed, path.throughput, strict=True)]
        up = mi.Vector3f(0, 0, 1)
        sky, below_surface, _ = seen_through_surface(light, self._tables.sky, throughput, ray.d, up)

        solid = active & found.is_valid() & ~at_surface
        shines = found.emitter(scene).eval(found, solid)
        bsdf = found.bsdf(ray)
        scatters = mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        passes = solid & ~scatters
        chosen, weight = bsdf.sample(mi.BSDFContext(), found, REFRACTED_BRANCH, mi.Point2f(0.5), passes)
        # Mitsuba's weight is over the chance of the branch, which is not left to chance here.
        weight = weight * chosen.pdf

        rgb = zip(path.rgb, added, channels(light, sky), channels(light, _coloured(throughput, shines)), strict=True)
        bounce = path.bounce + 1
        goes_on = (at_surface | passes) & (bounce < LARGEST_BOUNCE_COUNT)
        behind = found.spawn_ray(found.to_world(chosen.wo))
        reflected = mi.Vector3f(ray.d.x, ray.d.y, -rise)
        below = mi.Ray3f(ray(to_surface) + reflected * START_OFFSET_M, reflected)
        onward = dr.select(at_surface, below, behind)
        return SensorPath(
            bounce=bounce,
            ray=dr.select(goes_on, onward, ray),
            active=goes_on,
            index=dr.select(passes, path.index * chosen.eta, path.index),
            throughput=[
                dr.select(at_surface, s, dr.select(passes, w, t))
                for t, s, w in zip(throughput, below_surface, _coloured(throughput, weight), strict=True)
            ],
            rgb=[
                total + dr.select(in_water, water, 0) + dr.select(at_surface, above, 0) + dr.select(solid, own, 0)
                for total, water, above, own in rgb
            ],
            # In the air of a housing there is no light.
            lit=path.lit | (solid & scatters & in_water),
            hit=path.hit | solid,
        )

    def _lit(self, light: LightUniforms, scene: Any, path: SensorPath) -> list[Any]:
        """Light that the surfaces at the ends of the paths send back, by channel."""
        ray, lit = path.ray, path.lit
        found = scene.ray_intersect(ray, lit)
        bsdf = found.bsdf(ray)
        depth = self._surface_z - found.p.z
        towards_sun = mi.Vector3f(*light.refracted_sun)
        from_sun = bsdf.eval(mi.BSDFContext(), found, found.to_local(towards_sun), lit)
        bright = lit & (dr.max(from_sun) > 0)
        in_sun = self._reaches_sun(scene, found, towards_sun, depth, bright)
        faces = mi.has_flag(bsdf.flags(), mi.BSDFFlags.BackSide) | (found.wi.z > 0)
        reflectance = bsdf.eval_diffuse_reflectance(found, lit) & faces
        normal = dr.mulsign(found.sh_frame.n, found.wi.z)
        ambient = ambient_irradiance(light, self._tables.ambient, normal, depth)
        # The cosine to the sun is within `from_sun` already.
        by_sun = self._reflected(light, path, from_sun * dr.pi, depth, sun_cosine=dr.select(in_sun, Float32(1), 0))
        by_others = self._reflected(light, path, reflectance, depth, ambient=ambient)
        return [dr.select(lit, a + b, 0) for a, b in zip(by_sun, by_others, strict=True)]

    def _reflected(
        self,
        light: LightUniforms,
        path: SensorPath,
        albedo: Any,
        depth: Any,
        *,
        ambient: Any = None,
        sun_cosine: Any = 0,
    ) -> list[Any]:
        """Light that a surface of an albedo by channel sends back under the sun or under other light."""
        throughput = path.throughput
        return reflected_radiance(
            light,
            throughput,
            albedo=_coloured([Float32(1) for _ in throughput], albedo),
            depth=depth,
            illumination=Illumination(
                ambient=ambient or [Float32(0)] * 3,
                sun_cosine=Float32(sun_cosine),
                flicker=[Float32(1) for _ in throughput],
                lamps=[Float32(0) for _ in throughput],
            ),
        )

    def _reaches_sun(self, scene: Any, found: Any, towards_sun: Any, depth: Any, active: Any) -> Any:
        """Whether nothing opaque stands between surfaces and the sun; glass lets its light through unbent."""
        ray = found.spawn_ray(towards_sun)
        # What is above the surface throws no shadow: it is not in the water.
        ray.maxt = dr.maximum(depth, 0) / towards_sun.z
        start = (ray, Bool(active), Bool(active), dr.zeros(UInt32, dr.width(ray)))

        def pane(ray: Any, free: Any, tried: Any, count: Any) -> tuple[Any, ...]:
            hit = scene.ray_intersect(ray, tried)
            blocks = hit.is_valid() & ~mi.has_flag(hit.bsdf(ray).flags(), mi.BSDFFlags.Transmission)
            blocks = blocks | (count == LARGEST_GLASS_COUNT)
            onward = hit.spawn_ray(towards_sun)
            onward.maxt = ray.maxt - hit.t
            goes_on = tried & hit.is_valid() & ~blocks
            return dr.select(goes_on, onward, ray), free & ~(tried & blocks), goes_on, count + 1

        return dr.while_loop(start, lambda ray, free, tried, count: tried, pane)[1]

    def _is_water(self, index: Any) -> Any:
        return dr.abs(index - self._light.n_water) < INDEX_TOLERANCE


def light_of(props: Any) -> Light:
    """Light and water that an integrator's properties describe.

    Raises
    ------
    ValueError
        With everything that is wrong.
    """
    wavelength = water_bands().wavelength_nm
    problems: list[str] = []

    def tried(make: Callable[[], Any]) -> Any:
        try:
            return make()
        except ValueError as error:
            problems.append(str(error))

    water = tried(lambda: Water.model_validate({name: props[name] for name in Water.model_fields if name in props}))
    angles = {name: float(props[f"sun_{name}"]) for name in ("elevation_deg", "azimuth_deg") if f"sun_{name}" in props}
    sun = tried(lambda: Sun(**angles))
    cloud = float(props.get("cloud", 0.0))
    daylight = tried(lambda: Daylight(wavelength_nm=wavelength, sun=sun or Sun(), cloud=cloud))
    if problems:
        raise ValueError(f"{NAME}: {'; '.join(problems)}")
    return underwater_light(water, daylight, water_bands())


def _coloured(throughput: Spectrum, colour: Any) -> Spectrum:
    """Throughput times a colour; wavelengths within a channel share its number."""
    nodes = len(throughput) // 3
    return [t * colour[k // nodes] for k, t in enumerate(throughput)]


@cache
def register() -> None:
    """Make `{"type": "mirrorgaze_water"}` known to Mitsuba, in the variant that `optics.kernels.backend` has chosen."""
    mi.register_integrator(NAME, WaterIntegrator)
