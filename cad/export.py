"""The mount as files: an STL per part, one STEP assembly and one GLB, the same bytes for the same rig."""

from __future__ import annotations

import itertools
import re
import tempfile
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

import numpy as np
import trimesh
from build123d import Compound, Solid, export_step

from cad.assembly import Assembly, build_assembly
from cad.shapes import location_mm
from cad.tessellation import tessellate
from optics.mesh import PartMesh, Role
from rigs import Rig

OCCURRENCE = re.compile(rb"NEXT_ASSEMBLY_USAGE_OCCURRENCE\(\s*'\d+'(.*?);", re.DOTALL)
"""A part's place in a STEP assembly; its identifier is counted up over all files that a process writes."""
STEP_TIMESTAMP = datetime(2021, 1, 1)
"""A STEP header must have a date; a fixed one keeps the file's bytes the same."""
COLOURS = {
    Role.HULL: (176, 180, 187, 255),
    Role.MOUNT: (232, 163, 61, 255),
    Role.SERVO: (51, 58, 68, 255),
    Role.MIRROR: (200, 225, 240, 255),
}
GLB_FROM_BODY = np.array([[0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""glTF is y up and looks along -z: x right is the body's -y, y up is z, and -z is forward."""


def export_mount(rig: Rig, folder: Path, q1: float = 0.0, q2: float = 0.0) -> list[Path]:
    """Write a rig's mount.

    Parameters
    ----------
    rig : Rig
        A rig with mirrors.
    folder : Path
        Where to write; made when it is missing.
    q1, q2 : float
        Joint values of the STEP and GLB assemblies, radians.

    Returns
    -------
    list of Path
        One STL per part (millimetres, in the frame of the part's group), then the STEP (millimetres, body frame;
        without a hull that is only a mesh) and the GLB (metres, y up, -z forward).
    """
    assembly = build_assembly(rig)
    meshes = tessellate(assembly)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}-") as scratch:
        partial = Path(scratch)
        written = [_write_stl(mesh, partial) for mesh in meshes]
        written.append(_write_step(assembly, partial / f"{rig.name}.step", q1, q2))
        written.append(_write_glb(assembly, meshes, partial / f"{rig.name}.glb", q1, q2))
        folder.mkdir(exist_ok=True)
        for path in written:
            path.replace(folder / path.name)
    return [folder / path.name for path in written]


def _write_stl(mesh: PartMesh, folder: Path) -> Path:
    path = folder / f"{mesh.name}.stl"
    surface = trimesh.Trimesh(1000 * mesh.vertices_m, mesh.faces, process=False)
    path.write_bytes(surface.export(file_type="stl"))
    return path


def _write_step(assembly: Assembly, path: Path, q1: float, q2: float) -> Path:
    placed = []
    for part in assembly.parts:
        if isinstance(part.solid, trimesh.Trimesh):
            continue
        solid: Solid = location_mm(assembly.pose(part, q1, q2)) * part.solid
        solid.label = part.name
        placed.append(solid)
    whole = Compound(label=path.stem, children=placed)
    if not export_step(whole, path, timestamp=STEP_TIMESTAMP):
        raise OSError(f"expected to write {path.name}, but the STEP writer gave up")
    path.write_bytes(_renumbered(path.read_bytes()))
    return path


def _renumbered(step: bytes) -> bytes:
    """Count the places of parts from 1, each on one line: otherwise the bytes depend on what was written before."""
    number = itertools.count(1)

    def occurrence(found: re.Match[bytes]) -> bytes:
        rest = re.sub(rb"\n\s*", b"", found[1])
        return b"NEXT_ASSEMBLY_USAGE_OCCURRENCE('%d'%s;" % (next(number), rest)

    return OCCURRENCE.sub(occurrence, step)


def _write_glb(assembly: Assembly, meshes: Sequence[PartMesh], path: Path, q1: float, q2: float) -> Path:
    scene = trimesh.Scene()
    for part, mesh in zip(assembly.parts, meshes, strict=True):
        surface = trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
        # Flat faces meet at sharp edges: shared normals would make them look inflated.
        surface.unmerge_vertices()
        surface.visual = trimesh.visual.TextureVisuals(
            material=trimesh.visual.material.PBRMaterial(
                name=part.role.value, baseColorFactor=COLOURS[part.role], metallicFactor=0.0, roughnessFactor=0.6
            )
        )
        pose = GLB_FROM_BODY @ assembly.pose(part, q1, q2).as_matrix()
        scene.add_geometry(surface, node_name=part.name, geom_name=part.name, transform=pose)
    path.write_bytes(scene.export(file_type="glb"))
    return path
