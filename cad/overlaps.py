"""Which parts are in each other's way, as volumes of intersection of closed triangle meshes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import manifold3d
import numpy as np
from scipy.spatial.transform import RigidTransform

from cad.poses import body_from_group
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import Group, PartMesh

OVERLAP_TOLERANCE_MM3 = 1.0
"""Two curved faces that touch overlap by this much at most, because triangles only approach them."""


@dataclass(frozen=True, kw_only=True)
class Overlap:
    """Two parts that share volume at some joint values (radians)."""

    first: str
    second: str
    volume_mm3: float
    q1: float
    q2: float


@dataclass(frozen=True, kw_only=True)
class Gap:
    """How near a moving part comes to a fixed one, at some joint values (radians); 0 when they intersect."""

    moving: str
    fixed: str
    gap_mm: float
    q1: float
    q2: float


def manifold_mm(mesh: PartMesh) -> manifold3d.Manifold:
    """Closed mesh as a body that can be intersected, millimetres; empty when it is not closed."""
    return manifold3d.Manifold(
        manifold3d.Mesh64(
            np.ascontiguousarray(1000 * mesh.vertices_m), np.ascontiguousarray(mesh.faces, dtype=np.uint64)
        )
    )


def checked_poses(layout: Layout, steps: int) -> list[tuple[float, float]]:
    """Joint values on a regular grid over both ranges, ends included, and the rest position; radians."""
    return [(0.0, 0.0), *((q1, q2) for q1, q2 in layout.joint_grid(steps).tolist())]


def overlaps(meshes: Sequence[PartMesh], layout: Layout, poses: Iterable[tuple[float, float]]) -> list[Overlap]:
    """Pairs of parts that share more volume than the tolerance, each pair at its worst pose."""
    worst: dict[tuple[str, str], Overlap] = {}
    for first, second, (q1, q2) in _neighbours(meshes, layout, poses, 0.0):
        volume = (first.body ^ second.body).volume()
        pair = (first.mesh.name, second.mesh.name)
        if volume > max(OVERLAP_TOLERANCE_MM3, worst[pair].volume_mm3 if pair in worst else 0.0):
            worst[pair] = Overlap(first=pair[0], second=pair[1], volume_mm3=volume, q1=q1, q2=q2)
    return list(worst.values())


def smallest_gaps(
    meshes: Sequence[PartMesh], layout: Layout, poses: Iterable[tuple[float, float]], below_mm: float
) -> list[Gap]:
    """Pairs of a moving and a fixed part that come nearer to each other than `below_mm`, each at its worst pose."""
    worst: dict[tuple[str, str], Gap] = {}
    for first, second, (q1, q2) in _neighbours(meshes, layout, poses, below_mm):
        fixed, moving = (first, second) if first.mesh.group is Group.FIXED else (second, first)
        if fixed.mesh.group is not Group.FIXED or moving.mesh.group is Group.FIXED:
            continue
        pair = (moving.mesh.name, fixed.mesh.name)
        gap = moving.body.min_gap(fixed.body, below_mm)
        if gap < (worst[pair].gap_mm if pair in worst else below_mm):
            worst[pair] = Gap(moving=pair[0], fixed=pair[1], gap_mm=gap, q1=q1, q2=q2)
    return list(worst.values())


@dataclass(frozen=True, kw_only=True)
class _Placed:
    """A part in the body frame, and the box around it."""

    mesh: PartMesh
    body: manifold3d.Manifold
    low: FloatArray
    high: FloatArray


def _neighbours(
    meshes: Sequence[PartMesh], layout: Layout, poses: Iterable[tuple[float, float]], margin_mm: float
) -> Iterator[tuple[_Placed, _Placed, tuple[float, float]]]:
    """Pairs of parts whose boxes come nearer than a margin, at every pose that is new to them.

    Parts of one group, or of groups that have not moved against each other, need one look.
    """
    bodies = {mesh.name: manifold_mm(mesh) for mesh in meshes}
    seen: set[tuple[Group, Group, bytes]] = set()
    for q1, q2 in poses:
        frames = {group: body_from_group(layout, group, q1, q2) for group in Group}
        looks = {
            (a, b): (a, b, np.round((frames[a].inv() * frames[b]).as_matrix(), 9).tobytes())
            for a in Group
            for b in Group
        }
        fresh = {groups for groups, look in looks.items() if look not in seen}
        seen |= set(looks.values())
        placed = [_placed(mesh, bodies[mesh.name], frames[mesh.group]) for mesh in meshes]
        for first, second in combinations(placed, 2):
            near = (first.low - margin_mm <= second.high).all() and (second.low - margin_mm <= first.high).all()
            if near and (first.mesh.group, second.mesh.group) in fresh:
                yield first, second, (q1, q2)


def _placed(mesh: PartMesh, body: manifold3d.Manifold, pose: RigidTransform) -> _Placed:
    matrix = pose.as_matrix()[:3].copy()
    matrix[:, 3] *= 1000
    moved = body.transform(matrix)
    limits = np.array(moved.bounding_box())
    return _Placed(mesh=mesh, body=moved, low=limits[:3], high=limits[3:])
