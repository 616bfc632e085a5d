"""What the slicer makes of the print plates: time, plastic, supports and warnings of each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cad.checks.printing.slicer import CHECK, NO_SLICER, judged, slice_finding, slice_stl, slicer_path
from cad.export.printing.plates import plate_stl, print_plates
from cad.finding import Finding
from optics.mesh import PartMesh
from rigs import Rig


def plate_findings(rig: Rig, meshes: Sequence[PartMesh]) -> list[Finding]:
    """Slice each print plate as it is exported; where it warns also its parts one by one, to tell which.

    Parameters
    ----------
    rig : Rig
        With a mount.
    meshes : sequence of PartMesh
        Printed parts.

    Returns
    -------
    list of Finding
        One per plate, and one per part of a plate that warns. Without a slicer one that says so.
    """
    program, mount = slicer_path(), rig.require_gaze().mount
    if program is None:
        return [Finding(check=CHECK, subject="printed parts", note=NO_SLICER, ran=False)]
    parts = {mesh.name: mesh for mesh in meshes}
    findings = []
    for number, plate in enumerate(print_plates(rig, meshes), 1):
        vertices_mm = 1000 * np.vstack([mesh.vertices_m for mesh in plate])
        names = [mesh.name for mesh in plate]
        subject = f"plate {number} ({', '.join(names)})"
        findings.append(judged(subject, slice_stl(program, plate_stl(plate), mount), vertices_mm))
        if findings[-1].problem is not None:
            findings += [slice_finding(parts[name], mount) for name in names]
    return findings
