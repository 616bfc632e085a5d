"""Solids as triangles in metres."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import NDArray

from cad.assembly import Assembly, Part
from optics.mesh import PartMesh, Role

LINEAR_TOLERANCE_MM = 0.05
ANGULAR_TOLERANCE_RAD = 0.2
HULL_LINEAR_TOLERANCE_MM = 0.2
"""A hull is large, seen from afar and on most rays' way: fewer triangles."""
WELD_MM = 1e-6
"""Neighbouring faces of a solid are tessellated one by one; their shared vertices agree to rounding only."""


def tessellate(assembly: Assembly) -> list[PartMesh]:
    """Parts of an assembly as triangles, in the order of the parts.

    Returns
    -------
    list of PartMesh
        Closed surfaces in metres, each in the frame of its part's group.
    """
    return [_part_mesh(part) for part in assembly.parts]


def _part_mesh(part: Part) -> PartMesh:
    mesh = part.solid if isinstance(part.solid, trimesh.Trimesh) else _triangles(part)
    return PartMesh(
        name=part.name,
        group=part.group,
        role=part.role,
        vertices_m=np.asarray(mesh.vertices, dtype=np.float64) / 1000,
        faces=np.asarray(mesh.faces, dtype=np.int32),
    )


def _triangles(part: Part) -> trimesh.Trimesh:
    tolerance = HULL_LINEAR_TOLERANCE_MM if part.role is Role.HULL else LINEAR_TOLERANCE_MM
    points, corners = part.solid.tessellate(tolerance, ANGULAR_TOLERANCE_RAD)
    vertices = np.array([tuple(point) for point in points], dtype=np.float64)
    return welded(vertices, np.array(corners, dtype=np.int64))


def welded(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> trimesh.Trimesh:
    """Mesh with coinciding vertices joined and the triangles dropped that then have no area.

    Spheres and fillets have triangles at their poles with two corners in one place; left in, they make a closed
    surface look open.
    """
    _, first, owner = np.unique(np.round(vertices / WELD_MM), axis=0, return_index=True, return_inverse=True)
    faces = owner.reshape(-1)[faces]
    distinct = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return trimesh.Trimesh(vertices=vertices[first], faces=faces[distinct], process=False)
