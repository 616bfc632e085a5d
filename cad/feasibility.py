"""Whether a mount can be made, fitted and moved: checks on solids and their meshes, each failure with its place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh
from numpy.typing import ArrayLike
from trimesh.proximity import closest_point_naive

from cad.assembly import Assembly, Part
from cad.collisions import Gap, Overlap, joint_grid, manifold_mm, overlaps, smallest_gaps
from cad.fold_bracket import FLANGE_LENGTH_MM
from cad.shapes import cylinder, location_mm
from cad.tessellation import tessellate, welded
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from rigs import FlatPortSpec, Mount, Problem, Rig

VOLUME_TOLERANCE = 0.01
"""Relative; the tessellation's chords cut curved parts by less."""
ANCHOR_TOLERANCE_MM = 1.0
CONTACT_DEPTH_MM = 0.5
"""How far a flange may sink into a curved hull: the printed part is filed or shimmed to that."""
GRID_STEPS = 5
PORT_VIEW_TOLERANCE_MM3 = 1.0
CLEARANCE_TOLERANCE_MM = 0.1
"""Twice the tessellation's tolerance."""

Pose = tuple[float, float]
"""Joint values (q1, q2), radians."""


def assembly_problems(rig: Rig, assembly: Assembly, *, grid_steps: int = GRID_STEPS) -> list[Problem]:
    """Find what is wrong with an assembly.

    Parameters
    ----------
    rig : Rig
        The rig the assembly was built from.
    assembly : Assembly
        Its solids.
    grid_steps : int
        Steps along each joint's range at which collisions are looked for.

    Returns
    -------
    list of Problem
        Empty when everything is in order; places are keys of the rig file or names of parts.
    """
    if rig.mount is None:
        raise ValueError(f"expected a rig with mirrors, got {rig.name!r}, which has none")
    meshes = tessellate(assembly)
    open_parts = [
        problem for part, mesh in zip(assembly.parts, meshes, strict=True) for problem in _solidity(part, mesh)
    ]
    if open_parts:
        # Volumes of intersection mean nothing for surfaces that are not closed.
        return open_parts
    problems = [problem for part in assembly.parts for problem in _printability(part, rig.mount)]
    hull = next(mesh for mesh in meshes if mesh.role is Role.HULL)
    problems += _anchors(hull, rig.mount)
    problems += _view_of_the_port(rig, hull, assembly.layout)
    poses = joint_grid(assembly.layout, grid_steps)
    problems += _collisions(meshes, assembly.layout, poses)
    return problems + _clearances(meshes, assembly.layout, poses, rig.mount.clearance_mm)


def _solidity(part: Part, mesh: PartMesh) -> list[Problem]:
    """One solid, valid, and the mesh of it closed and of the same volume."""
    surface = trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
    if not surface.is_watertight:
        return [Problem(place=part.name, value="open surface", expected="a watertight surface")]
    if isinstance(part.solid, trimesh.Trimesh):
        return []
    problems = []
    if len(part.solid.solids()) != 1 or not part.solid.is_valid:
        value = f"{len(part.solid.solids())} solids, valid: {part.solid.is_valid}"
        problems.append(Problem(place=part.name, value=value, expected="exactly one valid solid"))
    volume = 1e9 * surface.volume
    if abs(volume - part.solid.volume) > VOLUME_TOLERANCE * part.solid.volume:
        expected = f"a mesh of the solid's {part.solid.volume:.0f} mm³ to within {VOLUME_TOLERANCE:.0%}"
        problems.append(Problem(place=part.name, value=f"{volume:.0f} mm³", expected=expected))
    return problems


def _printability(part: Part, mount: Mount) -> list[Problem]:
    """A printed part fits on the printer in some axis-aligned orientation."""
    if not part.printed:
        return []
    size = sorted(part.solid.bounding_box().size)
    if all(side <= room for side, room in zip(size, sorted(mount.printer_bed_mm), strict=True)):
        return []
    value = f"{part.name} of {size[2]:.0f} x {size[1]:.0f} x {size[0]:.0f} mm"
    return [Problem(place="mount.printer_bed_mm", value=value, expected=f"parts within {mount.printer_bed_mm} mm")]


