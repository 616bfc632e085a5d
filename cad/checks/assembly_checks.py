"""Whether a mount can be made, fitted and moved: checks on solids and their meshes, each failure with its place."""

from __future__ import annotations

from collections.abc import Sequence

import manifold3d
import numpy as np
import trimesh
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation
from trimesh.proximity import closest_point_naive

from cad.assembly import Assembly, Part
from cad.checks.overlaps import Gap, Overlap, joint_grid, manifold_mm, overlaps, smallest_gaps
from cad.flange import FLANGE_LENGTH_MM
from cad.tessellation import tessellate
from optics.layout import FloatArray, Layout
from optics.mesh import PartMesh, Role
from rigs import DomePortSpec, FlatPortSpec, Mount, Problem, Rig

VOLUME_TOLERANCE = 0.01
"""Relative; the tessellation's chords cut curved parts by less."""
ANCHOR_TOLERANCE_MM = 1.0
CONTACT_DEPTH_MM = 0.5
"""How far a flange may sink into a curved hull: the printed part is filed or shimmed to that."""
GRID_STEPS = 5
PORT_VIEW_TOLERANCE_MM3 = 1.0
RIM_POINTS = 64
DOME_SEGMENTS = 128
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
    """No part of the hull stands between the port and M1."""
    if (_light_to_fold_mirror(rig, layout) ^ manifold_mm(hull)).volume() <= PORT_VIEW_TOLERANCE_MM3:
        return []
    expected = "a camera whose port looks into the water: the hull stands in front of it"
    return [Problem(place="camera.position_mm", value=rig.camera.position_mm, expected=expected)]


def _light_to_fold_mirror(rig: Rig, layout: Layout) -> manifold3d.Manifold:
    """Water that light crosses from the port to M1, as a body in the body frame, millimetres.

    Behind a flat port that is all in front of its aperture, whatever the refraction; else the pyramid from the
    pinhole to M1, less the dome.
    """
    if rig.fold_mirror is None:
        raise ValueError(f"expected a rig with mirrors, got {rig.name!r}, which has none")
    body_from_camera = layout.body_from_camera
    if isinstance(rig.port, FlatPortSpec):
        normal = np.array(rig.port.normal) / np.linalg.norm(rig.port.normal)
        around = Rotation.align_vectors(normal, [0, 0, 1])[0]
        angles = np.linspace(0, 2 * np.pi, RIM_POINTS, endpoint=False)
        rim = rig.port.aperture_diameter_mm / 2 * around.apply(_circle(angles))
        start = (rig.port.distance_mm + rig.port.thickness_mm) * normal
        end = start + rig.fold_mirror.distance_mm * normal
        return _hull_of(body_from_camera.apply(np.vstack([rim + start, rim + end]) / 1000))
    half = np.array([rig.fold_mirror.width_mm, rig.fold_mirror.height_mm]) / 2000
    corners = [[sx * half[0], sy * half[1], 0.0] for sx in (-1, 1) for sy in (-1, 1)]
    light = _hull_of(np.vstack([body_from_camera.translation, layout.body_from_m1.apply(corners)]))
    if isinstance(rig.port, DomePortSpec):
        dome = manifold3d.Manifold.sphere(rig.port.inner_radius_mm + rig.port.thickness_mm, DOME_SEGMENTS)
        centre = 1000 * body_from_camera.apply(np.array(rig.port.centre_mm) / 1000)
        light = light - dome.translate(tuple(centre))
    return light


def _circle(angles: FloatArray) -> FloatArray:
    return np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])


def _hull_of(points_m: FloatArray) -> manifold3d.Manifold:
    """Convex hull of points, millimetres."""
    return manifold3d.Manifold.hull_points(np.ascontiguousarray(1000 * points_m))


def _collisions(meshes: Sequence[PartMesh], layout: Layout, poses: Sequence[Pose]) -> list[Problem]:
    """Parts stay out of each other, at rest and over the joint range."""
    found = overlaps(meshes, layout, poses)
    roles = {mesh.name: mesh.role for mesh in meshes}
    return [_collision_problem(overlap) for overlap in found if overlap.volume_mm3 > _allowance(overlap, roles)]


def _allowance(overlap: Overlap, roles: dict[str, Role]) -> float:
    """Volume that a flange may share with a hull that is not flat under it; 0 for any other pair."""
    pair = {overlap.first: roles[overlap.first], overlap.second: roles[overlap.second]}
    if Role.HULL in pair.values() and Role.HARDWARE in pair.values():
        # The hull offers the bolts a thread that is not drawn.
        return float("inf")
    if Role.HULL in pair.values() and not {"fold_bracket", "gimbal_base"}.isdisjoint(pair):
        return CONTACT_DEPTH_MM * FLANGE_LENGTH_MM**2
    return 0.0


def _clearances(
    meshes: Sequence[PartMesh], layout: Layout, poses: Sequence[Pose], clearance_mm: float
) -> list[Problem]:
    """What moves keeps its distance from what stands still, but for the pan axis: servo, horn and bush."""
    gaps = smallest_gaps(meshes, layout, poses, clearance_mm - CLEARANCE_TOLERANCE_MM)
    # Parts that meet have been reported as such, with the volume they share.
    return [_gap_problem(gap, clearance_mm) for gap in gaps if not _fitted(gap) and gap.gap_mm > 0]


def _fitted(gap: Gap) -> bool:
    """Whether two parts belong to the pan axis, where they run on each other."""
    return gap.moving.startswith(("yoke", "pan_horn")) and gap.fixed.startswith(("pan_", "gimbal_base"))


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
