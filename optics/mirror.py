"""Flat mirrors: the plane, its outline, and the reflection as a transform of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import FloatArray, check_vector, opaque_vector, unit
from optics.kernels.backend import dr
from optics.kernels.refraction import reflect
from optics.mirror_outline import Outline


@dataclass(frozen=True, kw_only=True)
class Reflection:
    """Reflection at a plane: ``x -> x - 2 (n . x - d) n``. Not a rigid transform; two of them make one.

    Attributes
    ----------
    normal : array, shape (3,)
        Unit normal.
    offset_m : float
        Signed distance of the plane from the origin along the normal.
    """

    normal: FloatArray
    offset_m: float

    def apply(self, points_m: ArrayLike) -> FloatArray:
        """Reflect points, shape (n, 3) or (3,)."""
        points = np.asarray(points_m, dtype=np.float64)
        distance = points @ self.normal - self.offset_m
        return points - 2 * distance[..., np.newaxis] * self.normal

    def as_matrix(self) -> FloatArray:
        """Homogeneous matrix, shape (4, 4), determinant -1."""
        matrix = np.eye(4)
        matrix[:3, :3] -= 2 * np.outer(self.normal, self.normal)
        matrix[:3, 3] = 2 * self.offset_m * self.normal
        return matrix

    def after(self, first: Reflection) -> RigidTransform:
        """Rigid transform of two reflections, `first` applied first."""
        return RigidTransform.from_matrix(self.as_matrix() @ first.as_matrix())


@dataclass(frozen=True, kw_only=True)
class PlaneMirror:
    """Front-surface mirror, in the camera frame.

    Parameters
    ----------
    point_m : (3,)
        Centre of the face, origin of the mirror's axes.
    normal : (3,)
        Out of the reflecting face.
    up : (3,)
        Direction of the mirror's y axis; its part along the normal is dropped. x is ``up x normal``.
    outline : Outline, optional
        In the mirror's axes (`optics.mirror_outline`); None: unbounded.
    """

    point_m: ArrayLike
    normal: ArrayLike
    up: ArrayLike
    outline: Outline | None = None

    def __post_init__(self) -> None:
        check_vector("point_m", self.point_m)
        normal, up = unit("normal", self.normal), unit("up", self.up)
        if np.linalg.norm(np.cross(normal, up)) < 1e-9:
            raise ValueError(f"expected up to differ from the normal, got {self.up!r} and {self.normal!r}")

    @classmethod
    def from_pose(cls, camera_from_mirror: RigidTransform, outline: Outline | None = None) -> PlaneMirror:
        """Mirror at a pose whose z axis is the normal and y axis is up."""
        axes = camera_from_mirror.rotation.as_matrix()
        return cls(point_m=camera_from_mirror.translation, normal=axes[:, 2], up=axes[:, 1], outline=outline)

    @property
    def axes(self) -> FloatArray:
        """Columns: the mirror's x, y and z (normal) in the camera frame."""
        z = unit("normal", self.normal)
        up = unit("up", self.up)
        y = unit("up", up - z * (z @ up))
        return np.column_stack([np.cross(y, z), y, z])

    @property
    def reflection(self) -> Reflection:
        """The reflection at the mirror's plane."""
        normal = unit("normal", self.normal)
        return Reflection(normal=normal, offset_m=float(normal @ check_vector("point_m", self.point_m)))

    @property
    def corners_m(self) -> FloatArray:
        """Corners of the outline in the camera frame, shape (k, 3); of an ellipse, points of its rim."""
        if self.outline is None:
            raise ValueError("expected a mirror with an outline, got an unbounded one")
        return self.at(self.outline.rim())

    def at(self, local_m: FloatArray) -> FloatArray:
        """Points of the face, shape (k, 2) in the mirror's axes, in the camera frame, shape (k, 3)."""
        return np.asarray(check_vector("point_m", self.point_m) + local_m @ self.axes[:, :2].T)

    @property
    def outline_kind(self) -> tuple[Any, ...]:
        """What a kernel depends on; it is compiled for each kind of outline."""
        return () if self.outline is None else self.outline.kind

    def parameters(self) -> MirrorPlane:
        """Numbers of the mirror for the kernels."""
        x, y, normal = (opaque_vector(axis) for axis in self.axes.T)
        point = opaque_vector(check_vector("point_m", self.point_m))
        outline = self.outline and self.outline.parameters()
        return MirrorPlane(point=point, x=x, y=y, normal=normal, outline=outline)


@dataclass(frozen=True, kw_only=True)
class MirrorPlane:
    """A mirror in the kernels: Dr.Jit vectors, the same for all lanes or one for each.

    Attributes
    ----------
    point, normal, x, y : vectors
        Origin and axes of the mirror.
    outline : Outline, optional
        Of a kernel's numbers; None: unbounded.
    """

    point: Any
    normal: Any
    x: Any
    y: Any
    outline: Outline | None = None


@dataclass(frozen=True, kw_only=True)
class Hit:
    """Rays at a mirror: Dr.Jit arrays.

    Attributes
    ----------
    point, distance
        Where the ray crosses the mirror's plane.
    local : (x, y)
        The same point in the mirror's axes.
    direction
        Behind the reflection.
    front, back
        Whether the ray hits the reflecting face, or the other one, within the outline.
    """

    point: Any
    local: tuple[Any, Any]
    direction: Any
    distance: Any
    front: Any
    back: Any


def intersect(mirror: MirrorPlane, origin: Any, direction: Any) -> Hit:
    """Kernel: intersect rays with a mirror and reflect them."""
    approach = dr.dot(direction, mirror.normal)
    distance = dr.dot(mirror.point - origin, mirror.normal) / approach
    point = dr.fma(direction, distance, origin)
    offset = point - mirror.point
    x, y = dr.dot(offset, mirror.x), dr.dot(offset, mirror.y)
    inside = distance > 0
    if mirror.outline is not None:
        inside &= mirror.outline.contains(x, y)
    return Hit(
        point=point,
        local=(x, y),
        direction=reflect(direction, mirror.normal),
        distance=distance,
        front=inside & (approach < 0),
        back=inside & (approach > 0),
    )


def reflect_over(mirrors: Sequence[MirrorPlane], origin: Any, direction: Any) -> list[Hit]:
    """Kernel: rays over one mirror's plane after another; what each hit means is for the caller to say."""
    hits = []
    for mirror in mirrors:
        hit = intersect(mirror, origin, direction)
        origin, direction = hit.point, hit.direction
        hits.append(hit)
    return hits


def unfold(mirror: MirrorPlane, point: Any) -> Any:
    """Kernel: mirror image of a point at the mirror's plane."""
    return point - mirror.normal * (2 * dr.dot(point - mirror.point, mirror.normal))
