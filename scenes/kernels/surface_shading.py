"""Kernel: the surfaces that paths end at, and the light that they send back."""

from __future__ import annotations

from typing import Any

from optics.kernels.backend import Array3f32, Float32, UInt32, dr
from optics.kernels.packing import row_of
from optics.status import Region
from scenes.kernels.ambient_cube import changed_irradiance
from scenes.kernels.geometry import ROW, FaceColumn, VertexColumn, face_code, from_octahedron
from scenes.kernels.path_state import Inputs, Path
from scenes.kernels.shading import Illumination, Spectrum, ambient_irradiance, reflected_radiance
from scenes.kernels.shadow_table import FARTHEST_M, ShadowTable, hidden_from_surface
from scenes.kernels.sun_map import reached_by_sun
from scenes.kernels.tracing import BACKS, FAR_M, FRONTS, GroupScene, Primitive, is_free, pose_of
from scenes.light.flicker import flicker
from scenes.light.forward_cone import gain_of_light, hidden_share
from scenes.light.lamps import lamp_irradiance, towards_lamps
from scenes.light.light import SPECTRUM_ROW
from scenes.light.materials import Material
from scenes.stage.frame import FrameArrays, Label, TruthArrays
from scenes.stage.records import WORLD, StateRecord, is_target_or_decoy

SHADOW_OFFSET_M = 1e-4
"""How far a shadow ray starts off its surface: hits at tank scale are placed to about 1e-6 m in single precision."""

LAMP_CLEARANCE_M = 0.03
"""Nothing this near to a lamp stops its own light: the lamp's housing."""


