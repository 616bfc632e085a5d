"""Kernel: rays followed over mirrors and sea surface, segment by segment, to the things that they show."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from optics.backend import Array3f32, Bool, Float32, UInt32, dr
from optics.status import Region
from scenes.group_mesh import SNOW, TARGET, WORLD
from scenes.lamps import lamp_backscatter
from scenes.packing import Numbers, vector
from scenes.shading import (
    SHORT_M,
    Segment,
    Spectrum,
    channels,
    mirror_throughput,
    scattered_in,
    seen_through_surface,
    volume_scattering,
)
from scenes.sun_map import sunlit_way
from scenes.tracing import (
    BACKS,
    FRONTS,
    START_OFFSET_M,
    Hit,
    Known,
    Thing,
    mirror_normal,
    move,
    nearest,
    turn,
    turn_back,
)
from scenes.veil import ELEVATIONS, drawn_veil, veil
from scenes.waves import surface_normal

LARGEST_BOUNCE_COUNT = 6
"""Mirrors and total reflections a ray may pass: two for the gaze, two more when the camera sees itself, the rest for
the sea surface."""

LEAST_FACET_COSINE = 0.02
"""Between the view and the normal of a facet of the sea."""

PART_RADIUS_M = 0.15
"""What is seen keeps light from the water before it as a disc would: mirrors and a ball have a radius of their own,
hull, mount and other targets have this one. The hull is larger: some of the water that it hides counts as lit."""

BESIDE_SUN_COSINE = math.cos(math.pi / (ELEVATIONS - 1))
"""Within one node of it the robot's table cannot tell what stands before the sun from what is beside it."""


@dataclass(frozen=True, kw_only=True)
class Inputs:
    """What a kernel computes from: rays, geometry and tables as they are handed over, numbers unpacked."""

    rays: dict[str, Any]
    geometry: dict[str, Any]
    tables: dict[str, Any]
    light: Numbers
    state: Numbers
    wavelengths: int
    eyes: int


def follow(inputs: Inputs) -> dict[str, Any]:
    """Follow rays over mirrors and sea surface to the first Lambertian surface or into open water.

    `length` is that of the last segment. `seen_point` and `distance` are those of the first thing that sends light of
    its own into the view; behind the sea surface, which lets some light through and reflects the rest, the ray goes on
    for its radiance alone.
    """
    rays = inputs.rays
    alive = rays["gain"] > 0
    count = dr.width(rays["gain"])
    start = {
        "bounce": dr.zeros(UInt32, count),
        "origin": Array3f32(rays["origin"]),
        "direction": Array3f32(rays["direction"]),
        "active": Bool(alive),
        "distance": dr.zeros(Float32, count),
        "length": dr.zeros(Float32, count),
        "throughput": [dr.ones(Float32, count) for _ in range(inputs.wavelengths)],
        "rgb": [dr.zeros(Float32, count) for _ in range(3)],
        "region": dr.select(alive, UInt32(int(Region.DIRECT)), UInt32(int(Region.HOUSING))),
        "unseen": Bool(alive),
        "surface_seen": dr.zeros(Bool, count),
        "seen_point": dr.zeros(Array3f32, count),
        "thing": dr.zeros(UInt32, count),
        "face": dr.zeros(UInt32, count),
        "u": dr.zeros(Float32, count),
        "v": dr.zeros(Float32, count),
    }

    def segment(path: dict[str, Any]) -> tuple[dict[str, Any]]:
        return (_segment(path, inputs),)

    return dr.while_loop((start,), lambda path: path["active"], segment)[0]  # type: ignore[no-any-return]


