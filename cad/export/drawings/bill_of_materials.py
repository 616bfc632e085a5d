"""Bill of materials: what is printed, and what is bought by its catalogue name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np

from cad.assembly.assembly import Assembly
from cad.loads.masses import part_bodies
from optics.mesh import Role
from rigs.atomic_files import csv_text

COLUMNS = ("kind", "name", "count", "material", "volume_cm3", "mass_g", "size_mm", "parts")


@dataclass(frozen=True, kw_only=True)
class Item:
    """A line of the bill.

    Attributes
    ----------
    kind : str
        "print" or "buy".
    name : str
        Part to print, or what to order.
    count : int
    material : str
        Of what is printed; empty for what is bought.
    volume_cm3, mass_g : float
        Of one piece. A print is taken to be solid.
    size_mm : tuple of float
        Box around one piece, along the axes of its frame.
    parts : tuple of str
        Names of the parts in the assembly.
    """

    kind: str
    name: str
    count: int
    material: str
    volume_cm3: float
    mass_g: float
    size_mm: tuple[float, float, float]
    parts: tuple[str, ...]


def bill_of_materials(assembly: Assembly) -> list[Item]:
    """Everything but the hull: what is printed first, then what is bought, alike pieces counted together."""
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
                material=gaze.mount.material if part.printed else "",
                volume_cm3=1e6 * body.volume_m3,
                mass_g=1000 * body.mass_kg,
                size_mm=(float(x), float(y), float(z)),
                parts=(part.name,),
            )
        )
    lines.sort(key=lambda line: (line.kind != "print", line.name if line.kind == "buy" else ""))
    return [_counted(list(alike)) for _, alike in groupby(lines, key=lambda line: (line.kind, line.name))]


def write_bill(items: Sequence[Item], path: Path) -> Path:
    """Write the bill as CSV."""
    rows: list[Sequence[object]] = [COLUMNS]
    for item in items:
        # What is bought has its size in its name, and may lie aslant in its frame.
        size = " x ".join(f"{side:.1f}" for side in item.size_mm) if item.kind == "print" else ""
        numbers = (f"{item.volume_cm3:.2f}", f"{item.mass_g:.1f}")
        rows.append([item.kind, item.name, item.count, item.material, *numbers, size, " ".join(item.parts)])
    path.write_text(csv_text(rows), encoding="utf-8")
    return path


def _counted(alike: list[Item]) -> Item:
    first = alike[0]
    return Item(
        kind=first.kind,
        name=first.name,
        count=len(alike),
        material=first.material,
        volume_cm3=first.volume_cm3,
        mass_g=first.mass_g,
        size_mm=first.size_mm,
        parts=tuple(line.parts[0] for line in alike),
    )
