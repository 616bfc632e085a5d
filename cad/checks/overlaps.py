"""Which parts are in each other's way, as volumes of intersection of closed triangle meshes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations

import manifold3d
import numpy as np
from scipy.spatial.transform import RigidTransform

from cad.poses import body_from_group
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
    """How near a moving part comes to a fixed one, at some joint values (radians); 0 when they meet."""

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


def joint_grid(layout: Layout, steps: int) -> list[tuple[float, float]]:
    """Joint values on a regular grid over both ranges, ends included, and the rest position; radians."""
    ranges = [np.radians(np.linspace(j.min_deg, j.max_deg, steps)) for j in (layout.pan, layout.tilt)]
    return [(0.0, 0.0), *((float(q1), float(q2)) for q1 in ranges[0] for q2 in ranges[1])]


def overlaps(meshes: Sequence[PartMesh], layout: Layout, poses: Iterable[tuple[float, float]]) -> list[Overlap]:
    """Pairs of parts that share more volume than the tolerance, each pair at its worst pose."""
    bodies = {mesh.name: manifold_mm(mesh) for mesh in meshes}
    worst: dict[tuple[str, str], Overlap] = {}
    seen: set[tuple[str, str, bytes]] = set()
    for q1, q2 in poses:
        frames = {group: body_from_group(layout, group, q1, q2) for group in Group}
        for first, second in combinations(meshes, 2):
            relative = frames[first.group].inv() * frames[second.group]
            # Parts of one group, or of groups that have not moved against each other, need one look.
            look = (first.name, second.name, np.round(relative.as_matrix(), 9).tobytes())
            if look in seen:
                continue
            seen.add(look)
            volume = (bodies[first.name] ^ _moved(bodies[second.name], relative)).volume()
            pair = (first.name, second.name)
            if volume > max(OVERLAP_TOLERANCE_MM3, worst[pair].volume_mm3 if pair in worst else 0.0):
                worst[pair] = Overlap(first=pair[0], second=pair[1], volume_mm3=volume, q1=q1, q2=q2)
    return list(worst.values())


def smallest_gaps(
    meshes: Sequence[PartMesh], layout: Layout, poses: Iterable[tuple[float, float]], below_mm: float
) -> list[Gap]:
    """Pairs of a moving and a fixed part that come nearer to each other than `below_mm`, each at its worst pose."""
    bodies = {mesh.name: manifold_mm(mesh) for mesh in meshes}
    fixed = [mesh.name for mesh in meshes if mesh.group is Group.FIXED]
    worst: dict[tuple[str, str], Gap] = {}
    for q1, q2 in poses:
        for mesh in meshes:
            if mesh.group is Group.FIXED:
                continue
            moved = _moved(bodies[mesh.name], body_from_group(layout, mesh.group, q1, q2))
            for other in fixed:
                gap = moved.min_gap(bodies[other], below_mm)
                if gap < (worst[mesh.name, other].gap_mm if (mesh.name, other) in worst else below_mm):
                    worst[mesh.name, other] = Gap(moving=mesh.name, fixed=other, gap_mm=gap, q1=q1, q2=q2)
    return list(worst.values())


def _moved(body: manifold3d.Manifold, pose: RigidTransform) -> manifold3d.Manifold:
    matrix = pose.as_matrix()[:3].copy()
    matrix[:, 3] *= 1000
    return body.transform(matrix)
