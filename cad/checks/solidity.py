"""Whether each part is one solid, and its triangles a closed surface around the same volume."""

from __future__ import annotations

import trimesh
from build123d import GeomType

from cad.assembly.assembly import Part
from cad.checks.clearance.bodies import chord_mm
from cad.finding import Finding, Sense
from cad.overlaps import manifold_mm
from optics.mesh import PartMesh
from rigs import Problem

CHECK = "one closed solid"
ROUNDING = 1e-9
"""Relative; two sums of the same tetrahedra."""


def solidity(part: Part, mesh: PartMesh) -> Finding:
    """One valid solid, a watertight mesh, and one volume by three libraries.

    The volume of the triangles differs from the solid's by no more than the curved surface times the chord error of the
    tessellation; trimesh and manifold3d must give the same to rounding.
    """
    surface = trimesh.Trimesh(1000 * mesh.vertices_m, mesh.faces, process=False)
    found = Finding(check=CHECK, subject=part.name, unit="mm³", sense=Sense.AT_MOST)
    if not surface.is_watertight:
        return _failed(found, "open surface", "a watertight surface")
    volume = float(surface.volume)
    meshed = manifold_mm(mesh).volume()
    if abs(meshed - volume) > ROUNDING * surface.area * surface.scale:
        return _failed(found, f"{volume:.3f} mm³ by trimesh, {meshed:.3f} mm³ by manifold3d", "the same volume twice")
    if isinstance(part.solid, trimesh.Trimesh):
        return Finding(check=CHECK, subject=part.name, note=f"{volume:.0f} mm³, a mesh from a file")
    solids, valid = len(part.solid.solids()), bool(part.solid.is_valid)
    if solids != 1 or not valid:
        return _failed(found, f"{solids} solids, valid: {valid}", "exactly one valid solid")
    exact = float(part.solid.volume)
    curved = sum(face.area for face in part.solid.faces() if face.geom_type is not GeomType.PLANE)
    limit = float(curved) * chord_mm(part.role) + ROUNDING * exact
    difference = abs(volume - exact)
    if difference > limit:
        expected = f"a mesh of the solid's {exact:.0f} mm³ to within {limit:.0f} mm³"
        return _failed(found, f"{volume:.0f} mm³", expected)
    return Finding(
        check=CHECK,
        subject=part.name,
        figure=difference,
        unit="mm³",
        limit=limit,
        sense=Sense.AT_MOST,
        note=f"difference between the triangles' volume and the solid's {exact:.0f} mm³",
    )


def _failed(found: Finding, value: str, expected: str) -> Finding:
    problem = Problem(place=found.subject, value=value, expected=expected)
    return Finding(check=found.check, subject=found.subject, problem=problem)
