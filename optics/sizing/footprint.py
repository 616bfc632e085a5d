"""Footprints: where rays behind the port hit the planes of M1 and M2, in the mirrors' own axes, for many poses.

The planes are unbounded: a footprint says how large a mirror has to be. Lanes run over designs (d1, d2), poses and
rays at once, in float64.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.gaze.kinematics import gaze_mirror_normal
from optics.kernels.arrays import FloatArray, aligned, opaque, opaque_vector, to_columns
from optics.kernels.backend import Array3f64, Float64, Matrix3f64, UInt32, dr
from optics.layout import Layout
from optics.mirror import Hit, MirrorPlane, reflect_over
from optics.sizing.outlines import reach_directions, smallest_halves
from optics.train import Rays
from rigs import Rig

FOLD, GAZE = 0, 1


@dataclass(frozen=True, kw_only=True)
class Footprint:
    """Where rays hit a mirror's plane.

    Attributes
    ----------
    points_m : array, shape (..., 2)
        In the mirror's axes; of no meaning where it is not hit.
    front : array of bool, shape (...)
        Whether the ray hits the reflecting face: not from behind, nor backwards.
    spread_m : array, shape (...)
        First-order bound of how far the point moves on the mirror for each radian by which the camera, M1 and M2 are
        turned, each about its own origin, all in the worst direction.
    cosine : array, shape (...)
        Of the angle of incidence.
    """

    points_m: FloatArray
    front: NDArray[np.bool_]
    spread_m: FloatArray
    cosine: FloatArray


def fold_footprint(rig: Rig, rays: Rays) -> Footprint:
    """Footprint on M1, arrays of shape (rays,); it is the same for all poses."""
    zero = np.zeros(1)
    return _footprint(rig, rays, mirror=FOLD, poses=(zero, zero))


def gaze_footprint(rig: Rig, rays: Rays, *, q1: FloatArray, q2: FloatArray) -> Footprint:
    """Footprint on M2 at joint values (radians, shape (poses,)), arrays of shape (poses, rays)."""
    return _footprint(rig, rays, mirror=GAZE, poses=(q1, q2))


@dataclass(frozen=True, kw_only=True)
class Extents:
    """Half sizes of the mirrors of n designs, infinite where no mirror does, shape (n, 2): width, height."""

    m1_m: FloatArray
    m2_m: FloatArray


def centred_extents(
    rig: Rig,
    rays: Rays,
    *,
    d1_m: FloatArray,
    d2_m: FloatArray,
    q1: FloatArray,
    q2: FloatArray,
    margin_m: float,
    angle_tolerance: float,
) -> Extents:
    """Half sizes of the mirrors that pass all rays at all poses, for pairs of d1 and d2 (shape (n,)).

    The outlines are those of the rig's mirrors. Nothing of the size of designs times poses is stored: lanes are reduced
    in the kernel.
    """
    layout, gaze = Layout.from_rig(rig), rig.require_gaze()
    names = (gaze.fold_mirror.outline, gaze.gaze_mirror.outline)
    halves = []
    for name, mirror, poses in zip(names, (FOLD, GAZE), ((np.zeros(1), np.zeros(1)), (q1, q2)), strict=True):
        parameters = _parameters(layout, rays, *poses) | {"d1": Float64(d1_m), "d2": Float64(d2_m)}
        hit, spread, _ = _hit_lanes(parameters, (len(d1_m), len(poses[0]), len(rays.origin_m)), mirror)
        growth = opaque(margin_m) + opaque(angle_tolerance) * spread
        lanes = len(poses[0]) * len(rays.origin_m)
        x, y = (dr.abs(side) for side in hit.local)
        reaches = [
            dr.block_reduce(dr.ReduceOp.Max, dr.select(hit.front, x * c + y * s + growth, dr.inf), lanes)
            for c, s in reach_directions(name).tolist()
        ]
        halves.append(smallest_halves(name, np.stack([np.array(reach) for reach in reaches], axis=1)))
    return Extents(m1_m=halves[0], m2_m=halves[1])


def _footprint(rig: Rig, rays: Rays, *, mirror: int, poses: tuple[FloatArray, FloatArray]) -> Footprint:
    gaze = rig.require_gaze()
    layout = Layout.from_rig(rig)
    parameters = _parameters(layout, rays, *poses)
    parameters |= {"d1": opaque(gaze.fold_mirror.distance_mm / 1000), "d2": opaque(gaze.gaze_mirror.distance_mm / 1000)}
    counts = (1, len(poses[0]), len(rays.origin_m))
    hit, spread, cosine = _hit_lanes(parameters, counts, mirror)
    dr.eval(hit.local, hit.front, spread, cosine)
    shape = (counts[2],) if mirror == FOLD else counts[1:]
    return Footprint(
        points_m=np.stack([np.array(side).reshape(shape) for side in hit.local], axis=-1),
        front=np.array(hit.front).reshape(shape),
        spread_m=np.array(spread).reshape(shape),
        cosine=np.array(cosine).reshape(shape),
    )


def _parameters(layout: Layout, rays: Rays, q1: FloatArray, q2: FloatArray) -> dict[str, Any]:
    """Inputs of the kernel: rays, and M2's axes by pose, both in the camera frame."""
    pan = layout.pan.angle(q1)
    tilt_axis = np.stack([-np.sin(pan), np.cos(pan), np.zeros_like(pan)], axis=-1)
    body_from_gimbal, body_from_camera = (
        pose.rotation.as_matrix() for pose in (layout.body_from_gimbal, layout.body_from_camera)
    )
    m2_x, m2_normal = tilt_axis @ body_from_gimbal.T @ body_from_camera, gaze_mirror_normal(layout, q1, q2)
    m2_normal = m2_normal @ body_from_camera
    m2 = np.stack([m2_x, np.cross(m2_normal, m2_x), m2_normal], axis=-1)
    down = -layout.camera_from_gimbal.rotation.as_matrix()[:, 2]
    return {
        "origin": Array3f64(*to_columns(rays.origin_m)),
        "direction": Array3f64(*to_columns(rays.direction)),
        "m1_axes": [opaque_vector(axis) for axis in layout.camera_from_m1.rotation.as_matrix().T],
        "down": opaque_vector(down),
        "m2_axes": Matrix3f64([[Float64(aligned(m2[:, i, j], np.float64)) for j in range(3)] for i in range(3)]),
    }


