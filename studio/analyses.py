"""What is known of a rig as it is: its parts, what it covers, what is wrong with it; made in a process of its own."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from cad.assembly.meshes import rig_meshes
from cad.checks.rig_problems import rig_problems
from cad.loads.masses import part_bodies
from optics.coverage.coverage import compute_coverage, stepped_joints
from optics.mesh import PartMesh
from rigs import Rig
from studio.results import Checked, Covered, Fineness, Judgement, Parts
from studio.shell import shell_of
from studio.surroundings import Surroundings

STEP_DEG = {"coarse": 4.0, "fine": 2.0}
NSIDE = {"coarse": 32, "fine": 64}
IMAGE_CELLS = {"coarse": (32, 24), "fine": (64, 48)}


def coverage_of(rig: Rig, parts: Sequence[PartMesh] | None, fineness: Fineness) -> Covered:
    """Coverage of a rig among parts; by default its own."""
    start = time.perf_counter()
    q1, q2 = stepped_joints(rig, STEP_DEG[fineness])
    columns, rows = IMAGE_CELLS[fineness]
    found = compute_coverage(
        rig,
        rig_meshes(rig) if parts is None else parts,
        q1=q1,
        q2=q2,
        columns=columns,
        rows=rows,
        nside=NSIDE[fineness],
    )
    seen = found.pixels_per_degree[found.covered]
    return Covered(
        rig=rig,
        fineness=fineness,
        shell=shell_of(found),
        covered=found.covered_fraction,
        upper=found.upper_fraction,
        lower=found.lower_fraction,
        mean_msr=1000 * found.mean_solid_angle_sr,
        most_msr=1000 * float(found.solid_angle_sr.max()),
        pixels_per_degree=float(np.median(seen)) if len(seen) else 0.0,
        elapsed_s=time.perf_counter() - start,
    )


def parts_of(rig: Rig) -> Parts:
    """Parts of a rig, built or from the cache; `ValueError` for one whose numbers make no mount."""
    start = time.perf_counter()
    meshes = tuple(rig_meshes(rig))
    mass = {body.name: body.mass_kg for bodies in part_bodies(rig, meshes).values() for body in bodies}
    return Parts(rig=rig, meshes=meshes, mass_kg=mass, elapsed_s=time.perf_counter() - start)


def judgement_of(rig: Rig) -> Judgement:
    """What makes a rig impossible, before any mount is made."""
    return Judgement(rig=rig, sentences=tuple(str(problem) for problem in rig_problems(rig)))


def light_of(rig: Rig, surroundings: Surroundings) -> Rig:
    """Find the full light of a rig in its surroundings, so that it is in the cache."""
    # Lighting takes the renderer, which the other analyses do not need.
    from scenes.baking.lit_scene import prepare  # noqa: PLC0415

    prepare(surroundings.scene(rig), rig, rig_meshes(rig))
    return rig


def checks_of(rig: Rig) -> Checked:
    """All checks of a rig's mount, built; takes half a minute."""
    # Solids take seconds to import, and no other analysis needs them when meshes are in the cache.
    from cad.assembly.assembly import build_assembly  # noqa: PLC0415
    from cad.checks.clearance import clearance  # noqa: PLC0415
    from cad.export.printing.prints import prints  # noqa: PLC0415
    from reports.figures.check import summary_rows  # noqa: PLC0415
    from reports.studies.mount_export import mount_checks  # noqa: PLC0415

    assembly = build_assembly(rig)
    checks = mount_checks(assembly, log=lambda line: None)
    gaps: dict[str, float] = {}
    for finding in checks.of(clearance.CHECK):
        # What is meant to be near, such as a bushing on its shaft, has limits of its own.
        if finding.figure is not None and (finding.limit or 0.0) >= rig.require_gaze().mount.clearance_mm:
            for name in finding.subject.split():
                gaps[name] = min(finding.figure, gaps.get(name, finding.figure))
    printed = None if checks.problems else prints(rig, assembly.printed)
    return Checked(
        rig=rig,
        rows=tuple(summary_rows(checks)),
        problems=tuple(str(problem) for problem in checks.problems),
        clearance_mm=gaps,
        print_s={} if printed is None else {part.name: part.time_s for part in printed.parts},
        sliced=printed is not None and printed.sliced,
    )
