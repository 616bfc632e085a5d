"""A hull from the user's file: the surface that rays hit, the solid that bodies touch, and what was done for either.

That takes long for a large mesh, so both are kept in the cache under the hash of the file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from cad.hulls.facing import faced_outwards
from cad.hulls.files.step import is_one_solid
from cad.hulls.files.triangles import READERS, read_triangles
from cad.hulls.files.units import check_size
from cad.hulls.hull_mesh_key import hull_mesh_key, named
from cad.hulls.mesh_repair import NotClosedError, body_notes, repaired
from cad.hulls.mesh_simplification import decimated, surface_distance
from cad.hulls.wrapping.fit import check_that_it_stays_out_of_itself
from cad.hulls.wrapping.wrap import Wrap, wrapped
from optics.kernels.cache import load_or_make
from rigs import FileHull, Rig


@dataclass(frozen=True, kw_only=True)
class HullMesh:
    """A hull from a file as triangles.

    Attributes
    ----------
    surface : Trimesh
        Millimetres, in the file's axes; of a solid closed, with its normals outward.
    notes : tuple of str
        What was done to it, one sentence each.
    """

    surface: trimesh.Trimesh
    notes: tuple[str, ...]


def hull_notes(rig: Rig) -> list[str]:
    """What was done to a rig's hull file to make surface and solid of it; empty when there is nothing to say.

    Raises
    ------
    ValueError
        When no solid can be made of it.
    """
    hull = rig.file_hull
    if hull is None or is_one_solid(hull.file):
        return []
    notes = (*read_hull_surface(hull).notes, *read_hull_solid(hull).notes)
    return [f"{hull.file.name}: {note}" for note in dict.fromkeys(notes)]


def body_from_file(hull: FileHull) -> RigidTransform:
    """Pose of the file's axes in the body frame, metres."""
    turn = Rotation.from_euler("ZYX", [hull.yaw_deg, -hull.pitch_deg, hull.roll_deg], degrees=True)
    return RigidTransform.from_components(np.array(hull.position_mm) / 1000, turn)


def posed(hull: FileHull, surface: trimesh.Trimesh) -> trimesh.Trimesh:
    """Triangles in a hull file's axes in the body frame, millimetres."""
    vertices = 1000 * body_from_file(hull).apply(np.asarray(surface.vertices) / 1000)
    return trimesh.Trimesh(vertices, surface.faces, process=False)


def read_hull_surface(hull: FileHull) -> HullMesh:
    """What rays hit of a hull from a mesh file, from the cache when it can be: its triangles as they are.

    Corners in one place are one, there are at most `MOST_TRIANGLES`, and holes stay open. Triangles face outwards as
    far as there is an outside: how they face in the file says nothing.

    Raises
    ------
    ValueError
        When the file cannot be used; the message names it and says what is wrong.
    """
    return _kept("hull triangles", hull, _made_surface)


def read_hull_solid(hull: FileHull) -> HullMesh:
    """Solid of a hull from a mesh file as closed triangles, from the cache when it can be.

    It is the surface itself where that is closed, or nearly so, and stays out of itself; else a wrap around it.

    Raises
    ------
    ValueError
        As `read_hull_surface`.
    """
    return _kept("hull solid", hull, _made_solid)


def _kept(kind: str, hull: FileHull, make: Callable[[FileHull], HullMesh]) -> HullMesh:
    if hull.file.suffix.lower() not in READERS:
        raise ValueError(f"hull.file = {hull.file.name!r}: expected a file that ends in {', '.join(READERS)}")
    return load_or_make(kind, hull_mesh_key(hull), lambda: make(hull), pack=_packed, unpack=_unpacked)


def _made_surface(hull: FileHull) -> HullMesh:
    with named(hull):
        vertices, faces = read_triangles(hull.file, hull.unit)
        check_size(np.ptp(vertices, axis=0), hull.unit)
    # Light on a surface is found for its fronts.
    given = trimesh.Trimesh(vertices, faced_outwards(vertices, faces), process=False)
    surface = decimated(given)
    if surface is given:
        return HullMesh(surface=given, notes=())
    away = f"at most {surface_distance(given, surface):.2g} mm away"
    note = f"simplified from {len(faces):,} to {len(surface.faces):,} triangles, {away}"
    return HullMesh(surface=surface, notes=(note,))


def _made_solid(hull: FileHull) -> HullMesh:
    surface = read_hull_surface(hull).surface
    try:
        fixed = repaired(np.asarray(surface.vertices), np.asarray(surface.faces, dtype=np.int64), hull.keep)
        check_that_it_stays_out_of_itself(fixed.surface)
    except NotClosedError as reason:
        wrap = wrapped(surface, hull.keep)
        return HullMesh(surface=wrap.surface, notes=(_wrap_note(wrap, reason.what), *_bar_notes(wrap)))
    return HullMesh(surface=fixed.surface, notes=fixed.notes)


def _wrap_note(wrap: Wrap, what: str) -> str:
    return (
        f"its solid is a wrap of {len(wrap.surface.faces):,} triangles around it, as it has {what}: half of the wrap "
        f"is within {wrap.median:.2g} mm of the file's surface, 95 % within {wrap.p95:.2g} mm; what is narrower than "
        f"{wrap.closed:.2g} mm is closed"
    )


def _bar_notes(wrap: Wrap) -> list[str]:
    joined = [f"joined {len(wrap.bars) + 1} bodies by bars of up to {max(wrap.bars):.0f} mm"] if wrap.bars else []
    return joined + body_notes(wrap.bodies, wrap.left_out)


def _packed(mesh: HullMesh) -> dict[str, NDArray[Any]]:
    faces = np.asarray(mesh.surface.faces, dtype=np.int32)
    notes = np.array(mesh.notes, dtype=str)
    return {"vertices": np.asarray(mesh.surface.vertices), "faces": faces, "notes": notes}


def _unpacked(stored: Mapping[str, NDArray[Any]]) -> HullMesh:
    surface = trimesh.Trimesh(stored["vertices"], stored["faces"], process=False)
    return HullMesh(surface=surface, notes=tuple(str(note) for note in stored["notes"]))
