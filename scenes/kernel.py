"""Kernel of a frame: rays followed over mirrors and sea surface to what they show, and what they show.

Every ray is followed exactly: port once (its exit rays do not depend on the joints), then plane by plane over the
mirrors and the sea surface, Fresnel's factors as weights. The first Lambertian surface ends it. Nothing is random, so
one sample per pixel has no noise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

from optics.backend import Array3f32, Bool, Float32, UInt32, dr
from optics.mesh import Group
from optics.refraction import reflect
from optics.status import Region
from scenes.ambient_cube import changed_irradiance
from scenes.field_table import layer
from scenes.flicker import flicker
from scenes.frame import Label
from scenes.geometry import ROW, WORLD, FaceColumn, VertexColumn, face_code, from_octahedron
from scenes.lamps import lamp_backscatter, lamp_irradiance, towards_lamps
from scenes.light import SPECTRUM_ROW
from scenes.materials import Material
from scenes.packing import Numbers, Packing, row_of, vector
from scenes.shading import (
    SHORT_M,
    Illumination,
    Segment,
    Spectrum,
    ambient_irradiance,
    channels,
    mirror_throughput,
    reflected_radiance,
    scattered_in,
    seen_through_surface,
    volume_scattering,
)
from scenes.sun_map import reached_by_sun, sunlit_way
from scenes.tracing import (
    BACKS,
    FAR_M,
    FRONTS,
    START_OFFSET_M,
    Hit,
    Known,
    Thing,
    is_free,
    mirror_normal,
    move,
    nearest,
    nothing_known,
    pose_of,
    turn,
    turn_back,
)
from scenes.waves import surface_normal

LAMP_CLEARANCE_M = 0.03
"""Nothing this near to a lamp is in its own light's way: the lamp's housing."""

RENDERERS = 1000
"""So many recordings of a kernel are no sign of a mistake."""

RIG_GROUPS = tuple(str(group) for group in Group)
"""Names of the groups that are parts of the robot."""

LARGEST_BOUNCE_COUNT = 6
"""Mirrors and total reflections a ray may pass: two for the gaze, two more when the camera sees itself, the rest for
the sea surface."""

LEAST_FACET_COSINE = 0.02
"""Between the view and the normal of a facet of the sea."""

SHADOW_OFFSET_M = 1e-4
"""How far a shadow ray starts off its surface: hits at tank scale are placed to about 1e-6 m in single precision."""


@dataclass(frozen=True, kw_only=True)
class Inputs:
    """What a kernel computes from: rays, geometry and tables as they are handed over, numbers unpacked."""

    rays: dict[str, Any]
    geometry: dict[str, Any]
    tables: dict[str, Any]
    light: Numbers
    state: Numbers
    wavelengths: int


@dataclass(frozen=True)
class Shape:
    """What a kernel is compiled for.

    Attributes
    ----------
    light, state : Packing
        Order of the packed numbers.
    wavelengths, states : int
    truth : bool
        Whether more than radiance and label is asked for.
    """

    light: Packing
    state: Packing
    wavelengths: int
    states: int
    truth: bool


@cache
def compiled_frame(shape: Shape) -> Callable[..., Any]:
    """Frozen kernel of one or several frames."""

    # Every renderer has scenes of its own, for which the recording is made again.
    @dr.freeze(warn_after=RENDERERS)
    def frame(
        rays: dict[str, Any], geometry: dict[str, Any], tables: dict[str, Any], light_row: Any, state_rows: Any
    ) -> Any:
        light = shape.light.unpack(light_row, UInt32(0))
        state = shape.state.unpack(state_rows, UInt32(0) if shape.states == 1 else rays["state"])
        # Numbers that all lanes share are unpacked by a small kernel of their own: the large one reads each once.
        tables = tables | {"field_layer": layer(light, tables["field"], light["reference_depth"][0])}
        dr.eval(light, tables["field_layer"], *([state] if shape.states == 1 else []))
        inputs = Inputs(
            rays=rays, geometry=geometry, tables=tables, light=light, state=state, wavelengths=shape.wavelengths
        )
        path = _follow(inputs)
        seen, reflected = _describe(path, inputs)
        rgb = [rays["gain"] * (a + b) for a, b in zip(path["rgb"], reflected, strict=True)]
        return {"rgb": rgb, **(seen if shape.truth else {"label": seen["label"]})}

    return frame  # type: ignore[no-any-return]


@cache
def compiled_prefix(state: Packing) -> Callable[..., Any]:
    """Frozen kernel of what no joint moves: where rays of the port, and of M1 behind it, meet the fixed group."""

    @dr.freeze(warn_after=RENDERERS)
    def prefix(rays: dict[str, Any], groups: dict[str, dict[str, Any]], state_rows: Any) -> Any:
        numbers = state.unpack(state_rows, UInt32(0))
        static = {name: value for name, value in numbers.items() if name in (Thing.M1.name, WORLD)}
        static["ball"], static["clearance_m"] = [Float32(0)] * 4, [Float32(0)]
        # The sea is out of the way: its pose is replaced by one far below.
        static[WORLD] = [Float32(x) for x in (1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, -FAR_M)]
        fixed = {name: group for name, group in groups.items() if name == str(Group.FIXED)}
        found = []
        origin, direction, active = rays["origin"], rays["direction"], rays["gain"] > 0
        for _ in range(2):
            hit = nearest(fixed, static, origin, direction, active=active, known=nothing_known())
            on_fixed = hit.thing >= int(Thing.FIRST_GROUP)
            found.append({"distance": dr.select(on_fixed, hit.distance, FAR_M), "face": hit.face})
            if Thing.M1.name not in static:
                break
            folded = hit.thing == int(Thing.M1)
            reflected = reflect(direction, mirror_normal(static[Thing.M1.name]))
            origin = dr.select(folded, origin + direction * hit.distance + reflected * START_OFFSET_M, origin)
            direction = dr.select(folded, reflected, direction)
        return found

    return prefix  # type: ignore[no-any-return]


def _follow(inputs: Inputs) -> dict[str, Any]:
    """Follow rays over mirrors and sea surface to the first Lambertian surface or into open water.

    `seen_point` and `distance` are those of the first thing that sends light of its own into the view; behind the sea
    surface, which lets some light through and reflects the rest, the ray goes on for its radiance alone.
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
    names = list(inputs.geometry["groups"])
    on_world = hit.thing == Thing.FIRST_GROUP + names.index(WORLD) if WORLD in names else Bool(False)
    through = Segment(
        direction=world_direction,
        depth=depth,
        length=hit.distance,
        active=active,
        on_world=active & on_world,
        sunlit=_sunlit_way(inputs, origin, world_direction, hit, active),
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
    at_m1 = hit.thing == int(Thing.M1)
    at_mirror = at_m1 | (hit.thing == int(Thing.M2))
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
    gazed = (hit.thing == int(Thing.M2)) & (path["region"] == int(Region.FOLD))
    return {
        "bounce": bounce,
        "origin": dr.select(goes_on, point + reflected * START_OFFSET_M, dr.select(active, point, origin)),
        "direction": dr.select(goes_on, reflected, direction),
        "active": goes_on,
        "distance": dr.select(path["unseen"] & active, path["distance"] + hit.distance, path["distance"]),
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


def _describe(path: dict[str, Any], inputs: Inputs) -> tuple[dict[str, Any], list[Any]]:
    """What the paths end at, and the light by channel that the Lambertian surfaces among them send back."""
    geometry, light, state = inputs.geometry, inputs.light, inputs.state
    thing, point, direction = path["thing"], path["origin"], path["direction"]
    lit = thing >= int(Thing.M1_BACK)
    lit = lit & (thing != int(Thing.SEA_SURFACE))
    on_group = thing >= int(Thing.FIRST_GROUP)
    row = path["face"]
    for position, group in enumerate(geometry["groups"].values()):
        row = dr.select(thing == Thing.FIRST_GROUP + position, path["face"] + UInt32(group["offset"]), row)
    face = row_of(geometry["faces"], dr.select(on_group, row, 0), ROW)
    local = Array3f32(*face[FaceColumn.NORMAL : FaceColumn.NORMAL + 3])
    of_face, label, textured, baked = face_code(face[FaceColumn.CODE])
    textured, baked = on_group & textured, on_group & baked
    smooth, colour, ambient = _blended_corners(geometry["vertices"], face, textured, path["u"], path["v"])
    flat_normal = _in_body(local, thing, geometry["groups"], state, point)
    shading_normal = _in_body(dr.select(textured, smooth, local), thing, geometry["groups"], state, point)
    # Faces are two-sided: what is seen is turned towards the ray.
    side = dr.select(dr.dot(flat_normal, direction) > 0, Float32(-1), Float32(1))
    flat_normal, shading_normal = flat_normal * side, dr.normalize(shading_normal * side)

    material = dr.select(on_group, of_face, UInt32(int(Material.MIRROR_BACK)))
    material = dr.select(thing == int(Thing.BALL), UInt32(state["ball_material"][0]), material)
    towards_sun = vector(state, "towards_sun")
    sun_cosine = dr.maximum(dr.dot(shading_normal, towards_sun), 0) * _sunlit(
        inputs, point, flat_normal, lit & (dr.dot(flat_normal, towards_sun) > 0)
    )

    def share_of_surroundings(normal: Any, place: Any, ambient: list[Any]) -> list[Any]:
        around = ambient_irradiance(light, inputs.tables["ambient"], normal, -place.z)
        if "volume" in geometry:
            changes = changed_irradiance(geometry["volume"], place, normal)
            around = [dr.maximum(a + change, 0) for a, change in zip(around, changes, strict=True)]
        return [share * a for share, a in zip(ambient, around, strict=True)]

    def as_gathered(normal: Any, place: Any, ambient: list[Any]) -> list[Any]:
        return ambient

    place, outward = move(state[WORLD], point), turn(state[WORLD], shading_normal)
    ambient = dr.if_stmt((outward, place, ambient), lit & ~baked, share_of_surroundings, as_gathered)
    illumination = Illumination(
        ambient=ambient,
        sun_cosine=sun_cosine,
        flicker=_flicker(inputs, place, sun_cosine > 0),
        lamps=_lamps(inputs, point, shading_normal, flat_normal, lit),
    )
    reflected = reflected_radiance(
        light,
        path["throughput"],
        albedo=_albedo(material, colour, inputs),
        depth=-place.z,
        illumination=illumination,
    )
    seen_normal = dr.select(
        path["surface_seen"], turn_back(state[WORLD], Array3f32(0, 0, -1)), dr.select(lit, flat_normal, 0)
    )
    return {
        "distance": path["distance"],
        "point": move(state[WORLD], path["seen_point"]),
        "normal": turn(state[WORLD], seen_normal),
        "label": _label(path, label, on_group),
        "region": path["region"],
        "instance": _instance(path, face[FaceColumn.INSTANCE], on_group, state),
    }, [dr.select(lit, channel, 0) for channel in reflected]


def _blended_corners(vertices: Any, face: list[Any], textured: Any, u: Any, v: Any) -> tuple[Any, list[Any], list[Any]]:
    """Normal, colour and baked light between the corners of faces."""
    rows = [row_of(vertices, dr.select(textured, UInt32(face[FaceColumn.CORNERS + k]), 0), ROW) for k in range(3)]
    shares = (1 - u - v, u, v)
    normals = [from_octahedron(*row[VertexColumn.NORMAL : VertexColumn.COLOUR]) for row in rows]
    normal = sum((n * s for n, s in zip(normals, shares, strict=True)), Array3f32(0))
    blended = [sum((row[k] * s for row, s in zip(rows, shares, strict=True)), Float32(0)) for k in range(ROW)]
    return normal, blended[VertexColumn.COLOUR : VertexColumn.AMBIENT], blended[VertexColumn.AMBIENT :]


def _sunlit(inputs: Inputs, point: Any, normal: Any, active: Any) -> Any:
    """Share of the sun that reaches points of the body frame: 0 in the shadow, 1 in the light."""
    groups, state = inputs.geometry["groups"], inputs.state
    share = dr.select(active, Float32(1), Float32(0))
    if "sun_map" in inputs.geometry:
        place, outward = move(state[WORLD], point), turn(state[WORLD], normal)
        share = dr.select(active, reached_by_sun(inputs.geometry["sun_map"], place, outward), 0)
        groups = {name: group for name, group in groups.items() if name != WORLD}
    towards_sun = vector(state, "towards_sun")
    start = point + normal * SHADOW_OFFSET_M
    free = is_free(groups, state, start, towards_sun, Float32(FAR_M), share > 0)
    return dr.select(free, share, 0)


def _sunlit_way(inputs: Inputs, origin: Any, direction: Any, hit: Hit, active: Any) -> Any:
    """Share of a way, from the body frame's `origin` along the world frame's `direction`, that lies in the sun.

    The world's shadow is followed along long ways. The robot's is looked for half way to its own parts, where it makes
    the difference between a dark hull and one behind a veil of light.
    """
    state = inputs.state
    share = Float32(1)
    if "sun_map" in inputs.geometry:
        grid, attenuation = inputs.geometry["sun_map"], inputs.light["c"][inputs.wavelengths // 2]
        share = dr.if_stmt(
            (origin, direction, hit.distance),
            active & (hit.distance > SHORT_M),
            lambda origin, direction, length: sunlit_way(
                grid, move(state[WORLD], origin), direction, length, attenuation
            ),
            lambda origin, direction, length: Float32(1),
        )
    groups = {name: group for name, group in inputs.geometry["groups"].items() if name in RIG_GROUPS}
    if not groups:
        return share
    names = list(inputs.geometry["groups"])
    on_robot = Bool(False)
    for name in groups:
        on_robot = on_robot | (hit.thing == Thing.FIRST_GROUP + names.index(name))
    middle = origin + turn_back(state[WORLD], direction) * (hit.distance / 2)
    towards_sun = vector(state, "towards_sun")
    free = is_free(groups, state, middle, towards_sun, Float32(FAR_M), active & on_robot)
    return dr.select(on_robot & ~free, 0, share)


def _flicker(inputs: Inputs, place: Any, in_sun: Any) -> Spectrum:
    """Factor of the waves' flicker on the sun at points of the world frame, by wavelength."""
    steady: Spectrum = [Float32(1)] * inputs.wavelengths
    if "flicker_mix" not in inputs.light:
        return steady
    numbers = {**inputs.light, **inputs.state}

    def flickering(place: Any) -> Spectrum:
        return flicker(numbers, inputs.tables["flicker"], place, -place.z)

    return dr.if_stmt((place,), in_sun, flickering, lambda place: steady)  # type: ignore[no-any-return]


def _lamps(inputs: Inputs, point: Any, normal: Any, flat_normal: Any, lit: Any) -> Spectrum:
    """Irradiance of the lamps at points of the body frame, by wavelength, with a shadow ray to each."""
    if "lamp_exponent" not in inputs.light:
        return [Float32(0)] * inputs.wavelengths
    start = point + flat_normal * SHADOW_OFFSET_M
    groups, state = inputs.geometry["groups"], inputs.state
    reached = [
        is_free(
            groups, state, start, direction, distance - LAMP_CLEARANCE_M, lit & (dr.dot(flat_normal, direction) > 0)
        )
        for direction, distance in towards_lamps(inputs.light, point)
    ]
    return lamp_irradiance(inputs.light, point, normal, inputs.light["c"], reached)


def _in_body(local: Any, thing: Any, groups: dict[str, dict[str, Any]], state: Numbers, point: Any) -> Any:
    """Normal of what was hit, turned from its own frame into the body's."""
    normal = point - Array3f32(*state["ball"][:3])  # of the ball
    for position, name in enumerate(groups):
        pose = pose_of(state, name)
        turned = local if pose is None else turn_back(pose, local)
        normal = dr.select(thing == Thing.FIRST_GROUP + position, turned, normal)
    for front, back in zip(FRONTS, BACKS, strict=True):
        if front.name in state:
            normal = dr.select(thing == int(back), -mirror_normal(state[front.name]), normal)
    return dr.normalize(normal)


def _albedo(material: Any, colour: list[Any], inputs: Inputs) -> Spectrum:
    """Reflectance of the material times the vertices' colour."""
    light = inputs.light
    palette = row_of(inputs.tables["albedo"], material, SPECTRUM_ROW)
    red, green, blue = colour
    return [
        palette[k] * (light["basis_red"][k] * red + light["basis_green"][k] * green + light["basis_blue"][k] * blue)
        for k in range(inputs.wavelengths)
    ]


def _label(path: dict[str, Any], of_face: Any, on_group: Any) -> Any:
    thing = path["thing"]
    label = dr.select(on_group, of_face, UInt32(int(Label.OPEN_WATER)))
    for things, meaning in (
        (FRONTS, Label.MIRROR),
        (BACKS, Label.MIRROR_BACK),
        ((Thing.SEA_SURFACE,), Label.SURFACE),
        ((Thing.BALL,), Label.TARGET),
    ):
        for each in things:
            label = dr.select(thing == int(each), UInt32(int(meaning)), label)
    label = dr.select(path["surface_seen"], UInt32(int(Label.SURFACE)), label)
    return dr.select(path["region"] == int(Region.HOUSING), UInt32(int(Label.HOUSING)), label)


def _instance(path: dict[str, Any], of_face: Any, on_group: Any, state: Numbers) -> Any:
    """Instance of what is seen, counted from one; zero for none."""
    number = dr.select(on_group & ~path["surface_seen"], UInt32(of_face + 1), UInt32(0))
    on_ball = (path["thing"] == int(Thing.BALL)) & ~path["surface_seen"]
    return dr.select(on_ball, UInt32(state["ball_instance"][0]), number)
