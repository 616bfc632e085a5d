"""Kernels of geometry: the nearest hit of a ray, and whether the sun reaches a point.

Rays live in the body frame; each group is traced in its own frame, the world in the world's.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from optics.kernels.backend import Array3f32, Bool, Float32, UInt32, dr, mi
from optics.mesh import Group
from scenes.stage.records import WORLD, BallRecord, MirrorPlate, Pose, StateRecord

FAR_M = 1e6
"""Stands for infinity where the kernel needs a number: no light of any wavelength survives it."""

START_OFFSET_M = 1e-5
"""How far a ray starts off the surface it leaves; single precision places hits to about 1e-7 m at arm's length."""


class Primitive(IntEnum):
    """What a ray hits; groups of triangles are counted from `FIRST_GROUP` in the order of the geometry."""

    OPEN_WATER = 0
    M1 = 1
    M2 = 2
    M1_BACK = 3
    M2_BACK = 4
    SEA_SURFACE = 5
    BALL = 6
    FIRST_GROUP = 7


FRONTS, BACKS = (Primitive.M1, Primitive.M2), (Primitive.M1_BACK, Primitive.M2_BACK)


@dataclass(frozen=True, kw_only=True)
class GroupScene:
    """A group of triangles as rays find it.

    Attributes
    ----------
    scene : mi.Scene
    box : tuple of lists
        Lower and upper corner of its bounding box.
    offset : Float32
        Row of its first face in the table of faces.
    """

    scene: Any
    box: tuple[list[Any], list[Any]]
    offset: Any


@dataclass(frozen=True, kw_only=True)
class Hit:
    """Nearest primitive: Dr.Jit arrays. `face`, `u` and `v` say where on a group's triangles."""

    distance: Any
    primitive: Any
    face: Any
    u: Any
    v: Any


@dataclass(frozen=True, kw_only=True)
class FixedHit:
    """Where rays hit the fixed group's triangles: Dr.Jit arrays; `FAR_M` away where they miss it."""

    distance: Any
    face: Any


@dataclass(frozen=True, kw_only=True)
class Rays:
    """Rays at their beginning, body frame: Dr.Jit arrays.

    Attributes
    ----------
    origin, direction : Array3f32
    gain : Float32
        Factor on their radiance; zero for rays that see no water.
    prefix : tuple of FixedHit
        Of the rays themselves, and of those that the fold mirror reflects: no joint moves these.
    place : UInt32, optional
        Where each ray's result belongs; in the order of the rays without.
    state, row : UInt32, optional
        Which of several states, and which row of a frame that is read out row by row, each belongs to.
    """

    origin: Any
    direction: Any
    gain: Any
    prefix: tuple[FixedHit, ...] = ()
    place: Any = None
    state: Any = None
    row: Any = None

    def taken(self, numbers: Any) -> Rays:
        """Kernel: the rays of these numbers, in their order."""

        def picked(values: Any) -> Any:
            return None if values is None else dr.gather(type(values), values, numbers)

        return Rays(
            origin=picked(self.origin),
            direction=picked(self.direction),
            gain=picked(self.gain),
            prefix=tuple(FixedHit(distance=picked(hit.distance), face=picked(hit.face)) for hit in self.prefix),
            place=picked(self.place),
            state=picked(self.state),
            row=picked(self.row),
        )


@dataclass(frozen=True, kw_only=True)
class Known:
    """Hits on the fixed group that are known beforehand, where `known` is set: no joint moves them."""

    known: Any
    distance: Any
    face: Any


def pose_of(state: StateRecord, name: str) -> Pose | None:
    """Pose of a group seen from the body; None for the body itself."""
    return None if name == str(Group.FIXED) else state.poses[name]


def nearest(
    groups: dict[str, GroupScene],
    state: StateRecord,
    origin: Any,
    direction: Any,
    *,
    active: Any,
    known: Known,
    coherent: bool,
) -> Hit:
    """Nearest of mirrors, sea surface, ball, groups and world along unit rays of the body frame."""
    distance, primitive = Float32(FAR_M), UInt32(int(Primitive.OPEN_WATER))
    for front, back in zip(FRONTS, BACKS, strict=True):
        if front.name in state.mirrors:
            reached, approach = _intersect_mirror(state.mirrors[front.name], origin, direction)
            distance, primitive = _nearer(
                distance, primitive, reached, dr.select(approach < 0, UInt32(int(front)), UInt32(int(back)))
            )
    distance, primitive = _nearer(
        distance, primitive, _intersect_surface(state.world, origin, direction), Primitive.SEA_SURFACE
    )
    distance, primitive = _nearer(distance, primitive, intersect_ball(state.ball, origin, direction), Primitive.BALL)
    face, u, v = UInt32(0), Float32(0), Float32(0)
    for position, (name, group) in enumerate(groups.items()):
        tried = active
        if name == str(Group.FIXED):
            closer = known.known & (known.distance < distance)
            distance, primitive = _nearer(
                distance, primitive, dr.select(known.known, known.distance, FAR_M), Primitive.FIRST_GROUP + position
            )
            face = dr.select(closer, known.face, face)
            tried = active & ~known.known
        local_origin, local_direction = _in_frame(state, name, origin, direction)
        if name == WORLD:
            # Short segments, such as those between the mirrors, end before the world begins.
            tried = tried & (dr.norm(origin) + distance > state.clearance_m)
        else:
            tried = tried & crosses_box(group.box, local_origin, local_direction, distance)
        # The ray need not be followed behind what was found already.
        ray = mi.Ray3f(local_origin, local_direction, distance, 0.0, [])
        found = group.scene.ray_intersect_preliminary(ray, coherent=coherent, active=tried)
        closer = tried & found.is_valid() & (found.t < distance)
        distance = dr.select(closer, found.t, distance)
        primitive = dr.select(closer, UInt32(Primitive.FIRST_GROUP + position), primitive)
        face = dr.select(closer, found.prim_index, face)
        u, v = dr.select(closer, found.prim_uv.x, u), dr.select(closer, found.prim_uv.y, v)
    return Hit(distance=distance, primitive=primitive, face=face, u=u, v=v)