def shade(path: Path, inputs: Inputs) -> FrameArrays:
    """What paths show, with the light that the Lambertian surfaces at their ends send back."""
    geometry, light, state = inputs.geometry, inputs.light, inputs.state
    primitive, point, direction = path.primitive, path.origin, path.direction
    lit = primitive >= int(Primitive.M1_BACK)
    lit = lit & (primitive != int(Primitive.SEA_SURFACE))
    on_group = primitive >= int(Primitive.FIRST_GROUP)
    row = path.face
    for position, group in enumerate(geometry.groups.values()):
        row = dr.select(primitive == Primitive.FIRST_GROUP + position, path.face + UInt32(group.offset), row)
    face = row_of(geometry.faces, dr.select(on_group, row, 0), ROW)
    local = Array3f32(*face[FaceColumn.NORMAL : FaceColumn.NORMAL + 3])
    of_face, label, textured, baked = face_code(face[FaceColumn.CODE])
    textured, baked = on_group & textured, on_group & baked
    smooth, colour, ambient = _blended_corners(geometry.vertices, face, textured, path.u, path.v)
    flat_normal = _in_body(local, primitive, geometry.groups, state, point)
    shading_normal = _in_body(dr.select(textured, smooth, local), primitive, geometry.groups, state, point)
    # Faces are two-sided: what is seen is turned towards the ray.
    side = dr.select(dr.dot(flat_normal, direction) > 0, Float32(-1), Float32(1))
    flat_normal, shading_normal = flat_normal * side, dr.normalize(shading_normal * side)

    material = dr.select(on_group, of_face, UInt32(int(Material.MIRROR_BACK)))
    material = dr.select(primitive == int(Primitive.BALL), UInt32(state.ball.material), material)
    towards_sun = Array3f32(*state.towards_sun)
    open_to_sun, sunlit = _sunlit(inputs, point, flat_normal, lit & (dr.dot(flat_normal, towards_sun) > 0))

    def share_of_surroundings(normal: Any, place: Any, ambient: list[Any]) -> list[Any]:
        around = ambient_irradiance(light, inputs.tables.ambient, normal, -place.z)
        if geometry.irradiance is not None:
            changes = changed_irradiance(geometry.irradiance, place, normal)
            around = [dr.maximum(a + change, 0) for a, change in zip(around, changes, strict=True)]
        return [share * a for share, a in zip(ambient, around, strict=True)]

    def as_gathered(normal: Any, place: Any, ambient: list[Any]) -> list[Any]:
        return ambient

    place, outward = state.world.move(point), state.world.turn(shading_normal)
    ambient = dr.if_stmt((outward, place, ambient), lit & ~baked, share_of_surroundings, as_gathered)
    if geometry.shadow_on_world is not None:
        shadow, stands_around = geometry.shadow_on_world, lit & _stands_around(primitive, geometry.groups)
        hidden = _hidden_by_robot(inputs, shadow, place, outward, stands_around)
        # The table is coarse: it must not hide more light than reaches the place.
        hidden = [dr.minimum(h, a) for h, a in zip(hidden, ambient, strict=True)]
        # The water before the robot's shadow on the world is lit by it: it is seen darker than it is.
        radius = dr.select(baked, shadow.shadow_radius, 0)
        share = hidden_share(inputs.tables.forward_cone, path.length, radius)
        darker = gain_of_light(light.scattering_without_peak[inputs.wavelengths // 2], path.length, share)
        ambient = [a - h * (1 + darker) for a, h in zip(ambient, hidden, strict=True)]
        sunlit = sunlit - darker * (open_to_sun - sunlit)
    sun_cosine = dr.maximum(dr.dot(shading_normal, towards_sun), 0) * sunlit
    illumination = Illumination(
        ambient=ambient,
        sun_cosine=sun_cosine,
        flicker=_flicker(inputs, place, sun_cosine > 0),
        lamps=_lamps(inputs, point, shading_normal, flat_normal, lit),
    )
    reflected = reflected_radiance(
        light,
        path.throughput,
        albedo=_albedo(material, colour, inputs),
        depth=-place.z,
        illumination=illumination,
    )
    seen_normal = dr.select(
        path.surface_seen, state.world.turn_back(Array3f32(0, 0, -1)), dr.select(lit, flat_normal, 0)
    )
    # In a shadow whose table is coarse the light that the water before it lacks may come out as more than there is.
    seen = [dr.maximum(a + dr.select(lit, b, 0), 0) for a, b in zip(path.rgb, reflected, strict=True)]
    return FrameArrays(
        rgb=[inputs.rays.gain * s for s in seen],
        label=_label(path, label, on_group),
        truth=TruthArrays(
            distance=path.distance,
            point=state.world.move(path.seen_point),
            normal=state.world.turn(seen_normal),
            region=path.region,
            instance=_instance(path, face[FaceColumn.INSTANCE], on_group, state),
        ),
    )


def _blended_corners(vertices: Any, face: list[Any], textured: Any, u: Any, v: Any) -> tuple[Any, list[Any], list[Any]]:
    """Normal, colour and baked light between the corners of faces."""
    rows = [row_of(vertices, dr.select(textured, UInt32(face[FaceColumn.CORNERS + k]), 0), ROW) for k in range(3)]
    shares = (1 - u - v, u, v)
    normals = [from_octahedron(*row[VertexColumn.NORMAL : VertexColumn.COLOUR]) for row in rows]
    normal = sum((n * s for n, s in zip(normals, shares, strict=True)), Array3f32(0))
    blended = [sum((row[k] * s for row, s in zip(rows, shares, strict=True)), Float32(0)) for k in range(ROW)]
    return normal, blended[VertexColumn.COLOUR : VertexColumn.AMBIENT], blended[VertexColumn.AMBIENT :]


def _sunlit(inputs: Inputs, point: Any, normal: Any, active: Any) -> tuple[Any, Any]:
    """Share of the sun that the world leaves points of the body frame, and that robot and target leave them of it."""
    groups, state = inputs.geometry.groups, inputs.state
    share = dr.select(active, Float32(1), Float32(0))
    if inputs.geometry.sun_map is not None:
        place, outward = state.world.move(point), state.world.turn(normal)
        share = dr.select(active, reached_by_sun(inputs.geometry.sun_map, place, outward), 0)
        groups = {name: group for name, group in groups.items() if name != WORLD}
    towards_sun = Array3f32(*state.towards_sun)
    start = point + normal * SHADOW_OFFSET_M
    free = is_free(groups, state, start, towards_sun, Float32(FAR_M), share > 0)
    return share, dr.select(free, share, 0)


def _stands_around(primitive: Any, groups: dict[str, GroupScene]) -> Any:
    """Whether primitives are the world's, the target or a decoy: what the robot is not."""
    around = primitive == int(Primitive.BALL)
    for position, name in enumerate(groups):
        if name == WORLD or is_target_or_decoy(name):
            around = around | (primitive == Primitive.FIRST_GROUP + position)
    return around


def _hidden_by_robot(inputs: Inputs, shadow: ShadowTable, place: Any, normal: Any, active: Any) -> list[Any]:
    """Irradiance by channel that the robot hides from surfaces (world frame); little far from it."""
    from_robot = place - inputs.state.world.move(Array3f32(*shadow.middle))
    near = active & (dr.squared_norm(from_robot) < FARTHEST_M**2) & (dr.dot(from_robot, normal) < 0)

    def hidden(from_robot: Any, normal: Any, depth: Any) -> list[Any]:
        return hidden_from_surface(shadow, inputs.light, from_robot, normal, depth)

    def nothing(from_robot: Any, normal: Any, depth: Any) -> list[Any]:
        return [Float32(0)] * 3

    return dr.if_stmt((from_robot, normal, -place.z), near, hidden, nothing)  # type: ignore[no-any-return]


def _flicker(inputs: Inputs, place: Any, in_sun: Any) -> Spectrum:
    """Factor of the waves' flicker on the sun at points of the world frame, by wavelength."""
    steady: Spectrum = [Float32(1)] * inputs.wavelengths
    pattern, sea = inputs.light.flicker, inputs.state.sea
    if pattern is None or sea is None:
        return steady

    def flickering(place: Any) -> Spectrum:
        return flicker(pattern, sea.flicker_time_s, inputs.tables.flicker, place, -place.z)

    return dr.if_stmt((place,), in_sun, flickering, lambda place: steady)  # type: ignore[no-any-return]


def _lamps(inputs: Inputs, point: Any, normal: Any, flat_normal: Any, lit: Any) -> Spectrum:
    """Irradiance of the lamps at points of the body frame, by wavelength, with a shadow ray to each."""
    lamps = inputs.light.lamps
    if lamps is None:
        return [Float32(0)] * inputs.wavelengths
    start = point + flat_normal * SHADOW_OFFSET_M
    groups, state = inputs.geometry.groups, inputs.state
    reached = [
        is_free(
            groups, state, start, direction, distance - LAMP_CLEARANCE_M, lit & (dr.dot(flat_normal, direction) > 0)
        )
        for direction, distance in towards_lamps(lamps, point)
    ]
    return lamp_irradiance(lamps, point, normal, inputs.light.beam_attenuation, reached)


def _in_body(local: Any, primitive: Any, groups: dict[str, GroupScene], state: StateRecord, point: Any) -> Any:
    """Normal of what was hit, turned from its own frame into the body's."""
    normal = point - Array3f32(*state.ball.centre)  # of the ball
    for position, name in enumerate(groups):
        pose = pose_of(state, name)
        turned = local if pose is None else pose.turn_back(local)
        normal = dr.select(primitive == Primitive.FIRST_GROUP + position, turned, normal)
    for front, back in zip(FRONTS, BACKS, strict=True):
        if front.name in state.mirrors:
            normal = dr.select(primitive == int(back), -state.mirrors[front.name].normal, normal)
    return dr.normalize(normal)


def _albedo(material: Any, colour: list[Any], inputs: Inputs) -> Spectrum:
    """Reflectance of the material times the vertices' colour."""
    light = inputs.light
    palette = row_of(inputs.tables.albedo, material, SPECTRUM_ROW)
    red, green, blue = colour
    return [
        of_material * (r * red + g * green + b * blue)
        for of_material, r, g, b in zip(palette[: inputs.wavelengths], *light.colour_basis, strict=True)
    ]


def _label(path: Path, of_face: Any, on_group: Any) -> Any:
    label = dr.select(on_group, of_face, UInt32(int(Label.OPEN_WATER)))
    for primitives, meaning in (
        (FRONTS, Label.MIRROR),
        (BACKS, Label.MIRROR_BACK),
        ((Primitive.SEA_SURFACE,), Label.SURFACE),
        ((Primitive.BALL,), Label.TARGET),
    ):
        for each in primitives:
            label = dr.select(path.primitive == int(each), UInt32(int(meaning)), label)
    label = dr.select(path.surface_seen, UInt32(int(Label.SURFACE)), label)
    return dr.select(path.region == int(Region.HOUSING), UInt32(int(Label.HOUSING)), label)


def _instance(path: Path, of_face: Any, on_group: Any, state: StateRecord) -> Any:
    """Instance of what is seen, counted from one; zero for none."""
    number = dr.select(on_group & ~path.surface_seen, UInt32(of_face + 1), UInt32(0))
    on_ball = (path.primitive == int(Primitive.BALL)) & ~path.surface_seen
    return dr.select(on_ball, UInt32(state.ball.instance), number)
