"""Arguments and options that several commands take.

An option's name carries the unit where its number has one, as the keys of the rig file do (`--depth-m`); its help says
the unit in words.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

RigArgument = Annotated[str, typer.Argument(metavar="RIG", help="Preset name or rig file.")]
DiveArgument = Annotated[str, typer.Argument(metavar="DIVE", help="Preset name or dive file.")]

PanOption = Annotated[float, typer.Option("--q1-deg", help="Pan joint angle, in degrees.")]
TiltOption = Annotated[
    float, typer.Option("--q2-deg", help="Tilt joint angle, in degrees; the gaze turns twice as far.")
]
SeedOption = Annotated[int, typer.Option("--seed", metavar="N", help="Random seed.", min=0)]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the results as JSON.")]
TablesOption = Annotated[
    Path | None, typer.Option("--output", "-o", metavar="DIR", help="Write tables and figures to this folder.")
]
