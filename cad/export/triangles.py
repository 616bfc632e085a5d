"""Triangles for printers and viewers: an STL per part and the assembly as GLB, the same bytes for the same rig."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from cad.assembly.assembly import Assembly
from cad.colours import colour
from optics.mesh import PartMesh

GLB_FROM_BODY = np.array([[0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""glTF is y up and looks along -z: x right is the body's -y, y up is z, and -z is forward."""


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
        surface = trimesh.Trimesh(part.mesh.vertices_m, part.mesh.faces, process=False)
        # Flat faces meet at sharp edges: shared normals would make them look inflated.
        surface.unmerge_vertices()
        surface.visual = trimesh.visual.TextureVisuals(
            material=trimesh.visual.material.PBRMaterial(
                name=part.role.value,
                baseColorFactor=(*colour(part.role), 255),
                metallicFactor=0.0,
                roughnessFactor=0.6,
            )
        )
        pose = GLB_FROM_BODY @ assembly.pose(part, q1, q2).as_matrix()
        scene.add_geometry(surface, node_name=part.name, geom_name=part.name, transform=pose)
    path.write_bytes(scene.export(file_type="glb"))
    return path
