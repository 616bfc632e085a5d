"""What the slicer makes of whole print plates: time, plastic, supports and warnings of each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cad.checks.printing.slicer import judged, slice_stl, slicer_path
from cad.export.printing.plates import plate_stl, print_plates
from cad.finding import Finding
from optics.mesh import PartMesh
from rigs import Rig


def plate_findings(rig: Rig, meshes: Sequence[PartMesh]) -> list[Finding]:
    """Slice each print plate; nothing is found where there is no slicer.

    Parameters
    ----------
    rig : Rig
        With a mount.
    meshes : sequence of PartMesh
        Printed parts.

    Returns
    -------
    list of Finding
        One per plate, of the check that slices the parts. The plate is the one that export writes.
    """
    program = slicer_path()
    if program is None:
        return []
    findings = []
    for number, plate in enumerate(print_plates(rig, meshes), 1):
        vertices_mm = 1000 * np.vstack([mesh.vertices_m for mesh in plate])
        name = f"plate {number} ({', '.join(mesh.name for mesh in plate)})"
        findings.append(judged(name, slice_stl(program, plate_stl(plate), rig.require_gaze().mount), vertices_mm))
    return findings
