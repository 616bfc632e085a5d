"""The assembly as STEP, with names and colours, the same bytes for the same rig.

Open CASCADE writes the shapes in the order of the parts, but the colours in the order of memory addresses. The shapes
are therefore written by it without colours, and the few lines that colour a solid are added to the text.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping
from copy import deepcopy
from datetime import datetime
from pathlib import Path

import trimesh
from build123d import Compound, Solid, export_step

from cad.assembly.assembly import Assembly
from cad.colours import colour_fractions
from cad.shapes import location_mm
from optics.mesh import Role

OCCURRENCE = re.compile(r"NEXT_ASSEMBLY_USAGE_OCCURRENCE\(\s*'\d+'(.*?);", re.DOTALL)
"""A part's place in a STEP assembly; its identifier is counted up over all files that a process writes."""
SHAPE_OF_PRODUCT = re.compile(
    r"= PRODUCT\('(?P<name>[^']*)'"
    r"|ADVANCED_BREP_SHAPE_REPRESENTATION\('',\(\s*#\d+,(?P<solids>[^)]*)\),\s*(?P<context>#\d+)\)"
)
"""A product and, some lines below it, the solids it consists of and the context they are measured in."""
TIMESTAMP = datetime(2021, 1, 1)
"""A STEP header must have a date; a fixed one keeps the file's bytes the same."""
LAST_NUMBER = re.compile(r"^#(\d+) = ", re.MULTILINE)
PICTURE = "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION"
END = "ENDSEC;\nEND-ISO-10303-21;\n"


def write_step(assembly: Assembly, path: Path, q1: float = 0.0, q2: float = 0.0) -> Path:
    """Write the assembly in millimetres, in the body frame; joint values in radians.

    A hull that is only a mesh is left out: STEP holds exact shapes.
    """
    placed = []
    for part in assembly.parts:
        if isinstance(part.solid, trimesh.Trimesh):
            continue
        # Alike pieces share one shape, and would share one name.
        solid: Solid = location_mm(assembly.pose(part, q1, q2)) * deepcopy(part.solid)
        solid.label = part.name
        solid.color = None
        placed.append(solid)
    whole = Compound(label=path.stem, children=placed)
    if not export_step(whole, path, timestamp=TIMESTAMP):
        raise OSError(f"expected to write {path.name}, but the STEP writer gave up")
    roles = {part.name: part.role for part in assembly.parts}
    path.write_text(_coloured(_renumbered(path.read_text(encoding="utf-8")), roles), encoding="utf-8")
    return path


def _renumbered(step: str) -> str:
    """Count the places of parts from 1, each on one line: otherwise the bytes depend on what was written before."""
    number = itertools.count(1)

    def occurrence(found: re.Match[str]) -> str:
        rest = re.sub(r"\n\s*", "", found[1])
        return f"NEXT_ASSEMBLY_USAGE_OCCURRENCE('{next(number)}'{rest};"

    return OCCURRENCE.sub(occurrence, step)


def _coloured(step: str, roles: Mapping[str, Role]) -> str:
    """Add the colours of the parts' roles to a STEP file's text."""
    if not step.endswith(END):
        raise ValueError(f"expected a STEP file that ends in {END!r}, got {step[-40:]!r}")
    first = max(int(number) for number in LAST_NUMBER.findall(step)) + 1
    name, lines = "", []
    styles: dict[Role, str] = {}
    numbers = itertools.count(first)
    for found in SHAPE_OF_PRODUCT.finditer(step):
        if found["name"] is not None:
            name = found["name"]
            continue
        role = roles[name]
        if role not in styles:
            *made, styles[role] = _style(role, numbers)
            lines += made
        for solid in found["solids"].split(","):
            item, picture = next(numbers), next(numbers)
            lines += [
                f"#{item} = STYLED_ITEM('color',({styles[role]}),{solid.strip()});",
                f"#{picture} = {PICTURE}('',(#{item}),{found['context']});",
            ]
    return step.removesuffix(END) + "".join(f"{line}\n" for line in lines) + END


def _style(role: Role, numbers: Iterator[int]) -> list[str]:
    """Lines that define a surface colour, and last the reference to it (ISO 10303-46, presentation styles)."""
    red, green, blue = colour_fractions(role)
    chain = [
        f"COLOUR_RGB('{role.value}',{red:.9f},{green:.9f},{blue:.9f})",
        "FILL_AREA_STYLE_COLOUR('',{})",
        "FILL_AREA_STYLE('',({}))",
        "SURFACE_STYLE_FILL_AREA({})",
        "SURFACE_SIDE_STYLE('',({}))",
        "SURFACE_STYLE_USAGE(.BOTH.,{})",
        "PRESENTATION_STYLE_ASSIGNMENT(({}))",
    ]
    lines, reference = [], ""
    for entity in chain:
        lines.append(f"#{(number := next(numbers))} = {entity.format(reference)};")
        reference = f"#{number}"
    return [*lines, reference]
