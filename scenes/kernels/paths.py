"""Kernel: paths over mirrors and sea surface, segment by segment, to what the camera sees."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from optics.kernels.backend import Array3f32, Bool, Float32, UInt32, dr
from optics.status import Region
from scenes.kernels.path_state import Inputs, Path
from scenes.kernels.shading import (
    SHORT_M,
    Segment,
    Spectrum,
    channels,
    mirror_throughput,
    scattered_in,
    seen_through_surface,
    volume_scattering,
)
from scenes.kernels.sun_map import sunlit_share
from scenes.kernels.tracing import BACKS, FRONTS, START_OFFSET_M, Hit, Known, Primitive, Rays, nearest
from scenes.kernels.veiling_light import ELEVATIONS, sampled_veiling_light, veiling_light
from scenes.light.lamps import lamp_backscatter
from scenes.light.waves import surface_normal
from scenes.stage.records import SNOW, WORLD, is_target_or_decoy

LARGEST_BOUNCE_COUNT = 6
"""Mirrors and total reflections a ray may pass: two for the gaze, two more when the camera sees itself, the rest for
the sea surface."""

LEAST_FACET_COSINE = 0.02
"""Between the view and the normal of a facet of the sea."""

PART_RADIUS_M = 0.15
"""What is seen shadows the water before it as a disc would: mirrors and a ball have a radius of their own, hull, mount
and other targets have this one. The hull is larger: some of the water that it hides counts as lit."""

BESIDE_SUN_COSINE = math.cos(math.pi / (ELEVATIONS - 1))
"""Within one node of it the robot's table cannot tell what stands before the sun from what is beside it."""


@dataclass(kw_only=True)
class SeaSurface:
    """What the sea surface shows: Dr.Jit arrays. Not frozen, as Dr.Jit writes into it.

    Attributes
    ----------
    normal : Array3f32
        Towards the water, body frame.
    rgb : list of Float32
        Light by channel that comes through it.
    throughput : list of Float32
        Of what it reflects.
    passes : Bool
        Whether light comes through.
    """

    normal: Any
    rgb: list[Any]
    throughput: Spectrum
    passes: Any


def follow(inputs: Inputs) -> Path:
    """Follow rays over mirrors and sea surface to the first Lambertian surface or into open water."""

    def segment(path: Path) -> tuple[Path]:
        return (_segment(path, inputs),)

    start = Path.along(inputs.rays, inputs.wavelengths)
    found: tuple[Path] = dr.while_loop((start,), lambda path: path.active, segment)
    return found[0]


def _segment(path: Path, inputs: Inputs) -> Path:
    """One more segment of the path, and the mirror or sea surface at its end."""
    state = inputs.state
    active, origin, direction = path.active, path.origin, path.direction
    hit = nearest(
        inputs.geometry.groups,
        state,
        origin,
        direction,
        active=active,
        known=_known(path, inputs.rays),
        coherent=inputs.coherent,
    )
    world_direction = state.world.turn(direction)
    added, throughput = _through_water(path, inputs, hit, world_direction)
    at_m1, at_m2 = hit.primitive == int(Primitive.M1), hit.primitive == int(Primitive.M2)
    at_mirror, at_surface = at_m1 | at_m2, hit.primitive == int(Primitive.SEA_SURFACE)
    point = origin + direction * hit.distance
    sea = _at_sea_surface(inputs, point, world_direction, throughput, active & at_surface)
    normal = sea.normal
    for front in FRONTS:
        if front.name in state.mirrors:
            normal = dr.select(hit.primitive == int(front), state.mirrors[front.name].normal, normal)
    cosine = -dr.dot(direction, normal)
    behind_mirror = mirror_throughput(inputs.light, throughput, cosine)
    bounce = path.bounce + 1
    goes_on = active & (at_mirror | at_surface) & (bounce < LARGEST_BOUNCE_COUNT)
    seen = active & path.unseen & (~goes_on | (at_surface & sea.passes))
    reflected = direction + normal * (2 * cosine)
    # What a leaning facet of the sea would throw upwards hits the sea again: it is taken to go down at once.
    rise = dr.select(at_surface, state.world.turn(reflected).z, 0)
    reflected = reflected - state.world.turn_back(Array3f32(0, 0, 1)) * dr.select(rise > 0, 2 * rise, 0)
    folded = at_m1 & (path.region == int(Region.DIRECT))
    gazed = at_m2 & (path.region == int(Region.FOLD))
    return Path(
        bounce=bounce,
        origin=dr.select(goes_on, point + reflected * START_OFFSET_M, dr.select(active, point, origin)),
        direction=dr.select(goes_on, reflected, direction),
        active=goes_on,
        distance=dr.select(path.unseen & active, path.distance + hit.distance, path.distance),
        length=dr.select(active, hit.distance, path.length),
        throughput=[
            dr.select(at_surface, s, dr.select(at_mirror, m, t))
            for t, s, m in zip(throughput, sea.throughput, behind_mirror, strict=True)
        ],
        rgb=[
            total + dr.select(active, water + sky, 0)
            for total, water, sky in zip(path.rgb, added, sea.rgb, strict=True)
        ],
        region=dr.select(
            active & gazed,
            UInt32(int(Region.GAZE)),
            dr.select(active & folded, UInt32(int(Region.FOLD)), path.region),
        ),
        unseen=path.unseen & ~seen,
        surface_seen=path.surface_seen | (seen & at_surface),
        seen_point=dr.select(seen, point, path.seen_point),
        primitive=dr.select(active, hit.primitive, path.primitive),
        face=dr.select(active, hit.face, path.face),
        u=dr.select(active, hit.u, path.u),
        v=dr.select(active, hit.v, path.v),
    )