def is_free(  # noqa: PLR0917
    groups: dict[str, GroupScene], state: StateRecord, point: Any, direction: Any, distance: Any, active: Any
) -> Any:
    """Whether nothing stands before points of the body frame along a direction, up to a distance."""
    free = active & (intersect_ball(state.ball, point, direction) >= distance)
    for mirror in state.mirrors.values():
        free &= _intersect_mirror(mirror, point, direction)[0] >= distance
    for name, group in groups.items():
        local_point, local_direction = _in_frame(state, name, point, direction)
        tried = free & crosses_box(group.box, local_point, local_direction, distance)
        ray = mi.Ray3f(local_point, local_direction, distance, 0.0, [])
        free = free & ~(tried & group.scene.ray_test(ray, coherent=True, active=tried))
    return free


def crosses_box(box: tuple[list[Any], list[Any]], origin: Any, direction: Any, length: Any) -> Any:
    """Whether rays pass through an axis-aligned box within a length (slabs: Kay & Kajiya 1986)."""
    # A component of zero would make 0 / 0 for a ray in a slab's own plane.
    safe = [dr.select(dr.abs(d) < 1e-12, 1e-12, d) for d in direction]
    near, far = Float32(0), length
    for low, high, o, d in zip(*box, origin, safe, strict=True):
        inverse = dr.rcp(d)
        first, second = (low - o) * inverse, (high - o) * inverse
        near = dr.maximum(near, dr.minimum(first, second))
        far = dr.minimum(far, dr.maximum(first, second))
    return near <= far * (1 + 1e-6)


def intersect_ball(ball: BallRecord, origin: Any, direction: Any) -> Any:
    """Distance to a ball, `FAR_M` where it is missed."""
    offset = origin - Array3f32(*ball.centre)
    half_b = dr.dot(offset, direction)
    # The distance of the ray from the centre is taken directly: b^2 - c loses a small far ball to rounding.
    closest = offset - direction * half_b
    depth2 = dr.square(ball.radius) - dr.squared_norm(closest)
    distance = -half_b - dr.safe_sqrt(depth2)
    return dr.select((depth2 > 0) & (distance > 0), distance, FAR_M)


def _intersect_mirror(mirror: MirrorPlate, origin: Any, direction: Any) -> tuple[Any, Any]:
    """Distance to a mirror, `FAR_M` where it is missed, and the cosine to its normal: negative from the front."""
    normal = mirror.normal
    approach = dr.dot(direction, normal)
    to_centre = Array3f32(*mirror.centre) - origin
    distance = dr.dot(to_centre, normal) / approach
    local = direction * distance - to_centre
    inside = mirror.outline.contains(dr.dot(local, Array3f32(*mirror.x)), dr.dot(local, Array3f32(*mirror.y)))
    return dr.select((distance > 0) & inside, distance, FAR_M), approach


def _intersect_surface(world: Pose, origin: Any, direction: Any) -> Any:
    height, rise = world.move(origin).z, world.turn(direction).z
    return dr.select((rise > 0) & (height < 0), -height / rise, FAR_M)


def _nearer(distance: Any, primitive: Any, other: Any, other_primitive: Any) -> tuple[Any, Any]:
    if isinstance(other_primitive, int):
        other_primitive = UInt32(int(other_primitive))
    closer = other < distance
    return dr.select(closer, other, distance), dr.select(closer, other_primitive, primitive)


def _in_frame(state: StateRecord, name: str, origin: Any, direction: Any) -> tuple[Any, Any]:
    pose = pose_of(state, name)
    return (origin, direction) if pose is None else (pose.move(origin), pose.turn(direction))


def nothing_known() -> Known:
    """No hit is known beforehand."""
    return Known(known=Bool(False), distance=Float32(FAR_M), face=UInt32(0))
