"""Clearance of what moves over the whole joint range: proven, not sampled.

Parts that move against each other keep `mount.clearance_mm`, or the fit that is declared for them. Gaps of triangle
meshes are bounded over the box of joint values (`cad.checks.clearance.gap_search`), less what the triangles may lie
off the true surfaces. Bearings are measured on the solids: they are bodies of revolution about the joint's axis, so
their gap is the same at every joint value.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from build123d import Solid

from cad.assembly.assembly import Assembly, Part
from cad.checks.clearance.bodies import Body
from cad.checks.clearance.fits import Fit, FitKind, fit_of
from cad.checks.clearance.gap_search import SmallestGap
from cad.checks.clearance.keys import key_to_change
from cad.checks.clearance.moving_pair import MovingPair, joint_box
from cad.finding import Finding
from cad.shapes import location_mm
from optics.kernels.arrays import FloatArray
from optics.mesh import Group, PartMesh, Role
from rigs import Problem

CHECK = "clearance over the joint range"
RESOLUTION_MM = 0.2
"""What a proof may fall short of the clearance: the chords of two meshes and the search's last step (0.05, 0.05 and
0.01 mm), and the tenth of a millimetre that a good printer keeps."""
CLEARANCE_TOLERANCE_MM = 0.005
"""Rounding of the kernel's distances between curved faces, with room."""


def clearance_bodies(meshes: Sequence[PartMesh]) -> list[Body]:
    """Each part a body, but the screws, inserts and washers of a group, which are one together."""
    alone = [mesh for mesh in meshes if mesh.role is not Role.HARDWARE or _touches_others(mesh.name)]
    bodies = [Body.of(mesh.name, [mesh]) for mesh in alone]
    for group in Group:
        small = [mesh for mesh in meshes if mesh.group is group and all(mesh is not other for other in alone)]
        if small:
            bodies.append(Body.of(hardware_name(group), small))
    return bodies


def hardware_name(group: Group) -> str:
    """Name of the screws, inserts and washers of a group as one body."""
    return f"{group} hardware"


def _touches_others(name: str) -> bool:
    """Bushings and the screws in the servos' shafts touch others by design, so they are looked at one by one."""
    return name.endswith(("_bushing", "_shaft_screw"))


def pair_finding(pair: MovingPair, assembly: Assembly, clearance_mm: float) -> Finding:
    """Clearance of one pair over both joint ranges; the figure is a proven lower bound.

    Parameters
    ----------
    pair : MovingPair
        Two bodies of `clearance_bodies`.
    assembly : Assembly
        For the solids of bearings.
    clearance_mm : float
        What parts without a declared fit must keep.
    """
    fit = fit_of(pair.moving.name, pair.other.name)
    if fit is not None and fit.kind is FitKind.BEARING:
        return _bearing(pair, fit, assembly)
    limit = clearance_mm if fit is None else fit.gap_mm
    chords = pair.moving.chord_mm + pair.other.chord_mm
    found = pair.smallest_gap(limit - RESOLUTION_MM + chords, limit + chords)
    bound = max(found.bound_mm - chords, 0.0)
    good = bound >= limit - RESOLUTION_MM
    return Finding(
        check=CHECK,
        subject=f"{pair.moving.name} and {pair.other.name}",
        figure=bound,
        unit="mm",
        limit=limit,
        place=pose_words(found.q, pair.joints),
        note=f"smallest gap seen {found.gap_mm:.2f} mm, {found.poses} poses" + (f"; {fit.why}" if fit else ""),
        problem=None if good else _problem(pair, found, limit, declared=fit is not None),
    )


def pose_words(q: FloatArray, joints: tuple[bool, bool] = (True, True)) -> str:
    """Joint values in words, those that matter."""
    words = [f"{name} = {np.degrees(value):.1f}" for name, value, on in zip(("q1", "q2"), q, joints, strict=True) if on]
    return f"{', '.join(words)} deg"


def _problem(pair: MovingPair, found: SmallestGap, limit: float, *, declared: bool) -> Problem:
    names, pose = f"{pair.moving.name} and {pair.other.name}", pose_words(found.q, pair.joints)
    if found.gap_mm == 0:
        place = key_to_change(pair.moving.name, pair.other.name)
        return Problem(place=place, value=f"{names} intersect at {pose}", expected="them clear of each other")
    gap = f"{found.gap_mm:.2f} mm, the gap between {names} at {pose}"
    if declared:
        return Problem(place=pair.moving.name, value=gap, expected=f"a running gap of at least {limit:g} mm")
    return Problem(place="mount.clearance_mm", value=limit, expected=f"at most {gap}")


def _bearing(pair: MovingPair, fit: Fit, assembly: Assembly) -> Finding:
    """Clearance of a bearing on the solids, at one end and in the middle of the joint ranges."""
    box = joint_box(assembly.layout)
    poses = [box.middle + side * box.half for side in (-1, 0)]
    movers, others = _parts(pair.moving, assembly), _parts(pair.other, assembly)
    clearances = [_smallest_clearance_mm(movers, others, assembly, q) for q in poses]
    clearance = min(clearances)
    good = clearance >= fit.gap_mm - CLEARANCE_TOLERANCE_MM and max(clearances) - clearance < CLEARANCE_TOLERANCE_MM
    names = f"{pair.moving.name} and {pair.other.name}"
    problem = Problem(
        place=pair.moving.name,
        value=f"clearance of {clearance:.3f} to {max(clearances):.3f} mm",
        expected=f"{fit.why}: {names} apart by {fit.gap_mm:g} mm or more at all joint values",
    )
    return Finding(
        check=CHECK,
        subject=names,
        figure=clearance,
        unit="mm",
        limit=fit.gap_mm,
        note=f"{fit.why}: clearance of the solids, the same at all joint values",
        problem=None if good else problem,
    )


def _parts(body: Body, assembly: Assembly) -> list[Part]:
    if body.name == hardware_name(body.group):
        return [
            part
            for part in assembly.parts
            if part.group is body.group and part.role is Role.HARDWARE and not _touches_others(part.name)
        ]
    return [assembly.part(body.name)]


def _smallest_clearance_mm(movers: Sequence[Part], others: Sequence[Part], assembly: Assembly, q: FloatArray) -> float:
    """Smallest distance between solids of two bodies; minus 1 when some share volume."""
    placed = [
        [location_mm(assembly.pose(part, float(q[0]), float(q[1]))) * part.solid for part in parts]
        for parts in (movers, others)
    ]
    clearance = np.inf
    # What is far apart by its box need not be measured, and measuring takes a tenth of a second.
    for apart, here, there in sorted(
        ((_box_gap_mm(a, b), a, b) for a in placed[0] for b in placed[1]), key=lambda pair: pair[0]
    ):
        if apart < clearance:
            distance = float(here.distance_to(there))
            clearance = min(clearance, distance if distance > 0 or here.intersect(there) is None else -1.0)
    return clearance


def _box_gap_mm(first: Solid, second: Solid) -> float:
    boxes = [solid.bounding_box() for solid in (first, second)]
    (low1, high1), (low2, high2) = [(np.array(tuple(box.min)), np.array(tuple(box.max))) for box in boxes]
    return float(np.linalg.norm(np.maximum(np.maximum(low1 - high2, low2 - high1), 0)))
