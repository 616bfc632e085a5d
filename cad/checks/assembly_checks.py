"""Whether a mount can be made, fitted and moved: a quick look for problems, and all checks with their figures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from cad.assembly.assembly import Assembly
from cad.checks.attachment import attachment_findings, holding_findings, housing_findings, joint_findings
from cad.checks.clearance.admissible import AdmissibleRegion, admissible_region
from cad.checks.clearance.axes import axis_findings
from cad.checks.clearance.clearance import RESOLUTION_MM, clearance_bodies, pair_finding
from cad.checks.clearance.fits import fit_of
from cad.checks.clearance.keys import key_to_change
from cad.checks.clearance.moving_pair import MovingPair, moving_pairs
from cad.checks.clearance.stow_clearance import stow_clearance_findings
from cad.checks.clearance.stowing import stowing_findings
from cad.checks.printing.orientation import print_findings
from cad.checks.printing.walls import wall_finding
from cad.checks.sequence.findings import sequence_findings
from cad.checks.sequence.steps import Step, assembly_steps
from cad.checks.solidity import solidity
from cad.finding import Finding, Sense, Verdict
from cad.overlaps import OVERLAP_TOLERANCE_MM3, Gap, Overlap, checked_poses, overlaps, smallest_gaps
from cad.parts.bracket.bracket_joint import REAR
from cad.parts.flange import FLANGE_LENGTH_MM
from optics.layout import Layout
from optics.mesh import PartMesh, Role
from rigs import Problem

OVERLAP_CHECK = "parts out of each other"
CONTACT_DEPTH_MM = 0.5
"""How far a flange may sink into a curved hull: the printed part is filed or shimmed to that."""
GRID_STEPS = 5
CLEARANCE_TOLERANCE_MM = 0.1
"""Twice the tessellation's tolerance."""

Pose = tuple[float, float]
"""Joint values (q1, q2), radians."""
Log = Callable[[str], None]


@dataclass(frozen=True, kw_only=True)
class MountChecks:
    """All checks of a mount.

    Attributes
    ----------
    findings : tuple of Finding
        One per figure, in the order of the checks.
    admissible : AdmissibleRegion or None
        Joint values that keep the clearance; None when all do, or when no joint values were looked at.
    steps : tuple of Step or None
        How the mount is put together, for whoever goes on with it; None when that was not looked at, or the checks come
        from the cache.
    """

    findings: tuple[Finding, ...]
    admissible: AdmissibleRegion | None = None
    steps: tuple[Step, ...] | None = field(default=None, compare=False, repr=False)

    @property
    def problems(self) -> list[Problem]:
        """What is wrong; empty when everything is in order."""
        return [finding.problem for finding in self.findings if finding.problem is not None]

    def of(self, check: str) -> list[Finding]:
        """Findings of one check."""
        return [finding for finding in self.findings if finding.check == check]

    def worst(self, verdict: Verdict) -> list[Finding]:
        """Findings of one verdict."""
        return [finding for finding in self.findings if finding.verdict is verdict]


def assembly_problems(assembly: Assembly, *, grid_steps: int = GRID_STEPS) -> list[Problem]:
    """Find what is wrong with an assembly, quickly: joint values on a grid instead of all of them.

    Parameters
    ----------
    assembly : Assembly
    grid_steps : int
        Steps along each joint's range at which collisions are looked for.

    Returns
    -------
    list of Problem
        Empty when nothing was found; places are keys of the rig file or names of parts.
    """
    rig, meshes = assembly.rig, assembly.meshes
    mount = rig.require_gaze().mount
    solid = _solidities(assembly)
    if any(finding.problem for finding in solid):
        # Volumes of intersection mean nothing for surfaces that are not closed.
        return [finding.problem for finding in solid if finding.problem is not None]
    findings = [finding for mesh in assembly.printed for finding in print_findings(mesh, mount)]
    findings += attachment_findings(rig, _hull(meshes), assembly.layout)
    findings += housing_findings(rig, meshes)
    findings += holding_findings(rig, meshes)
    findings += joint_findings(rig, meshes)
    problems = [finding.problem for finding in findings if finding.problem is not None]
    poses = checked_poses(assembly.layout, grid_steps)
    problems += [_collision_problem(overlap) for overlap in _not_allowed(meshes, assembly.layout, poses)]
    return problems + _clearances(meshes, assembly.layout, poses, mount.clearance_mm)


