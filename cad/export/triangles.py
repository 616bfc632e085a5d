"""Triangles for printers and viewers: an STL per part and the assembly as GLB, the same bytes for the same rig."""

from __future__ import annotations

from pathlib import Path

import trimesh

from cad.assembly.assembly import Assembly
from cad.colours import colour
from cad.export.glb import add_surface
from optics.mesh import PartMesh


def write_stl(mesh: PartMesh, folder: Path) -> Path:
    """Write one part in millimetres, in the frame of its group."""
    path = folder / f"{mesh.name}.stl"
    surface = trimesh.Trimesh(1000 * mesh.vertices_m, mesh.faces, process=False)
    path.write_bytes(surface.export(file_type="stl"))
    return path


def write_glb(assembly: Assembly, path: Path, q1: float = 0.0, q2: float = 0.0) -> Path:
    """Write the assembly in metres, y up, -z forward; joint values in radians."""
    scene = trimesh.Scene()
    for part in assembly.parts:
        add_surface(
            scene,
            trimesh.Trimesh(part.mesh.vertices_m, part.mesh.faces, process=False),
            assembly.pose(part, q1, q2).as_matrix(),
            name=part.name,
            material=part.role.value,
            colour=colour(part.role),
        )
    path.write_bytes(scene.export(file_type="glb"))
    return path
