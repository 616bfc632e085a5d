"""How long a part prints and how much plastic it takes where no slicer says so, from its shape alone."""

from __future__ import annotations

import numpy as np
import trimesh

from cad.assembly.print_pose import PrintPose
from cad.checks.printing.slicer import Slice
from optics.mesh import PartMesh
from rigs import Mount
from rigs.catalogue import MATERIALS

HOURS = (0.0038, 0.0824, 0.0053)
"""Per cm2 of surface (the walls), cm3 of volume (what fills it) and cm3 that supports fill: PrusaSlicer's times of the
16 parts of aqua2, bluerov2, torpedo and glider (3.3 to 16.3 h), fitted so that the worst is off by least; 0.4 mm
nozzle, `slicer.PROFILE`. Webs without infill and massive bases have little in common but these three numbers."""
PLASTIC_CM3 = (0.0731, 0.463, 0.1263)
"""The same of its plastic."""
HOURS_WITHIN, PLASTIC_WITHIN = 0.23, 0.13
"""How far the fits are off for the worst of those parts, as shares."""


def estimated_slice(mesh: PartMesh, pose: PrintPose, mount: Mount) -> Slice:
    """What a slicer would make of a part, a closed surface in metres; see `HOURS` for how well."""
    surface = trimesh.Trimesh(100 * mesh.vertices_m, mesh.faces, process=False)
    shape = np.array([surface.area, surface.volume, pose.support_mm3 / 1000])
    density = MATERIALS[mount.material].density_kg_per_m3 / 1000
    return Slice(
        time_s=3600 * float(shape @ HOURS),
        mass_g=density * float(shape @ PLASTIC_CM3),
        support_layers=int(pose.support_mm3 > 0),
        warnings=(),
    )