def assembly_checks(assembly: Assembly, *, log: Log = lambda line: None, until_problem: bool = False) -> MountChecks:
    """Make every check of a mount but the slicer's (`cad.export.printing.plate_slices`).

    Parameters
    ----------
    assembly : Assembly
    log : callable
        Takes lines of progress.
    until_problem : bool
        Leave out the checks that take longest, of clearance and assembly, where another found a problem.
    """
    rig, meshes = assembly.rig, assembly.meshes
    mount = rig.require_gaze().mount
    log("solids ...")
    findings = _solidities(assembly)
    if _has_problem(findings):
        return MountChecks(findings=tuple(findings))
    printed = assembly.printed
    findings += [wall_finding(mesh, mount) for mesh in printed]
    findings += [finding for mesh in printed for finding in print_findings(mesh, mount)]
    findings += attachment_findings(rig, _hull(meshes), assembly.layout)
    findings += housing_findings(rig, meshes)
    findings += holding_findings(rig, meshes)
    findings += joint_findings(rig, meshes)
    findings += stowing_findings(assembly)
    findings += axis_findings(assembly)
    findings += _overlap_findings(meshes, assembly.layout)
    if until_problem and _has_problem(findings):
        return MountChecks(findings=tuple(findings))
    log("clearance over the joint range ...")
    pairs = moving_pairs(clearance_bodies(meshes), assembly.layout)
    clearances = [pair_finding(pair, assembly, mount.clearance_mm) for pair in pairs]
    findings += clearances
    findings += stow_clearance_findings(assembly, meshes, mount.clearance_mm)
    if until_problem and _has_problem(findings):
        return MountChecks(findings=tuple(findings))
    admissible = _admissible(list(zip(pairs, clearances, strict=True)), assembly.layout)
    log("steps of putting it together ...")
    steps = tuple(assembly_steps(assembly))
    findings += sequence_findings(steps)
    return MountChecks(findings=tuple(findings), admissible=admissible, steps=steps)


def _has_problem(findings: Sequence[Finding]) -> bool:
    return any(finding.problem is not None for finding in findings)


def _solidities(assembly: Assembly) -> list[Finding]:
    return [solidity(part, part.mesh) for part in assembly.parts]


def _hull(meshes: Sequence[PartMesh]) -> PartMesh:
    return next(mesh for mesh in meshes if mesh.role is Role.HULL)


def _admissible(pairs: Sequence[tuple[MovingPair, Finding]], layout: Layout) -> AdmissibleRegion | None:
    """Joint values that keep the clearance, when a pair with a limit that depends on them does not."""
    failed = [
        (pair, finding.limit - RESOLUTION_MM + pair.moving.chord_mm + pair.other.chord_mm)
        for pair, finding in pairs
        if finding.problem is not None and finding.limit is not None and finding.place
    ]
    return admissible_region(failed, layout) if failed else None


def _not_allowed(meshes: Sequence[PartMesh], layout: Layout, poses: Sequence[Pose]) -> list[Overlap]:
    """Parts that share more volume than they may at some of the poses."""
    roles = {mesh.name: mesh.role for mesh in meshes}
    return [found for found in overlaps(meshes, layout, poses) if found.volume_mm3 > _allowance(found, roles)]


def _overlap_findings(meshes: Sequence[PartMesh], layout: Layout) -> list[Finding]:
    """Parts stay out of each other at rest; what moves is looked at by its clearance."""
    found = _not_allowed(meshes, layout, [(0.0, 0.0)])
    if not found:
        subject = f"{len(meshes)} parts at rest"
        return [
            Finding(
                check=OVERLAP_CHECK,
                subject=subject,
                figure=0.0,
                unit="mm³",
                limit=OVERLAP_TOLERANCE_MM3,
                sense=Sense.AT_MOST,
                note="shared volume, but for bolts in the hull and flanges on a curved one",
            )
        ]
    return [
        Finding(
            check=OVERLAP_CHECK,
            subject=f"{overlap.first} and {overlap.second}",
            figure=overlap.volume_mm3,
            unit="mm³",
            limit=OVERLAP_TOLERANCE_MM3,
            sense=Sense.AT_MOST,
            problem=_collision_problem(overlap),
        )
        for overlap in found
    ]


def _allowance(overlap: Overlap, roles: dict[str, Role]) -> float:
    """Volume that a flange may share with a hull that is not flat under it; 0 for any other pair."""
    pair = {overlap.first: roles[overlap.first], overlap.second: roles[overlap.second]}
    if Role.HULL in pair.values() and Role.HARDWARE in pair.values():
        # The hull offers the bolts a thread that is not drawn.
        return float("inf")
    if Role.HULL in pair.values() and not {"fold_bracket", REAR, "gimbal_base"}.isdisjoint(pair):
        return CONTACT_DEPTH_MM * FLANGE_LENGTH_MM**2
    return 0.0


def _clearances(
    meshes: Sequence[PartMesh], layout: Layout, poses: Sequence[Pose], clearance_mm: float
) -> list[Problem]:
    """What moves keeps its distance from what stands still, but for the pairs with a declared fit."""
    # Screws and inserts are sunk into these.
    large = [mesh for mesh in meshes if mesh.role is not Role.HARDWARE]
    gaps = smallest_gaps(large, layout, poses, clearance_mm - CLEARANCE_TOLERANCE_MM)
    # Parts that intersect have been reported as such, with the volume they share.
    return [_gap_problem(gap, clearance_mm) for gap in gaps if fit_of(gap.moving, gap.fixed) is None and gap.gap_mm > 0]


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
        place=key_to_change(overlap.first, overlap.second),
        value=f"{overlap.volume_mm3:.0f} mm³ shared by {overlap.first} and {overlap.second} at {pose}",
        expected=f"{overlap.first} and {overlap.second} clear of each other",
    )
