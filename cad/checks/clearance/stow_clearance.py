"""Clearance of the arm that stows M1, over its angle and both joint ranges: three joint values, one proof.

What swings is one body, and so is all that pans and all that tilts. Deck and hinge are left out: they are made to touch
the arm. The gap between arm and another body changes by no more than the sum of what each joint moves either of them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cad.assembly.assembly import Assembly
from cad.checks.clearance.bodies import Body, distances_mm
from cad.checks.clearance.clearance import CHECK, RESOLUTION_MM, pose_words
from cad.checks.clearance.gap_search import Cell, smallest_gap
from cad.checks.clearance.moving_pair import PAN_AXIS, TILT_AXIS, joint_box
from cad.finding import Finding
from cad.parts.stow_hinge import StowHinge
from cad.poses import body_from_group
from optics.kernels.arrays import FloatArray
from optics.mesh import Group, PartMesh
from rigs import Problem

ARM = "stowing arm"
STANDING = ("hull", "gimbal_base", "pan_servo")
"""What the arm could hit of what stands still."""


def stow_clearance_findings(assembly: Assembly, meshes: Sequence[PartMesh], clearance_mm: float) -> list[Finding]:
    """Clearance between the arm that stows M1 and each other group; nothing for a fold mirror that is fixed."""
    if assembly.stow is None:
        return []
    parts = list(zip(assembly.parts, meshes, strict=True))
    arm = Body.of(ARM, [mesh for part, mesh in parts if part.stows])
    others = {
        "hull and base": [mesh for part, mesh in parts if part.name in STANDING],
        "what pans": [mesh for mesh in meshes if mesh.group is Group.PAN],
        "what tilts": [mesh for mesh in meshes if mesh.group is Group.TILT],
    }
    return [
        _finding(arm, Body.of(name, bodies), assembly, assembly.stow, clearance_mm) for name, bodies in others.items()
    ]


def _finding(arm: Body, other: Body, assembly: Assembly, hinge: StowHinge, clearance_mm: float) -> Finding:
    def gap_mm(q: FloatArray) -> float:
        pose = hinge.body_from_stowing(q[2]).inv() * body_from_group(assembly.layout, other.group, q[0], q[1])
        return arm.gap_mm(other, pose.rotation.as_matrix(), 1000 * pose.translation)

    box = joint_box(assembly.layout)
    stow = np.radians(hinge.max_deg) / 2
    whole = Cell(middle=np.append(box.middle, stow), half=np.append(box.half, stow))
    chords = arm.chord_mm + other.chord_mm
    found = smallest_gap(
        gap_mm, whole, _reach_mm(arm, other, hinge), clearance_mm - RESOLUTION_MM + chords, clearance_mm + chords
    )
    bound = max(found.bound_mm - chords, 0.0)
    place = f"{pose_words(found.q[:2])}, stow = {np.degrees(found.q[2]):.1f} deg"
    problem = Problem(
        place="joints.stow.max_deg",
        value=hinge.max_deg,
        expected=f"{clearance_mm:g} mm between {arm.name} and {other.name}, not {found.gap_mm:.2f} mm at {place}",
    )
    return Finding(
        check=CHECK,
        subject=f"{arm.name} and {other.name}",
        figure=bound,
        unit="mm",
        limit=clearance_mm,
        place=place,
        note=f"smallest gap seen {found.gap_mm:.2f} mm, {found.poses} poses",
        problem=None if bound >= clearance_mm - RESOLUTION_MM else problem,
    )


def _reach_mm(arm: Body, other: Body, hinge: StowHinge) -> FloatArray:
    """How far a turn of pan, tilt and hinge by one radian moves one body against the other at most, millimetres."""
    point, axis = hinge.axis_in_body()
    stow = distances_mm(arm.vertices_mm, 1000 * point, axis).max()
    vertices = other.vertices_mm
    if other.group is Group.FIXED:
        return np.array([0.0, 0.0, stow])
    if other.group is Group.PAN:
        return np.array([distances_mm(vertices, np.zeros(3), PAN_AXIS).max(), 0.0, stow])
    # Whatever the tilt, a point is no further from the pan axis than from where the axes cross.
    from_crossing = np.linalg.norm(vertices, axis=1).max()
    return np.array([from_crossing, distances_mm(vertices, np.zeros(3), TILT_AXIS[Group.TILT]).max(), stow])
