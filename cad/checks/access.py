"""Whether every screw can be reached by its key, in the finished assembly or at some step of putting it together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import trimesh
from build123d import GeomType
from scipy.spatial.transform import Rotation

from cad.assembly.assembly import Assembly, Part
from cad.checks.clearance.bodies import Body
from cad.checks.clearance.clearance import clearance_bodies, pose_words
from cad.checks.clearance.moving_pair import ORDER, joint_box
from cad.finding import Finding
from cad.poses import body_from_group
from optics.kernels.arrays import FloatArray
from optics.mesh import Group, PartMesh, Role
from rigs import Problem

CHECK = "screw access"
KEYS_MM = {2.0: (1.5, 45.0), 3.0: (2.5, 56.0), 4.0: (3.0, 63.0), 5.0: (4.0, 70.0)}
"""Thread to width across flats (ISO 4762) and length of the long arm (ISO 2936) of the hexagon key."""
STANDOFF_MM = 0.05
"""The key's body starts this far above the head: meshes that touch do not count as in the way."""
POSES_PER_JOINT = 9
KEY_SIDES = 12


@dataclass(frozen=True, kw_only=True)
class Screw:
    """A screw's thread, and where its head's top is and points, in the frame of its group, millimetres."""

    name: str
    group: Group
    thread_mm: float
    top_mm: FloatArray
    outwards: FloatArray


def access_findings(assembly: Assembly, meshes: Sequence[PartMesh]) -> list[Finding]:
    """For every screw whether a straight hexagon key gets to its head, and when.

    The figure is the free length of the key: all of it or, when something is in the way at every step and pose, 0.
    """
    bodies = clearance_bodies(meshes)
    mirrors = {mesh.name for mesh in meshes if mesh.role is Role.MIRROR}
    hulls = {mesh.name for mesh in meshes if mesh.role is Role.HULL}
    screws = [screw_of(part) for part in assembly.parts if is_screw(part)]
    return [_finding(screw, bodies, mirrors, hulls, assembly) for screw in screws]


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
    return Screw(
        name=part.name, group=part.group, thread_mm=thread, top_mm=origin + high * direction, outwards=direction
    )


def key_body(screw: Screw) -> Body:
    """The key's long arm on a screw, as a body of the screw's group."""
    width, length = KEYS_MM[screw.thread_mm]
    arm = trimesh.creation.cylinder(width / np.sqrt(3), length, sections=KEY_SIDES)
    turn = Rotation.align_vectors([screw.outwards], [[0.0, 0.0, 1.0]])[0]
    middle = screw.top_mm + (STANDOFF_MM + length / 2) * screw.outwards
    mesh = PartMesh(
        name="key",
        group=screw.group,
        role=Role.HARDWARE,
        vertices_m=(turn.apply(arm.vertices) + middle) / 1000,
        faces=np.asarray(arm.faces, dtype=np.int32),
    )
    return Body.of("key", [mesh])


def _finding(screw: Screw, bodies: Sequence[Body], mirrors: set[str], hulls: set[str], assembly: Assembly) -> Finding:
    key = key_body(screw)
    blockers: list[str] = []
    for step, present in _steps(screw, bodies, mirrors, hulls):
        for q in _poses(assembly):
            blocker = _in_the_way(key, present, assembly, q)
            if blocker is None:
                length = KEYS_MM[screw.thread_mm][1]
                return Finding(
                    check=CHECK,
                    subject=screw.name,
                    figure=length,
                    unit="mm",
                    limit=length,
                    place=pose_words(q),
                    note=f"free {step}",
                )
            blockers.append(blocker)
    in_the_way = ", ".join(sorted(set(blockers)))
    problem = Problem(place=screw.name, value=f"{in_the_way} in the way", expected="a key's way to the screw's head")
    return Finding(
        check=CHECK,
        subject=screw.name,
        figure=0.0,
        unit="mm",
        limit=KEYS_MM[screw.thread_mm][1],
        note=f"{in_the_way} in the way",
        problem=problem,
    )


def _steps(
    screw: Screw, bodies: Sequence[Body], mirrors: set[str], hulls: set[str]
) -> Iterator[tuple[str, list[Body]]]:
    """Steps of the assembly, the latest first, with what is there then."""
    yield "in the finished mount", list(bodies)
    yield "before the mirrors are in", [body for body in bodies if body.name not in mirrors]
    earlier = [body for body in bodies if ORDER[body.group] <= ORDER[screw.group] and body.name not in mirrors]
    if screw.group is not Group.TILT:
        yield "before what it carries is on", earlier
    own = [body for body in earlier if body.group is screw.group]
    if screw.group is not Group.FIXED:
        yield "before it is put on what carries it", own
    yield "before it is on the hull", [body for body in own if body.name not in hulls]


def _poses(assembly: Assembly) -> Iterator[FloatArray]:
    yield np.zeros(2)
    box = joint_box(assembly.layout)
    for share in product(np.linspace(-1, 1, POSES_PER_JOINT), repeat=2):
        yield box.middle + np.array(share) * box.half


def _in_the_way(key: Body, present: Sequence[Body], assembly: Assembly, q: FloatArray) -> str | None:
    """Name of a body that the key meets; None when it is free."""
    frames = {group: body_from_group(assembly.layout, group, float(q[0]), float(q[1])) for group in Group}
    for body in present:
        pose = frames[key.group].inv() * frames[body.group]
        if key.gap_mm(body, pose.rotation.as_matrix(), 1000 * pose.translation) == 0:
            return body.name
    return None
