"""Screws and the hexagon keys that turn them: both ends of a key, its other arm and the swing that it needs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import manifold3d
import numpy as np
from build123d import GeomType
from scipy.spatial.transform import Rotation

from cad.assembly.assembly import Part
from optics.kernels.arrays import FloatArray
from optics.mesh import Role

KEYS_MM = {2.0: (1.5, 45.0, 14.0), 3.0: (2.5, 56.0, 18.0), 4.0: (3.0, 63.0, 20.0), 5.0: (4.0, 70.0, 25.0)}
"""Thread to width across flats (ISO 4762), long and short arm (ISO 2936) of the hexagon key."""
STANDOFF_MM = 0.05
"""The key begins this far above the head: bodies that touch do not count as in the way."""
MET_MM3 = 0.5
"""What key and part may share: the corners of meshes."""
SWING_DEG = 60
"""A hexagonal key is put on again after this turn."""
SWING_STEP_DEG = 15
KEY_SIDES = 12


@dataclass(frozen=True, kw_only=True)
class Screw:
    """A screw's thread, and where its head's top is and points, in the frame of its group, millimetres."""

    name: str
    thread_mm: float
    top_mm: FloatArray
    outwards: FloatArray


def is_screw(part: Part) -> bool:
    """Whether a part is a screw, by its name."""
    return part.role is Role.HARDWARE and "screw" in part.name


def screw_of(part: Part) -> Screw:
    """Thread and head of a screw, from its solid: the head is its widest cylinder, the thread its narrowest outside."""
    faces = part.solid.faces().filter_by(GeomType.CYLINDER)
    head = max(faces, key=lambda face: face.radius)
    axis = head.axis_of_rotation
    origin, direction = np.array(tuple(axis.position)), np.array(tuple(axis.direction))
    along = [(np.array(tuple(vertex)) - origin) @ direction for vertex in part.solid.vertices()]
    middle = (np.array(tuple(head.center())) - origin) @ direction
    low, high = min(along), max(along)
    if high - middle > middle - low:
        direction, high = -direction, -low
    # ISO 4762: the head's diameter is about 1.8 times the thread's; the nearest thread of the table is meant.
    thread = min(KEYS_MM, key=lambda size: abs(1.75 * size + 0.25 - 2 * head.radius))
    return Screw(name=part.name, thread_mm=thread, top_mm=origin + high * direction, outwards=direction)


def key_blockers(
    screw: Screw, body_from_group: FloatArray, bodies: Mapping[str, manifold3d.Manifold]
) -> dict[str, str]:
    """What is in the way of each end of a screw's key: of both, of the long arm alone, or of neither.

    Parameters
    ----------
    screw : Screw
    body_from_group : array, shape (4, 4)
        Pose of the screw's frame, metres.
    bodies : dict of str to Manifold
        What is there, metres, body frame.

    Returns
    -------
    dict of str to str
        "long arm" and "short arm", each with the parts that it hits. A long arm that is free is taken; with both in it
        no key gets to the screw.
    """
    _, long, short = KEYS_MM[screw.thread_mm]
    hit = {}
    for end, reach, other in (("long arm", long, short), ("short arm", short, long)):
        if not (blockers := _hit_parts(screw, body_from_group, bodies, reach, other)):
            break
        hit[end] = ", ".join(sorted(blockers))
    return hit


def _hit_parts(
    screw: Screw, body_from_group: FloatArray, bodies: Mapping[str, manifold3d.Manifold], reach: float, other: float
) -> set[str]:
    """Parts that a key hits in every swing; empty when there is a swing without any."""
    radius = KEYS_MM[screw.thread_mm][0] / np.sqrt(3)
    straight = manifold3d.Manifold.cylinder(reach, radius, circular_segments=KEY_SIDES)
    pose = _key_pose(screw, body_from_group)
    if blockers := _hit_by(straight.transform(pose), bodies):
        return blockers
    arm = manifold3d.Manifold.cylinder(other, radius, circular_segments=KEY_SIDES).rotate((0, 90, 0))
    arm = arm.translate((0, 0, reach - radius))
    angles = range(0, 360, SWING_STEP_DEG)
    blocked = [_hit_by(arm.rotate((0, 0, angle)).transform(pose), bodies) for angle in angles]
    window = SWING_DEG // SWING_STEP_DEG + 1
    swings = [[blocked[(start + step) % len(blocked)] for step in range(window)] for start in range(len(blocked))]
    return set() if any(not any(swing) for swing in swings) else set[str]().union(*blocked)


def _key_pose(screw: Screw, body_from_group: FloatArray) -> FloatArray:
    """Rows of the pose of a key whose axis is z and whose end is at 0, from millimetres to metres in the body frame."""
    turn = Rotation.align_vectors([screw.outwards], [[0.0, 0.0, 1.0]])[0].as_matrix()
    place = np.eye(4)
    place[:3, :3] = turn / 1000
    place[:3, 3] = (screw.top_mm + STANDOFF_MM * screw.outwards) / 1000
    return np.asarray((body_from_group @ place)[:3])


def _hit_by(tool: manifold3d.Manifold, bodies: Mapping[str, manifold3d.Manifold]) -> set[str]:
    bounds = np.array(tool.bounding_box())
    return {name for name, body in bodies.items() if _near(bounds, body) and (tool ^ body).volume() > MET_MM3 * 1e-9}


def _near(bounds: FloatArray, body: manifold3d.Manifold) -> bool:
    other = np.array(body.bounding_box())
    return bool((bounds[:3] <= other[3:]).all() and (other[:3] <= bounds[3:]).all())