def _through_water(path: Path, inputs: Inputs, hit: Hit, world_direction: Any) -> tuple[list[Any], Spectrum]:
    """Light by channel that the water scatters into a segment, the lamps' as well, and the throughput behind it."""
    light, tables = inputs.light, inputs.tables
    radius, on_part = _end_radius(inputs, hit)
    at_m1 = hit.primitive == int(Primitive.M1)
    through = Segment(
        direction=world_direction,
        depth=-inputs.state.world.move(path.origin).z,
        length=hit.distance,
        active=path.active,
        sunlit=_sunlit_share(inputs, path.origin, world_direction, hit.distance, path.active)
        * (1 - _behind_what_is_seen(inputs, world_direction, hit, radius)),
        # What the robot occludes from the water is in the veiling light already, but for what the gaze mirror hides.
        end_radius=dr.select((on_part | at_m1) & (inputs.geometry.shadow_in_water is not None), 0, radius),
        leans=at_m1,
        veiling_light=_veiling_light(inputs, path, world_direction, hit.distance),
    )
    added, throughput = scattered_in(light, tables, path.throughput, through)
    if light.lamps is not None:
        from_lamps = lamp_backscatter(
            light.lamps,
            path.origin,
            path.direction,
            hit.distance,
            attenuation=light.beam_attenuation,
            volume_scattering=lambda angle: volume_scattering(light, tables.phase, angle),
        )
        from_lamps = [t * f for t, f in zip(path.throughput, from_lamps, strict=True)]
        added = [a + f for a, f in zip(added, channels(light, from_lamps), strict=True)]
    return added, throughput


def _at_sea_surface(inputs: Inputs, point: Any, direction: Any, throughput: Spectrum, active: Any) -> SeaSurface:
    """What the sea surface shows at points of the body frame, along directions of the world frame.

    Most views see no surface, and pay for none.
    """
    light, world, sea = inputs.light, inputs.state.world, inputs.state.sea

    def surface(point: Any, direction: Any, throughput: Spectrum) -> SeaSurface:
        upwards = Array3f32(0, 0, 1)
        if light.waves is not None and sea is not None:
            place = world.move(point)
            waved = surface_normal(light.waves, sea.wave_turns, place.x, place.y)
            # A facet that shows the eye its back is hidden behind the wave before it.
            upwards = dr.select(dr.dot(direction, waved) > LEAST_FACET_COSINE, waved, upwards)
        seen, reflected, passes = seen_through_surface(light, inputs.tables.sky, throughput, direction, upwards)
        return SeaSurface(
            normal=world.turn_back(-upwards), rgb=channels(light, seen), throughput=reflected, passes=passes
        )

    def nothing(point: Any, direction: Any, throughput: Spectrum) -> SeaSurface:
        downwards = world.turn_back(Array3f32(0, 0, -1))
        return SeaSurface(normal=downwards, rgb=[Float32(0)] * 3, throughput=throughput, passes=Bool(False))

    found: SeaSurface = dr.if_stmt((point, direction, throughput), active, surface, nothing)
    return found


