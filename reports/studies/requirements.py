"""What optics and parts of a rig reach of what it is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cad.assembly.assembly import Assembly
from cad.assembly.meshes import rig_meshes
from cad.export.printing.prints import prints
from cad.loads.masses import mount_in_body, together
from optics.coverage.coverage import covered_cells, stepped_joints
from optics.coverage.field import pixels_per_degree
from optics.coverage.sphere import cells_of
from optics.feasibility.requirements import Achieved, Judged, judged
from optics.kernels.arrays import FloatArray
from optics.mesh import PartMesh
from optics.train import OpticalTrain
from rigs import Requirements, Rig

JOINT_STEP_DEG = 2.0
"""Between the joint values that are looked at for directions and coverage: the gaze moves twice as far as the tilt."""
NSIDE = 64
"""Cells of 0.92 degrees, as those of coverage."""
RESOLUTION_CELLS = 64
"""Cells along each side of the image, by which its smallest resolution is found."""


def achieved_by(rig: Rig, meshes: Sequence[PartMesh], *, covered_fraction: float | None = None) -> Achieved:
    """What optics and parts of a rig reach, as far as it is asked for; neither dive nor slicer runs.

    Parameters
    ----------
    rig : Rig
        With mirrors and requirements.
    meshes : sequence of PartMesh
        As of `cad.rig_meshes`.
    covered_fraction : float, optional
        Where it is known already.
    """
    asked = rig.requirements or Requirements()
    q1, q2 = stepped_joints(rig, JOINT_STEP_DEG)
    seen = None
    if asked.directions_deg:
        cells = cells_of(directions(asked), NSIDE)
        seen = tuple(covered_cells(rig, meshes, q1=q1, q2=q2, nside=NSIDE, cells=cells).tolist())
    if asked.covered_percent is not None and covered_fraction is None:
        covered_fraction = float(covered_cells(rig, meshes, q1=q1, q2=q2, nside=NSIDE).mean())
    train = OpticalTrain.bare(rig)
    resolution = pixels_per_degree(train.camera, train.port, RESOLUTION_CELLS, RESOLUTION_CELLS)
    return Achieved(
        seen=seen,
        covered_fraction=covered_fraction,
        pixels_per_degree=float(resolution[resolution > 0].min()),
        mount_mass_kg=together("mount", mount_in_body(rig, meshes, 0.0, 0.0)).mass_kg,
    )


def judged_so_far(rig: Rig, assembly: Assembly | None) -> list[Judged]:
    """Requirements of a rig without a dive; the print time's of a mount that was built, where there is a slicer."""
    achieved = achieved_by(rig, rig_meshes(rig))
    if assembly is not None:
        printed = prints(rig, assembly.printed)
        achieved = replace(achieved, print_time_s=printed.time_s if printed.sliced else None)
    return judged(rig.requirements, achieved)


def directions(asked: Requirements) -> FloatArray:
    """Unit vectors of the required directions in the body frame, shape (n, 3)."""
    azimuth, elevation = np.radians(np.array(asked.directions_deg).reshape(-1, 2)).T
    level = np.cos(elevation)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=1)
