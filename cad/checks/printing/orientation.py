"""Whether a printed part fits the printer, and what overhangs as it is printed."""

from __future__ import annotations

import numpy as np

from cad.assembly.print_pose import print_pose
from cad.finding import Finding
from optics.mesh import PartMesh
from rigs import Mount, Problem

BED_CHECK = "fits the printer"
OVERHANG_CHECK = "overhang as printed"


def print_findings(mesh: PartMesh, mount: Mount) -> list[Finding]:
    """Whether a printed part fits the printer in its print orientation, and what overhangs then."""
    pose = print_pose(mesh, mount)
    size = " x ".join(f"{side:.0f}" for side in pose.size_mm)
    problem = Problem(
        place="mount.printer_bed_mm",
        value=f"{mesh.name} of {size} mm",
        expected=f"parts within {mount.printer_bed_mm} mm",
    )
    turn = np.round(pose.bed_from_part.as_rotvec(degrees=True), 1) + 0.0
    room = float(np.min(np.array(mount.printer_bed_mm) - pose.size_mm))
    return [
        Finding(
            check=BED_CHECK,
            subject=mesh.name,
            figure=room,
            unit="mm of bed left",
            limit=0.0,
            note=f"{size} mm as printed, turned by ({turn[0]:g}, {turn[1]:g}, {turn[2]:g}) deg",
            problem=None if pose.fits else problem,
        ),
        Finding(
            check=OVERHANG_CHECK,
            subject=mesh.name,
            figure=pose.overhang_mm2,
            unit="mm² overhang",
            note=f"{pose.support_mm3 / 1000:.0f} cm³ under it, {pose.base_mm2:.0f} mm² on the bed",
        ),
    ]
