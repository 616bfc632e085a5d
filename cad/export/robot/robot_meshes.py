"""Meshes that URDF and SDF point at, in metres: what is seen, and the convex pieces that collide."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import trimesh

from cad.export.robot.convex import convex_pieces
from optics.mesh import PartMesh

VISUAL = Path("meshes/visual")
COLLISION = Path("meshes/collision")
COLLIDING = {"mount", "servo", "mirror"}
"""Roles that collide. Screws sit inside the parts; the hull is the vehicle's own model's business."""


def write_robot_meshes(meshes: Sequence[PartMesh], folder: Path) -> None:
    """Write the meshes of parts below the folder in which URDF and SDF lie."""
    for place in (VISUAL, COLLISION):
        (folder / place).mkdir(parents=True, exist_ok=True)
    for mesh in meshes:
        surface = trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
        (folder / visual_file(mesh)).write_bytes(surface.export(file_type="stl"))
        if mesh.role.value in COLLIDING:
            for number, piece in enumerate(convex_pieces(mesh), start=1):
                (folder / COLLISION / f"{mesh.name}_{number}.stl").write_bytes(piece.export(file_type="stl"))


def visual_file(mesh: PartMesh) -> Path:
    """File of a part's shape, relative to the folder in which URDF and SDF lie."""
    return VISUAL / f"{mesh.name}.stl"


def collision_files(mesh: PartMesh, folder: Path) -> list[Path]:
    """Files of a part's convex pieces, in order, relative to the folder in which URDF and SDF lie."""
    found: list[Path] = []
    for number in range(1, 1000):
        file = COLLISION / f"{mesh.name}_{number}.stl"
        if not (folder / file).is_file():
            return found
        found.append(file)
    return found