def _anchors(hull: PartMesh, mount: Mount) -> list[Problem]:
    """The anchors lie on the hull's surface."""
    surface = trimesh.Trimesh(1000 * hull.vertices_m, hull.faces, process=False)
    problems = []
    for key in ("fold_anchor_mm", "base_anchor_mm"):
        anchor = getattr(mount, key)
        nearest, distance, _ = closest_point_naive(surface, np.array([anchor]))
        if distance[0] > ANCHOR_TOLERANCE_MM:
            expected = f"a point on the hull; the nearest is {_coordinates(nearest[0])}, {distance[0]:.1f} mm away"
            problems.append(Problem(place=f"mount.{key}", value=anchor, expected=expected))
    return problems


def _coordinates(point: ArrayLike) -> str:
    return "(" + ", ".join(f"{value:.1f}" for value in np.asarray(point)) + ")"


def _view_of_the_port(rig: Rig, hull: PartMesh, layout: Layout) -> list[Problem]:
    """No part of the hull stands between a flat port and M1."""
    if not isinstance(rig.port, FlatPortSpec) or rig.fold_mirror is None:
        return []
    normal = np.array(rig.port.normal) / np.linalg.norm(rig.port.normal)
    start = (rig.port.distance_mm + rig.port.thickness_mm) * normal
    end = start + rig.fold_mirror.distance_mm * normal
    view = location_mm(layout.body_from_camera) * cylinder(start, end, rig.port.aperture_diameter_mm / 2)
    points, corners = view.tessellate(0.1, 0.2)
    body = welded(np.array([tuple(point) for point in points]), np.array(corners))
    mesh = PartMesh(
        name="view",
        group=Group.FIXED,
        role=Role.HULL,
        vertices_m=np.asarray(body.vertices) / 1000,
        faces=np.asarray(body.faces, dtype=np.int32),
    )
    volume = (manifold_mm(mesh) ^ manifold_mm(hull)).volume()
    if volume <= PORT_VIEW_TOLERANCE_MM3:
        return []
    expected = "a camera whose port looks into the water: the hull stands in front of it"
    return [Problem(place="camera.position_mm", value=rig.camera.position_mm, expected=expected)]


def _collisions(meshes: Sequence[PartMesh], layout: Layout, poses: Sequence[Pose]) -> list[Problem]:
    """Parts stay out of each other, at rest and over the joint range."""
    found = overlaps(meshes, layout, poses)
    roles = {mesh.name: mesh.role for mesh in meshes}
    return [_collision_problem(overlap) for overlap in found if overlap.volume_mm3 > _allowance(overlap, roles)]


def _allowance(overlap: Overlap, roles: dict[str, Role]) -> float:
    """Volume that a flange may share with a hull that is not flat under it; 0 for any other pair."""
    bolted = overlap.second in ("fold_bracket", "gimbal_base") or overlap.first in ("fold_bracket", "gimbal_base")
    if Role.HULL in (roles[overlap.first], roles[overlap.second]) and bolted:
        return CONTACT_DEPTH_MM * FLANGE_LENGTH_MM**2
    return 0.0


def _clearances(
    meshes: Sequence[PartMesh], layout: Layout, poses: Sequence[Pose], clearance_mm: float
) -> list[Problem]:
    """What moves keeps its distance from what stands still, but for the yoke on its horn."""
    gaps = smallest_gaps(meshes, layout, poses, clearance_mm - CLEARANCE_TOLERANCE_MM)
    fits = {("yoke", "pan_servo")}
    # Parts that meet have been reported as such, with the volume they share.
    return [_gap_problem(gap, clearance_mm) for gap in gaps if (gap.moving, gap.fixed) not in fits and gap.gap_mm > 0]


def _gap_problem(gap: Gap, clearance_mm: float) -> Problem:
    pose = f"q1 = {np.degrees(gap.q1):.1f}, q2 = {np.degrees(gap.q2):.1f} degrees"
    return Problem(
        place="mount.clearance_mm",
        value=clearance_mm,
        expected=f"at most {gap.gap_mm:.2f} mm, the gap between {gap.moving} and {gap.fixed} at {pose}",
    )


def _collision_problem(overlap: Overlap) -> Problem:
    pose = f"q1 = {np.degrees(overlap.q1):.1f}, q2 = {np.degrees(overlap.q2):.1f} degrees"
    return Problem(
        place=overlap.first,
        value=f"{overlap.volume_mm3:.0f} mm³ shared with {overlap.second} at {pose}",
        expected=f"{overlap.first} and {overlap.second} clear of each other",
    )
