"""Parts as bodies whose gap can be measured at any pose: triangles in trees of boxes (FCL)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import fcl
import numpy as np
import trimesh
from numpy.typing import NDArray

from cad.assembly.tessellation import HULL_LINEAR_TOLERANCE_MM, LINEAR_TOLERANCE_MM
from optics.kernels.arrays import FloatArray
from optics.mesh import Group, PartMesh, Role, merge

LONGEST_EDGE_MM = 15.0
"""Long triangles are cut to this before a body is split into shells, so that few of them span several."""
SHELL_RATIO = 2.0
INNERMOST_SHELL_MM = 4.0


@dataclass(frozen=True, kw_only=True)
class Body:
    """One part, several that move together, or a piece of the surface of one.

    Attributes
    ----------
    name : str
        Of the part or the collection.
    group : Group
        What it moves with; the vertices are in that group's frame.
    vertices_mm : array, shape (n, 3)
    faces : array, shape (m, 3)
    chord_mm : float
        How far the true surface may lie from the triangles.
    tree : fcl.BVHModel
        The triangles, in boxes.
    """

    name: str
    group: Group
    vertices_mm: FloatArray
    faces: NDArray[np.int32]
    chord_mm: float
    tree: fcl.BVHModel

    @classmethod
    def of(cls, name: str, meshes: Sequence[PartMesh]) -> Body:
        """Body of meshes of one group."""
        vertices_m, faces, _ = merge(meshes)
        vertices = 1000 * vertices_m
        return cls(
            name=name,
            group=meshes[0].group,
            vertices_mm=vertices,
            faces=faces,
            chord_mm=max(chord_mm(mesh.role) for mesh in meshes),
            tree=_tree(vertices, faces),
        )

    def gap_mm(self, other: Body, turn: FloatArray, shift_mm: FloatArray) -> float:
        """Smallest distance between the two surfaces, millimetres; 0 when they cross.

        One body wholly inside the other is not seen: their surfaces do not intersect. The other's pose is given in the
        frame of this one: rotation matrix, shape (3, 3), and translation, shape (3,), millimetres.
        """
        here, there = fcl.CollisionObject(self.tree), fcl.CollisionObject(other.tree, fcl.Transform(turn, shift_mm))
        return max(float(fcl.distance(here, there, fcl.DistanceRequest(), fcl.DistanceResult())), 0.0)

    def shells(self, origin_mm: FloatArray, axis: FloatArray) -> list[Body]:
        """Pieces of the surface by their distance from an axis, each reaching twice as far as the one before.

        What is near to a joint's axis moves little when it turns, so gaps there are proven in large steps.
        """
        vertices, faces = trimesh.remesh.subdivide_to_size(self.vertices_mm, self.faces, LONGEST_EDGE_MM)
        reach = distances_mm(vertices, origin_mm, axis)[faces].max(axis=1)
        level = np.ceil(np.log(np.maximum(reach / INNERMOST_SHELL_MM, 1)) / np.log(SHELL_RATIO))
        pieces = []
        for step in np.unique(level):
            used, renumbered = np.unique(faces[level == step], return_inverse=True)
            corners = renumbered.reshape(-1, 3).astype(np.int32)
            pieces.append(
                Body(
                    name=self.name,
                    group=self.group,
                    vertices_mm=vertices[used],
                    faces=corners,
                    chord_mm=self.chord_mm,
                    tree=_tree(vertices[used], corners),
                )
            )
        return pieces


def chord_mm(role: Role) -> float:
    """How far the true surface of a part may lie from its triangles, millimetres."""
    return HULL_LINEAR_TOLERANCE_MM if role is Role.HULL else LINEAR_TOLERANCE_MM


def distances_mm(points_mm: FloatArray, origin_mm: FloatArray, axis: FloatArray) -> FloatArray:
    """Distances of points from an axis (a unit vector), millimetres, shape (n,)."""
    return np.asarray(np.linalg.norm(np.cross(points_mm - origin_mm, axis), axis=1))


def _tree(vertices: FloatArray, faces: NDArray[np.int32]) -> fcl.BVHModel:
    tree = fcl.BVHModel()
    tree.beginModel(len(faces), len(vertices))
    tree.addSubModel(vertices, faces)
    tree.endModel()
    return tree