def _known(path: Path, rays: Rays) -> Known:
    """What was traced beforehand for the segment from the port, and for the one from M1 straight behind it."""
    first, second = rays.prefix[0], rays.prefix[-1]
    from_port = path.bounce == 0
    from_m1 = (path.bounce == 1) & (path.region == int(Region.FOLD))
    return Known(
        known=from_port | from_m1,
        distance=dr.select(from_port, first.distance, second.distance),
        face=dr.select(from_port, first.face, second.face),
    )


def _sunlit_share(inputs: Inputs, origin: Any, direction: Any, length: Any, active: Any) -> Any:
    """Share of a segment that the sun reaches past the world: `origin` in the body frame, `direction` in the world's.

    The world's shadow is followed along long segments.
    """
    world, grid = inputs.state.world, inputs.geometry.sun_map
    if grid is None:
        return Float32(1)
    attenuation = inputs.light.beam_attenuation[inputs.wavelengths // 2]
    return dr.if_stmt(
        (origin, direction, length),
        active & (length > SHORT_M),
        lambda origin, direction, length: sunlit_share(grid, world.move(origin), direction, length, attenuation),
        lambda origin, direction, length: Float32(1),
    )


def _behind_what_is_seen(inputs: Inputs, direction: Any, hit: Hit, radius: Any) -> Any:
    """Share of a segment that what it ends at shadows: target and decoys anywhere, the robot close to the sun.

    From its end up to ``r / tan(a)``: a is the angle between the segment and the sun's direction.
    """
    cosine = dr.dot(direction, Array3f32(*inputs.light.refracted_sun))
    on_target = hit.primitive == int(Primitive.BALL)
    for position, name in enumerate(inputs.geometry.groups):
        if is_target_or_decoy(name):
            on_target = on_target | (hit.primitive == Primitive.FIRST_GROUP + position)
    slope = dr.safe_sqrt(1 - dr.square(cosine)) / dr.maximum(cosine, 1e-6)
    share = dr.minimum(radius / dr.maximum(slope * hit.distance, 1e-6), 1)
    return dr.select((cosine > 0) & (on_target | (cosine > BESIDE_SUN_COSINE)), share, 0)


def _end_radius(inputs: Inputs, hit: Hit) -> tuple[Any, Any]:
    """Radius of a disc that stands for what a segment ends at, and whether that is a part of the robot.

    It is zero for the world, flakes and open water.
    """
    radius = dr.select(hit.primitive == int(Primitive.BALL), inputs.state.ball.radius, 0)
    for front, back in zip(FRONTS, BACKS, strict=True):
        if front.name in inputs.state.mirrors:
            mirror = inputs.state.mirrors[front.name]
            on_mirror = (hit.primitive == int(front)) | (hit.primitive == int(back))
            radius = dr.select(on_mirror, dr.sqrt(mirror.outline.half_width * mirror.outline.half_height), radius)
    on_part = Bool(False)
    for position, name in enumerate(inputs.geometry.groups):
        if name not in (WORLD, SNOW):
            on_group = hit.primitive == Primitive.FIRST_GROUP + position
            radius = dr.select(on_group, PART_RADIUS_M, radius)
            on_part = on_part if is_target_or_decoy(name) else on_part | on_group
    return radius, on_part


def _veiling_light(inputs: Inputs, path: Path, world_direction: Any, length: Any) -> list[Any]:
    """Light by channel that robot and world add to a line of sight of open water.

    It begins at the camera, or at the mirror that it comes from: those have a table. Of lines that begin anywhere, to
    be averaged, each is given an estimate.
    """
    geometry, tables = inputs.geometry, inputs.tables
    if tables.veiling_light is not None:
        eye = dr.maximum(path.region, 1) - 1
        if inputs.rays.state is not None:
            eye = eye + inputs.rays.state * UInt32(inputs.eyes)
        return veiling_light(tables.veiling_light, eye, path.direction, length)
    if geometry.source is not None:
        seed = dr.arange(UInt32, dr.width(path.bounce)) * LARGEST_BOUNCE_COUNT + path.bounce
        point = inputs.state.world.move(path.origin)
        return sampled_veiling_light(geometry.source, inputs.light, seed, point, world_direction, length)
    return [Float32(0)] * 3
