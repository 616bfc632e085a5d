"""A hull from the user's file as one closed surface of moderate size, and what had to be done to it.

Reading, repairing and simplifying a large mesh takes long, so the outcome is kept in the cache under the hash of the
file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from cad.hulls.files.triangles import read_triangles
from cad.hulls.files.units import check_size
from cad.hulls.mesh_repair import check_that_it_stays_out_of_itself, repaired
from cad.hulls.mesh_simplification import simplified, surface_distance, thinned
from optics.kernels.cache import load_or_make, result_key
from rigs import FileHull, Rig
from rigs.files import STEP_SUFFIXES

MESH_SUFFIXES = (".stl", ".obj", ".ply")

HULL_MESH_VERSION = 1
"""Raised when reading, repair or simplification make another surface or other notes of the same file."""


@dataclass(frozen=True, kw_only=True)
class HullMesh:
    """Surface of a hull from a file.

    Attributes
    ----------
    surface : Trimesh
        Closed, normals outward, millimetres, in the file's axes.
    notes : tuple of str
        What was done to it, one sentence each.
    """

    surface: trimesh.Trimesh
    notes: tuple[str, ...]


def hull_notes(rig: Rig) -> list[str]:
    """What was done to a rig's hull file to make a closed surface of moderate size; empty when there is nothing to say.

    Raises
    ------
    ValueError
        When no such surface can be made of it.
    """
    hull = rig.file_hull
    if hull is None or hull.file.suffix.lower() in STEP_SUFFIXES:
        return []
    return [f"{hull.file.name}: {note}" for note in read_hull_mesh(hull).notes]


def body_from_file(hull: FileHull) -> RigidTransform:
    """Pose of the file's axes in the body frame, metres."""
    turn = Rotation.from_euler("ZYX", [hull.yaw_deg, -hull.pitch_deg, hull.roll_deg], degrees=True)
    return RigidTransform.from_components(np.array(hull.position_mm) / 1000, turn)


def posed_hull_mesh(hull: FileHull) -> trimesh.Trimesh:
    """Surface of a hull from a mesh file in the body frame, millimetres; raises as `read_hull_mesh`."""
    surface = read_hull_mesh(hull).surface
    posed = 1000 * body_from_file(hull).apply(np.asarray(surface.vertices) / 1000)
    return trimesh.Trimesh(posed, surface.faces, process=False)


def read_hull_mesh(hull: FileHull) -> HullMesh:
    """Surface of a hull from a mesh file, from the cache when it can be.

    Raises
    ------
    ValueError
        When the file cannot be used; the message names it and says what is wrong.
    """
    if hull.file.suffix.lower() not in MESH_SUFFIXES:
        known = ", ".join((*STEP_SUFFIXES, *MESH_SUFFIXES))
        raise ValueError(f"hull.file = {hull.file.name!r}: expected a file that ends in {known}")
    return load_or_make("hull mesh", hull_mesh_key(hull), lambda: _made(hull), pack=_packed, unpack=_unpacked)


def hull_mesh_key(hull: FileHull) -> str:
    """Key of a hull's surface: what is in the file, how it is read, and the libraries that repair it."""
    libraries = version("trimesh"), version("manifold3d")
    return result_key("hull mesh", HULL_MESH_VERSION, hull.file, hull.file.suffix.lower(), hull.unit, libraries)


def _made(hull: FileHull) -> HullMesh:
    try:
        vertices, faces = read_triangles(hull.file, hull.unit)
        check_size(np.ptp(vertices, axis=0), hull.unit)
        coarse, kept = thinned(vertices, faces)
        fixed = repaired(coarse, kept)
        surface = simplified(fixed.surface)
        check_that_it_stays_out_of_itself(surface)
    except ValueError as error:
        raise ValueError(f"hull.file = {hull.file.name!r}: {error}") from None
    notes = fixed.notes
    if surface is not fixed.surface or kept is not faces:
        given = trimesh.Trimesh(vertices, faces, process=False) if kept is not faces else fixed.surface
        away = f"at most {surface_distance(given, surface):.2g} mm away"
        notes = (*notes, f"simplified from {len(faces):,} to {len(surface.faces):,} triangles, {away}")
    return HullMesh(surface=surface, notes=notes)


def _packed(mesh: HullMesh) -> dict[str, NDArray[Any]]:
    faces = np.asarray(mesh.surface.faces, dtype=np.int32)
    notes = np.array(mesh.notes, dtype=str)
    return {"vertices": np.asarray(mesh.surface.vertices), "faces": faces, "notes": notes}


def _unpacked(stored: Mapping[str, NDArray[Any]]) -> HullMesh:
    surface = trimesh.Trimesh(stored["vertices"], stored["faces"], process=False)
    return HullMesh(surface=surface, notes=tuple(str(note) for note in stored["notes"]))
