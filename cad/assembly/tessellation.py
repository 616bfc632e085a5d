"""Solids as triangles."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import trimesh
from build123d import Solid
from numpy.typing import NDArray
from OCP.BRep import BRep_Tool
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.TopAbs import TopAbs_Orientation
from OCP.TopLoc import TopLoc_Location

from optics.mesh import joined_triangles

LINEAR_TOLERANCE_MM = 0.05
"""Between chords and curves; no more than the clearance of a journal in its bushing: meshes that fit stay apart."""
HULL_LINEAR_TOLERANCE_MM = 0.2
"""A hull is large, seen from afar and on most rays' way: fewer triangles."""
ANGULAR_TOLERANCE_RAD = 0.24
"""Between neighbouring chords: 26 around a hole, whose area they then give to 1 %."""
PINCH_MM = LINEAR_TOLERANCE_MM
"""A solid that touches itself along less, where an edge ends in a face, touches itself in a point."""
WELD_MM = 1e-6
"""Neighbouring faces of a solid are tessellated one by one; their shared vertices agree to rounding only."""
MOST_KEPT = 64
"""Solids whose triangles are kept, of those that stand in several places."""


def tessellated(solid: Solid, tolerance_mm: float = LINEAR_TOLERANCE_MM) -> trimesh.Trimesh:
    """Mesh of a solid, millimetres; build123d's own takes tolerances relative to the length of each edge.

    It is made in the frame in which the solid was: the screws of a rig, of all rigs, are one solid in many places.
    """
    place = solid.wrapped.Location()
    if place.IsIdentity():
        return _tessellated(solid, tolerance_mm)
    own = _kept_tessellated(Solid(solid.wrapped.Located(TopLoc_Location())), tolerance_mm)
    return trimesh.Trimesh(vertices=_placed(own.vertices, place), faces=own.faces, process=False)


def _tessellated(solid: Solid, tolerance_mm: float) -> trimesh.Trimesh:
    # It may have triangles of another tolerance.
    BRepTools.Clean_s(solid.wrapped)
    BRepMesh_IncrementalMesh(solid.wrapped, tolerance_mm, False, ANGULAR_TOLERANCE_RAD, True)
    pieces = []
    for face in solid.faces():
        place = TopLoc_Location()
        triangulation = BRep_Tool.Triangulation_s(face.wrapped, place)
        nodes = [triangulation.Node(number).Coord() for number in range(1, triangulation.NbNodes() + 1)]
        # By number: an iterator over all of them takes ten times as long.
        corners = [triangulation.Triangle(number).Get() for number in range(1, triangulation.NbTriangles() + 1)]
        outside = face.wrapped.Orientation() != TopAbs_Orientation.TopAbs_REVERSED
        points = _placed(np.array(nodes), place)
        pieces.append((points, np.array(corners, dtype=np.int32)[:, :: 1 if outside else -1] - 1))
    return without_pinches(welded(*joined_triangles(pieces)))


_kept_tessellated = lru_cache(maxsize=MOST_KEPT)(_tessellated)


def _placed(points: NDArray[np.float64], place: TopLoc_Location) -> NDArray[np.float64]:
    transformation = place.Transformation()
    matrix = np.array([[transformation.Value(row, column) for column in (1, 2, 3, 4)] for row in (1, 2, 3)])
    return np.asarray(points @ matrix[:, :3].T + matrix[:, 3])


def welded(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> trimesh.Trimesh:
    """Mesh with coinciding vertices joined and the triangles dropped that then have no area.

    Spheres and fillets have triangles at their poles with two corners in one place; left in, they make a closed
    surface look open.
    """
    _, first, owner = np.unique(np.round(vertices / WELD_MM), axis=0, return_index=True, return_inverse=True)
    joined = owner.reshape(-1)[faces]
    distinct = (joined[:, 0] != joined[:, 1]) & (joined[:, 1] != joined[:, 2]) & (joined[:, 2] != joined[:, 0])
    return trimesh.Trimesh(vertices=vertices[first], faces=joined[distinct], process=False)


def without_pinches(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Mesh whose shortest edges that not exactly two triangles share are points."""
    edges, count = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    pinched, vertices = edges[count != 2], np.array(mesh.vertices)
    lengths = np.linalg.norm(vertices[pinched[:, 0]] - vertices[pinched[:, 1]], axis=1)
    short = pinched[lengths < PINCH_MM]
    if not len(short):
        return mesh
    vertices[short[:, 1]] = vertices[short[:, 0]]
    return welded(vertices, np.asarray(mesh.faces, dtype=np.int32))
