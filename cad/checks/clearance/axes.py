"""Whether both joint axes meet at the centre of M2's face: read off the machined surfaces, not off the layout."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from build123d import GeomType

from cad.assembly.assembly import Assembly, Part
from cad.checks.clearance.moving_pair import joint_box
from cad.finding import Finding, Sense
from optics.kernels.arrays import FloatArray
from rigs import Problem

CHECK = "axes through the centre of M2"
AXIS_TOLERANCE_MM = 1e-6
"""Double precision on lengths below a metre, with room for the kernel's own rounding (1e-7 mm)."""
AXIS_PARTS = {
    "pan": ("pan_horn", "pan_bushing"),
    "tilt": ("tilt_horn", "pivot_bushing", "pivot_sleeve"),
}
"""Bodies of revolution about each joint's axis."""
MIRROR = "gaze_mirror"


def axis_findings(assembly: Assembly) -> list[Finding]:
    """Distance of each joint's turning parts from the centre of M2's face, over the corners of the joint ranges."""
    names = {part.name for part in assembly.parts}
    found = [
        _finding(assembly, joint, assembly.part(name))
        for joint, parts in AXIS_PARTS.items()
        for name in parts
        if name in names
    ]
    return [*found, _plane_finding(assembly)]


def face_of_mirror(part: Part) -> tuple[FloatArray, FloatArray]:
    """Centre and outward normal of a mirror's reflecting face: the outer of its two large faces, in its own frame."""
    faces = part.solid.faces().filter_by(GeomType.PLANE)
    largest = max(face.area for face in faces)
    large = [face for face in faces if face.area > 0.99 * largest]
    front = max(large, key=lambda face: face.normal_at().Z)
    return np.array(tuple(front.center())), np.array(tuple(front.normal_at()))


def axis_of(part: Part) -> tuple[FloatArray, FloatArray]:
    """Point and direction of the axis of a body of revolution: that of its widest cylindrical face."""
    faces = part.solid.faces().filter_by(GeomType.CYLINDER)
    widest = max(faces, key=lambda face: face.radius)
    axis = widest.axis_of_rotation
    return np.array(tuple(axis.position)), np.array(tuple(axis.direction))


def _finding(assembly: Assembly, joint: str, part: Part) -> Finding:
    mirror = assembly.part(MIRROR)
    centre, _ = face_of_mirror(mirror)
    point, direction = axis_of(part)
    distances = []
    for q1, q2 in _corners(assembly):
        pose = assembly.pose(part, q1, q2).inv() * assembly.pose(mirror, q1, q2)
        offset = 1000 * pose.apply(centre / 1000) - point
        distances.append(float(np.linalg.norm(np.cross(offset, direction))))
    return _judged(f"{joint} axis of {part.name}", max(distances), "from the centre of M2's face")


def _plane_finding(assembly: Assembly) -> Finding:
    """Distance between M2's reflecting plane and the tilt axis as the holder's horn has it."""
    mirror, horn = assembly.part(MIRROR), assembly.part(AXIS_PARTS["tilt"][0])
    centre, normal = face_of_mirror(mirror)
    point, direction = axis_of(horn)
    # Points of the axis at both ends of the mirror: the axis lies in the plane, not only through it.
    reach = max(tuple(mirror.solid.bounding_box().size))
    ends = [point + side * reach * direction for side in (-1, 1)]
    return _judged("plane of M2", max(abs(float((end - centre) @ normal)) for end in ends), "from the tilt axis")


def _judged(subject: str, distance: float, note: str) -> Finding:
    expected = f"within {AXIS_TOLERANCE_MM:g} mm {note}"
    problem = Problem(place=subject, value=f"{distance:.2e} mm", expected=expected)
    return Finding(
        check=CHECK,
        subject=subject,
        figure=distance,
        unit="mm",
        limit=AXIS_TOLERANCE_MM,
        sense=Sense.AT_MOST,
        note=note,
        problem=problem if distance > AXIS_TOLERANCE_MM else None,
    )


def _corners(assembly: Assembly) -> Iterable[tuple[float, float]]:
    box = joint_box(assembly.layout)
    yield 0.0, 0.0
    for side1 in (-1, 1):
        for side2 in (-1, 1):
            q = box.middle + np.array([side1, side2]) * box.half
            yield float(q[0]), float(q[1])