def _segment(path: dict[str, Any], inputs: Inputs) -> dict[str, Any]:
    light, state, tables = inputs.light, inputs.state, inputs.tables
    active, origin, direction = path["active"], path["origin"], path["direction"]
    hit = nearest(inputs.geometry["groups"], state, origin, direction, active=active, known=_known(path, inputs.rays))
    world_direction = turn(state[WORLD], direction)
    depth = -move(state[WORLD], origin).z
    radius, on_part = _end_radius(inputs, hit)
    at_m1, at_m2 = hit.thing == int(Thing.M1), hit.thing == int(Thing.M2)
    through = Segment(
        direction=world_direction,
        depth=depth,
        length=hit.distance,
        active=active,
        sunlit=_sunlit_way(inputs, origin, world_direction, hit.distance, active)
        * (1 - _behind_what_is_seen(inputs, world_direction, hit, radius)),
        # What the robot keeps from the water is in the veil already, but for what the gaze mirror hides.
        end_radius=dr.select((on_part | at_m1) & ("water" in inputs.geometry), 0, radius),
        leans=at_m1,
        veil=_veil(inputs, path, world_direction, hit.distance),
    )
    added, throughput = scattered_in(light, tables, path["throughput"], through)
    if "lamp_exponent" in light:
        from_lamps = lamp_backscatter(
            light,
            origin,
            direction,
            hit.distance,
            attenuation=light["c"],
            volume_scattering=lambda angle: volume_scattering(light, tables["phase"], angle),
        )
        from_lamps = [t * f for t, f in zip(path["throughput"], from_lamps, strict=True)]
        added = [a + f for a, f in zip(added, channels(light, from_lamps), strict=True)]
    at_mirror = at_m1 | at_m2
    at_surface = hit.thing == int(Thing.SEA_SURFACE)
    above = _at_sea_surface(inputs, origin + direction * hit.distance, world_direction, throughput, active & at_surface)
    normal = above["normal"]
    for front in FRONTS:
        if front.name in state:
            normal = dr.select(hit.thing == int(front), mirror_normal(state[front.name]), normal)
    cosine = -dr.dot(direction, normal)
    rgb = [
        total + dr.select(active, water + sky, 0)
        for total, water, sky in zip(path["rgb"], added, above["rgb"], strict=True)
    ]
    behind_mirror = mirror_throughput(light, throughput, cosine)
    throughput = [
        dr.select(at_surface, s, dr.select(at_mirror, m, t))
        for t, s, m in zip(throughput, above["throughput"], behind_mirror, strict=True)
    ]
    bounce = path["bounce"] + 1
    goes_on = active & (at_mirror | at_surface) & (bounce < LARGEST_BOUNCE_COUNT)
    seen = active & path["unseen"] & (~goes_on | (at_surface & above["passes"]))
    point = origin + direction * hit.distance
    reflected = direction + normal * (2 * cosine)
    # What a leaning facet of the sea would throw upwards meets the sea again: it is taken to go down at once.
    rise = dr.select(at_surface, turn(state[WORLD], reflected).z, 0)
    reflected = reflected - turn_back(state[WORLD], Array3f32(0, 0, 1)) * dr.select(rise > 0, 2 * rise, 0)
    folded = at_m1 & (path["region"] == int(Region.DIRECT))
    gazed = at_m2 & (path["region"] == int(Region.FOLD))
    return {
        "bounce": bounce,
        "origin": dr.select(goes_on, point + reflected * START_OFFSET_M, dr.select(active, point, origin)),
        "direction": dr.select(goes_on, reflected, direction),
        "active": goes_on,
        "distance": dr.select(path["unseen"] & active, path["distance"] + hit.distance, path["distance"]),
        "length": dr.select(active, hit.distance, path["length"]),
        "throughput": throughput,
        "rgb": rgb,
        "region": dr.select(
            active & gazed,
            UInt32(int(Region.GAZE)),
            dr.select(active & folded, UInt32(int(Region.FOLD)), path["region"]),
        ),
        "unseen": path["unseen"] & ~seen,
        "surface_seen": path["surface_seen"] | (seen & at_surface),
        "seen_point": dr.select(seen, point, path["seen_point"]),
        "thing": dr.select(active, hit.thing, path["thing"]),
        "face": dr.select(active, hit.face, path["face"]),
        "u": dr.select(active, hit.u, path["u"]),
        "v": dr.select(active, hit.v, path["v"]),
    }


def _at_sea_surface(inputs: Inputs, point: Any, direction: Any, throughput: Spectrum, active: Any) -> dict[str, Any]:
    """What the sea surface shows by channel, the throughput of what it reflects, its normal, and whether light passes.

    `point` is in the body frame, `direction` in the world frame. Most views see no surface, and pay for none.
    """
    light, world = inputs.light, inputs.state[WORLD]
    numbers = {**light, **inputs.state}

    def surface(point: Any, direction: Any, throughput: Spectrum) -> tuple[Any, ...]:
        upwards = Array3f32(0, 0, 1)
        if "wave_slope" in light:
            place = move(world, point)
            waved = surface_normal(numbers, place.x, place.y)
            # A facet that shows the eye its back is hidden behind the wave before it.
            upwards = dr.select(dr.dot(direction, waved) > LEAST_FACET_COSINE, waved, upwards)
        seen, reflected, passes = seen_through_surface(light, inputs.tables["sky"], throughput, direction, upwards)
        return turn_back(world, -upwards), channels(light, seen), reflected, passes

    def nothing(point: Any, direction: Any, throughput: Spectrum) -> tuple[Any, ...]:
        return turn_back(world, Array3f32(0, 0, -1)), [Float32(0)] * 3, throughput, Bool(False)

    names = ("normal", "rgb", "throughput", "passes")
    found = dr.if_stmt((point, direction, throughput), active, surface, nothing)
    return dict(zip(names, found, strict=True))


