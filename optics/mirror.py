"""Flat mirrors: the plane, its outline, and the reflection as a transform of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import FloatArray, check_points, check_vector, opaque, opaque_vector, unit
from optics.kernels.backend import dr
from optics.kernels.refraction import reflect


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
    outline_m : array, shape (k, 2), optional
        Corners of a convex outline in the mirror's axes; None: unbounded.
    """

    point_m: ArrayLike
    normal: ArrayLike
    up: ArrayLike
    outline_m: ArrayLike | None = None

    def __post_init__(self) -> None:
        check_vector("point_m", self.point_m)
        normal, up = unit("normal", self.normal), unit("up", self.up)
        if np.linalg.norm(np.cross(normal, up)) < 1e-9:
            raise ValueError(f"expected up to differ from the normal, got {self.up!r} and {self.normal!r}")
        if self.outline_m is not None:
            _check_convex(check_points("outline_m", self.outline_m, 2))

    @classmethod
    def from_pose(
        cls,
        camera_from_mirror: RigidTransform,
        *,
        width_m: float | None = None,
        height_m: float | None = None,
    ) -> PlaneMirror:
        """Rectangular mirror (or an unbounded one) at a pose whose z axis is the normal and y axis is up."""
        if (width_m is None) != (height_m is None):
            raise ValueError(f"expected both width_m and height_m or neither, got {width_m} and {height_m}")
        axes = camera_from_mirror.rotation.as_matrix()
        outline = None
        if width_m is not None and height_m is not None:
            outline = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width_m / 2, height_m / 2]
        return cls(point_m=camera_from_mirror.translation, normal=axes[:, 2], up=axes[:, 1], outline_m=outline)

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
        """Corners of the outline in the camera frame, shape (k, 3)."""
        if self.outline_m is None:
            raise ValueError("expected a mirror with an outline, got an unbounded one")
        return check_vector("point_m", self.point_m) + np.asarray(self.outline_m) @ self.axes[:, :2].T

    @property
    def edge_count(self) -> int:
        """Number of edges of the outline, 0 for an unbounded mirror; a kernel is compiled for each number."""
        return 0 if self.outline_m is None else len(np.asarray(self.outline_m))

    def parameters(self) -> MirrorPlane:
        """Numbers of the mirror for the kernels."""
        x, y, normal = (opaque_vector(axis) for axis in self.axes.T)
        point = opaque_vector(check_vector("point_m", self.point_m))
        return MirrorPlane(point=point, x=x, y=y, normal=normal, edges=self.edge_parameters())

    def edge_parameters(self) -> list[list[Any]]:
        """Half-planes of the outline for the kernels, none for an unbounded mirror."""
        if self.outline_m is None:
            return []
        return [
            [opaque(value) for value in edge] for edge in outline_edges(np.asarray(self.outline_m, dtype=np.float64))
        ]


@dataclass(frozen=True, kw_only=True)
class MirrorPlane:
    """A mirror in the kernels: Dr.Jit vectors, the same for all lanes or one for each.

    Attributes
    ----------
    point, normal, x, y : vectors
        Origin and axes of the mirror.
    edges : sequence of (a, b, limit)
        Half-planes of its outline; none: unbounded.
    """

    point: Any
    normal: Any
    x: Any
    y: Any
    edges: Sequence[Sequence[Any]] = ()


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
    for a, b, limit in mirror.edges:
        inside &= a * x + b * y <= limit
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


def outline_edges(outline_m: FloatArray) -> FloatArray:
    """Half-planes of a convex outline: rows (a, b, limit), inside where ``a x + b y <= limit``."""
    return np.unique(ConvexHull(outline_m).equations * [1, 1, -1], axis=0)


def _check_convex(outline: FloatArray) -> None:
    if len(outline) < 3 or not np.isfinite(outline).all():
        raise ValueError(f"expected outline_m with at least three finite corners, got {outline.tolist()}")
    steps = np.diff(np.vstack([outline, outline[:1]]), axis=0)
    turns = steps[:, 0] * np.roll(steps[:, 1], -1) - steps[:, 1] * np.roll(steps[:, 0], -1)
    smallest = 1e-9 * np.abs(outline).max() ** 2
    one_way = (turns > smallest).all() or (turns < -smallest).all()
    # A pentagram turns one way at every corner too, but goes round twice.
    heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    if not one_way or abs(heading[-1] - heading[0]) >= 2 * np.pi:
        raise ValueError(f"expected outline_m to be convex with a real corner everywhere, got {outline.tolist()}")