def _hit_lanes(parameters: dict[str, Any], counts: tuple[int, int, int], mirror: int) -> tuple[Hit, Any, Any]:
    """Kernel: hits of every design, pose and ray, in this order; spread and cosine of incidence of each."""
    design_count, pose_count, ray_count = counts
    lane = dr.arange(UInt32, design_count * pose_count * ray_count)
    pair = lane // dr.opaque(UInt32, ray_count)
    ray = lane - pair * dr.opaque(UInt32, ray_count)
    design = pair // dr.opaque(UInt32, pose_count)
    pose = pair - design * dr.opaque(UInt32, pose_count)
    origin, direction = (dr.gather(Array3f64, parameters[name], ray) for name in ("origin", "direction"))
    x, y, normal = parameters["m1_axes"]
    m1 = MirrorPlane(point=Array3f64(0, 0, dr.gather(Float64, parameters["d1"], design)), x=x, y=y, normal=normal)
    axes = dr.gather(Matrix3f64, parameters["m2_axes"], pose)
    x, y, normal = (Array3f64(axes[0, k], axes[1, k], axes[2, k]) for k in range(3))
    centre2 = m1.point + parameters["down"] * dr.gather(Float64, parameters["d2"], design)
    at_m1, at_m2 = reflect_over((m1, MirrorPlane(point=centre2, x=x, y=y, normal=normal)), origin, direction)
    cosine1, cosine2 = -dr.dot(direction, m1.normal), -dr.dot(at_m1.direction, normal)
    if mirror == FOLD:
        # A camera turned by e moves the point by e times its distance, across the ray at most; along the plane that
        # is 1 / cos more. The plane turned by e moves it along itself by e rho tan.
        return at_m1, dr.norm(at_m1.point) / cosine1 + _tilted(at_m1, cosine1), cosine1
    # Unfolded over M1 the pinhole is its mirror image; M1 turned by e turns what it reflects by 2 e about its centre.
    pinhole = m1.normal * (2 * dr.dot(m1.point, m1.normal))
    reach = dr.norm(at_m2.point - pinhole) + 2 * dr.norm(at_m2.point - m1.point)
    passed = replace(at_m2, front=at_m2.front & at_m1.front)
    return passed, reach / cosine2 + _tilted(at_m2, cosine2), cosine2


def _tilted(hit: Hit, cosine: Any) -> Any:
    """How far a point on a plane moves for each radian by which the plane is turned about its centre."""
    radius = dr.sqrt(dr.square(hit.local[0]) + dr.square(hit.local[1]))
    return radius * dr.sqrt(dr.maximum(1 - dr.square(cosine), 0)) / cosine
