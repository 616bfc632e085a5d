"""Drawing sheets of a mount: one for each printed part, for each mirror, and for the assembly."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from build123d import Solid
from numpy.typing import NDArray

from cad.assembly.assembly import Assembly, Part
from cad.export.drawings.assembly_drawing import draw_assembly
from cad.export.drawings.bill_of_materials import Item
from cad.export.drawings.manifest import HASH_DIGITS, rig_hash
from cad.export.drawings.part_drawing import draw_part
from cad.shapes import location_mm
from optics.mesh import Group, Role


def write_drawings(assembly: Assembly, items: Sequence[Item], folder: Path) -> list[Path]:
    """Write `PART.svg`, `PART.pdf`, ... and `assembly.svg`, `assembly.pdf`."""
    rig, gaze = assembly.rig, assembly.rig.require_gaze()
    digest = rig_hash(rig)[:HASH_DIGITS]
    written = draw_assembly(assembly, items, rig_hash=digest).write(folder / "assembly")
    for part in assembly.parts:
        if part.printed or part.role is Role.MIRROR:
            solid, origin = _to_draw(assembly, part)
            material = f"{gaze.mount.material.upper()}, printed solid" if part.printed else part.catalogue
            sheet = draw_part(solid, rig=rig.name, name=part.name, material=material, rig_hash=digest, origin=origin)
            written += sheet.write(folder / part.name)
    return written


def _to_draw(assembly: Assembly, part: Part) -> tuple[Solid, NDArray[np.float64] | None]:
    """Solid in the frame its views look along, and the origin of its dimensions if that is not its corner."""
    if part.role is Role.MIRROR and part.group is Group.FIXED:
        # Its plate lies aslant in the body; it is drawn as it is cut.
        return location_mm(assembly.layout.body_from_m1).inverse() * part.solid, None
    if part.group is Group.FIXED:
        return location_mm(assembly.layout.body_from_mount).inverse() * part.solid, None
    return part.solid, np.zeros(3) if part.printed else None