def _known(path: dict[str, Any], rays: dict[str, Any]) -> Known:
    """What was traced beforehand for the segment from the port, and for the one from M1 straight behind it."""
    first, second = rays["prefix"][0], rays["prefix"][-1]
    from_port = path["bounce"] == 0
    from_m1 = (path["bounce"] == 1) & (path["region"] == int(Region.FOLD))
    return Known(
        known=from_port | from_m1,
        distance=dr.select(from_port, first["distance"], second["distance"]),
        face=dr.select(from_port, first["face"], second["face"]),
    )


def _sunlit_way(inputs: Inputs, origin: Any, direction: Any, length: Any, active: Any) -> Any:
    """Share of a way, from the body frame's `origin` along the world frame's `direction`, that the world leaves lit.

    Its shadow is followed along long ways.
    """
    state = inputs.state
    if "sun_map" not in inputs.geometry:
        return Float32(1)
    grid, attenuation = inputs.geometry["sun_map"], inputs.light["c"][inputs.wavelengths // 2]
    return dr.if_stmt(
        (origin, direction, length),
        active & (length > SHORT_M),
        lambda origin, direction, length: sunlit_way(grid, move(state[WORLD], origin), direction, length, attenuation),
        lambda origin, direction, length: Float32(1),
    )


def _behind_what_is_seen(inputs: Inputs, direction: Any, hit: Hit, radius: Any) -> Any:
    """Share of a way that the thing at its end keeps the sun from: the target anywhere, the robot close to the sun.

    From the thing up to ``r / tan(a)``: a is the angle between the way and the sun's.
    """
    cosine = dr.dot(direction, vector(inputs.light, "refracted_sun"))
    on_target = hit.thing == int(Thing.BALL)
    names = list(inputs.geometry["groups"])
    if TARGET in names:
        on_target = on_target | (hit.thing == Thing.FIRST_GROUP + names.index(TARGET))
    slope = dr.safe_sqrt(1 - dr.square(cosine)) / dr.maximum(cosine, 1e-6)
    share = dr.minimum(radius / dr.maximum(slope * hit.distance, 1e-6), 1)
    return dr.select((cosine > 0) & (on_target | (cosine > BESIDE_SUN_COSINE)), share, 0)


def _end_radius(inputs: Inputs, hit: Hit) -> tuple[Any, Any]:
    """Radius of a disc that stands for what a way ends at, and whether that is a part of the robot.

    It is zero for the world, flakes and open water.
    """
    radius = dr.select(hit.thing == int(Thing.BALL), inputs.state["ball"][3], 0)
    for front, back in zip(FRONTS, BACKS, strict=True):
        if front.name in inputs.state:
            width, height = inputs.state[front.name][9:11]
            on_mirror = (hit.thing == int(front)) | (hit.thing == int(back))
            radius = dr.select(on_mirror, dr.sqrt(width * height), radius)
    on_part = Bool(False)
    for position, name in enumerate(inputs.geometry["groups"]):
        if name not in (WORLD, SNOW):
            on_group = hit.thing == Thing.FIRST_GROUP + position
            radius = dr.select(on_group, PART_RADIUS_M, radius)
            on_part = on_part if name == TARGET else on_part | on_group
    return radius, on_part


def _veil(inputs: Inputs, path: dict[str, Any], world_direction: Any, length: Any) -> list[Any]:
    """Light by channel that robot and world add to a line of sight of open water.

    It begins at the camera, or at the mirror that it comes from: those have a table. Of lines that begin anywhere, to
    be averaged, each is given an estimate.
    """
    geometry, tables = inputs.geometry, inputs.tables
    if "veil" in tables:
        eye = dr.maximum(path["region"], 1) - 1
        if "state" in inputs.rays:
            eye = eye + inputs.rays["state"] * UInt32(inputs.eyes)
        return veil(tables["veil"], eye, path["direction"], length)
    if "source" in geometry:
        seed = dr.arange(UInt32, dr.width(path["bounce"])) * LARGEST_BOUNCE_COUNT + path["bounce"]
        point = move(inputs.state[WORLD], path["origin"])
        return drawn_veil(geometry["source"], inputs.light, seed, point, world_direction, length)
    return [Float32(0)] * 3
