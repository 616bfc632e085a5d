"""Bill of materials: what is printed, and what is bought by its catalogue name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

import numpy as np

from cad.assembly.assembly import Assembly
from cad.checks.printing.slicer import PROFILE
from cad.export.printing.prints import PartPrint, Prints
from cad.loads.masses import part_bodies
from optics.mesh import Role
from rigs.atomic_files import csv_text

COLUMNS = (
    "kind",
    "name",
    "count",
    "supplier",
    "material",
    "volume_cm3",
    "mass_g",
    "size_mm",
    "print_hours",
    "settings",
    "as_printed_mm",
    "turn_deg",
    "parts",
)
SUPPLIERS = {
    "Front-surface mirror": "optics",
    "Servo ": "model making",
    "Round horn": "model making",
    "Socket head cap screw": "fasteners",
    "Heat-set insert": "fasteners",
    "Plain washer": "fasteners",
    "Spacer sleeve": "fasteners",
    "Flanged plain bushing": "plain bearings",
    "Cable tie": "industrial supplies",
    "Hose clamp": "industrial supplies",
    "Acrylic foam tape": "industrial supplies",
    "Silicone": "industrial supplies",
}
"""Kind of shop by how the catalogue name of what is bought begins."""

SILICONE = "Silicone for glass, neutral cure (one with acetic acid eats the aluminium), a tube"
SILICONE_CM3 = 1.0
"""For a mirror: four holes of 8 mm through a floor of 2.5 to 4 mm and half a millimetre behind the plate, or a bead of
5 mm along a window of 300 mm. It is as dense as water, and left out of the loads."""


@dataclass(frozen=True, kw_only=True)
class Item:
    """A line of the bill of materials.

    Attributes
    ----------
    kind : str
        "print" or "buy".
    name : str
        Part to print, or what to order.
    count : int
    supplier : str
        Kind of shop; of a print "own printer".
    material : str
        Of what is printed; empty for what is bought.
    volume_cm3, mass_g : float
        Of one piece. A print is taken to be solid.
    size_mm : tuple of float
        Box around one piece, along the axes of its frame.
    parts : tuple of str
        Names of the parts in the assembly; none of silicone, which has no shape of its own.
    printed : PartPrint, optional
        How it is printed.
    """

    kind: str
    name: str
    count: int
    supplier: str
    material: str
    volume_cm3: float
    mass_g: float
    size_mm: tuple[float, float, float]
    parts: tuple[str, ...]
    printed: PartPrint | None = None


def bill_of_materials(assembly: Assembly, printed: Prints | None = None) -> list[Item]:
    """Everything but the hull: what is printed first, then what is bought, alike pieces counted together.

    `printed` says how the prints are made, where that is known (`cad.export.printing.prints`).
    """
    prints = {part.name: part for part in printed.parts} if printed else {}
    rig, gaze = assembly.rig, assembly.rig.require_gaze()
    bodies = {body.name: body for group in part_bodies(rig, assembly.meshes).values() for body in group}
    lines = []
    for part in assembly.parts:
        if part.role is Role.HULL:
            continue
        body = bodies[part.name]
        x, y, z = 1000 * np.ptp(part.mesh.vertices_m, axis=0)
        lines.append(
            Item(
                kind="print" if part.printed else "buy",
                name=part.name if part.printed else part.catalogue,
                count=1,
                supplier="own printer" if part.printed else _supplier(part.catalogue),
                material=gaze.mount.material if part.printed else "",
                volume_cm3=1e6 * body.volume_m3,
                mass_g=1000 * body.mass_kg,
                size_mm=(float(x), float(y), float(z)),
                parts=(part.name,),
                printed=prints.get(part.name),
            )
        )
    if gaze.mount.mirror_fixing == "glue":
        lines.append(_silicone(sum(part.role is Role.MIRROR for part in assembly.parts)))
    lines.sort(key=lambda line: (line.kind != "print", line.name if line.kind == "buy" else ""))
    return [_counted(list(alike)) for _, alike in groupby(lines, key=lambda line: (line.kind, line.name))]


def write_bill_of_materials(items: Sequence[Item], path: Path) -> Path:
    """Write the bill of materials as CSV."""
    rows: list[Sequence[object]] = [COLUMNS]
    for item in items:
        # What is bought has its size in its name, and may lie aslant in its frame.
        size = _by(item.size_mm) if item.kind == "print" else ""
        numbers = (f"{item.volume_cm3:.2f}", f"{item.mass_g:.1f}")
        row = [item.kind, item.name, item.count, item.supplier, item.material, *numbers, size]
        rows.append([*row, *_how_printed(item.printed), " ".join(item.parts)])
    path.write_text(csv_text(rows), encoding="utf-8")
    return path


def _how_printed(part: PartPrint | None) -> tuple[str, ...]:
    if part is None:
        return "", "", "", ""
    turn = " ".join(f"{angle:g}" for angle in part.turn_deg)
    return f"{part.time_s / 3600:.1f}", settings_words(), _by(part.size_mm), turn


def settings_words() -> str:
    """Layer, walls, infill and supports of every print."""
    return (
        f"{PROFILE['layer_height']} mm layers, {PROFILE['perimeters']} walls, {PROFILE['fill_density']} "
        f"{PROFILE['fill_pattern']}, supports below {PROFILE['support_material_threshold']} degrees"
    )


def _by(size_mm: Sequence[float]) -> str:
    return " x ".join(f"{side:.1f}" for side in size_mm)


def _silicone(mirrors: int) -> Item:
    volume_cm3 = SILICONE_CM3 * mirrors
    return Item(
        kind="buy",
        name=SILICONE,
        count=1,
        supplier=_supplier(SILICONE),
        material="",
        volume_cm3=volume_cm3,
        mass_g=volume_cm3,
        size_mm=(0.0, 0.0, 0.0),
        parts=(),
    )


def _supplier(catalogue: str) -> str:
    return next(supplier for beginning, supplier in SUPPLIERS.items() if catalogue.startswith(beginning))


def _counted(alike: list[Item]) -> Item:
    return replace(alike[0], count=len(alike), parts=tuple(name for line in alike for name in line.parts))
