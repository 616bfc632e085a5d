"""Kernels of geometry: the nearest thing a ray meets, and whether the sun reaches a point.

Rays live in the body frame; each group is traced in its own frame, the world in the world's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform

from optics.backend import Array3f32, Float32, UInt32, dr, mi
from optics.mirror import strike
from scenes.frame import Label
from scenes.geometry import WORLD, Geometry
from scenes.materials import Material

FAR_M = 1e6
"""Stands for infinity where the kernel needs a number: no light of any wavelength survives it."""

START_OFFSET_M = 1e-5
"""How far a ray starts off the surface it leaves; single precision places hits to about 1e-7 m at arm's length."""

FIRST_MIRROR = max(Label) + 1
"""Labels from here on are the fronts of M1 and M2: the ray goes on."""


@dataclass(frozen=True, kw_only=True)
class Hit:
    """Nearest surface: Dr.Jit arrays. `normal` (body frame) faces the ray; `label` is a `Label` or a mirror's front."""

    distance: Any
    normal: Any
    material: Any
    label: Any


def opaque32(value: float) -> Any:
    """Single-precision input of a kernel."""
    return dr.opaque(Float32, float(value))


def vector32(vector: Any) -> Any:
    """Single-precision 3-vector that is an input of a kernel."""
    return Array3f32(*(opaque32(component) for component in np.asarray(vector)))


def pose_parameters(transform: RigidTransform) -> dict[str, Any]:
    """Pose for the kernels: rows of the rotation, and the translation."""
    matrix = transform.as_matrix()
    return {"rows": [vector32(row) for row in matrix[:3, :3]], "shift": vector32(matrix[:3, 3])}


def turn(pose: dict[str, Any], vector: Any) -> Any:
    """Rotate a vector into a pose's frame."""
    return Array3f32(*(dr.dot(row, vector) for row in pose["rows"]))


def turn_back(pose: dict[str, Any], vector: Any) -> Any:
    """Rotate a vector out of a pose's frame."""
    first, second, third = pose["rows"]
    return first * vector.x + second * vector.y + third * vector.z


def move(pose: dict[str, Any], point: Any) -> Any:
    """Carry a point into a pose's frame."""
    return turn(pose, point) + pose["shift"]


def nearest(geometry: Geometry, state: dict[str, Any], origin: Any, direction: Any, active: Any) -> Hit:
    """Nearest of mirrors, sea surface, target, groups and world along unit rays of the body frame."""
    body = state["body"]
    hit = _nearest_mirror(state, origin, direction)
    hit = _nearer(hit, _sea_surface(body, origin, direction))
    hit = _nearer(hit, _target(state, origin, direction))
    for name, group in geometry.items():
        pose = _frame(state, name)
        # The ray need not be followed behind what was found already.
        ray = mi.Ray3f(move(pose, origin), turn(pose, direction), hit.distance, 0.0, [])
        found = group["scene"].ray_intersect_preliminary(ray, coherent=True, active=active)
        valid = active & found.is_valid()
        normal = Array3f32(*(dr.gather(Float32, column, found.prim_index, valid) for column in group["normals"]))
        normal = turn_back(pose, normal)
        candidate = Hit(
            distance=dr.select(valid, found.t, FAR_M),
            normal=dr.select(dr.dot(normal, direction) > 0, -normal, normal),
            material=dr.gather(UInt32, group["material"], found.prim_index, valid),
            label=dr.gather(UInt32, group["label"], found.prim_index, valid),
        )
        hit = _nearer(hit, candidate)
    return hit


def sunlit(geometry: Geometry, state: dict[str, Any], point: Any, towards_sun: Any, active: Any) -> Any:
    """Whether nothing stands between points of the body frame and the sun (its direction in the world frame)."""
    direction = turn_back(state["body"], towards_sun)
    lit = active & (_target(state, point, direction).distance >= FAR_M)
    for name, group in geometry.items():
        pose = _frame(state, name)
        ray = mi.Ray3f(move(pose, point), turn(pose, direction), FAR_M, 0.0, [])
        lit = lit & ~group["scene"].ray_test(ray, coherent=True, active=lit)
    return lit


def _frame(state: dict[str, Any], name: str) -> dict[str, Any]:
    pose: dict[str, Any] = state["body"] if name == WORLD else state["groups"][name]
    return pose


def _nearer(first: Hit, second: Hit) -> Hit:
    closer = second.distance < first.distance
    return Hit(
        distance=dr.select(closer, second.distance, first.distance),
        normal=dr.select(closer, second.normal, first.normal),
        material=dr.select(closer, second.material, first.material),
        label=dr.select(closer, second.label, first.label),
    )


def _nearest_mirror(state: dict[str, Any], origin: Any, direction: Any) -> Hit:
    hit = Hit(
        distance=Float32(FAR_M),
        normal=Array3f32(0, 0, 1),
        material=UInt32(int(Material.MIRROR_BACK)),
        label=UInt32(int(Label.OPEN_WATER)),
    )
    for position, mirror in enumerate(state["mirrors"]):
        met = strike(mirror, origin, direction)
        candidate = Hit(
            distance=dr.select(met.front | met.back, met.distance, FAR_M),
            normal=dr.select(met.front, mirror["normal"], -mirror["normal"]),
            material=hit.material,
            label=dr.select(met.front, UInt32(FIRST_MIRROR + position), UInt32(int(Label.MIRROR_BACK))),
        )
        hit = _nearer(hit, candidate)
    return hit


def _sea_surface(body: dict[str, Any], origin: Any, direction: Any) -> Hit:
    height, rise = move(body, origin).z, turn(body, direction).z
    return Hit(
        distance=dr.select((rise > 0) & (height < 0), -height / rise, FAR_M),
        normal=turn_back(body, Array3f32(0, 0, -1)),
        material=UInt32(0),
        label=UInt32(int(Label.SURFACE)),
    )


def _target(state: dict[str, Any], origin: Any, direction: Any) -> Hit:
    """The ball, as an exact sphere; of radius zero when there is none."""
    centre = turn_back(state["body"], state["target"] - state["body"]["shift"])
    offset = origin - centre
    half_b = dr.dot(offset, direction)
    # The distance of the ray from the centre is taken directly: b^2 - c loses a small far ball to rounding.
    closest = offset - direction * half_b
    depth2 = dr.square(state["target_radius"]) - dr.squared_norm(closest)
    distance = -half_b - dr.safe_sqrt(depth2)
    valid = (depth2 > 0) & (distance > 0)
    return Hit(
        distance=dr.select(valid, distance, FAR_M),
        normal=dr.normalize(offset + direction * distance),
        material=UInt32(int(Material.TARGET)),
        label=UInt32(int(Label.TARGET)),
    )
