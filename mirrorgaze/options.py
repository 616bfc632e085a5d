"""Arguments and options that several commands take.

An option's name carries the unit where its number has one, as the keys of the rig file do (`--depth-m`); its help says
the unit in words.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal

import typer

DIVES = "dives/presets/*.toml"


def _rig_names(incomplete: str) -> list[str]:
    from rigs.files import preset_names

    return _names_and_files(preset_names(), incomplete)


def _dive_names(incomplete: str) -> list[str]:
    # `dives.preset_names` would load what a dive takes, and a user who presses Tab waits for it.
    return _names_and_files(sorted(path.stem for path in Path(__file__).parents[1].glob(DIVES)), incomplete)


def _names_and_files(names: Iterable[str], incomplete: str) -> list[str]:
    """Presets, folders and TOML files that go on from what is typed."""
    folder = Path(incomplete).parent
    beside = sorted(folder.iterdir()) if folder.is_dir() else []
    files = [f"{path}/" if path.is_dir() else str(path) for path in beside if path.is_dir() or path.suffix == ".toml"]
    return [each for each in (*names, *files) if each.startswith(incomplete) and not each.startswith(".")]


RigArgument = Annotated[str, typer.Argument(metavar="RIG", help="Preset name or rig file.", autocompletion=_rig_names)]
DiveArgument = Annotated[
    str, typer.Argument(metavar="DIVE", help="Preset name or dive file.", autocompletion=_dive_names)
]
WidthOption = Annotated[
    int | None, typer.Option(metavar="N", help="Image width, in pixels.", show_default="the camera's", min=1, max=20000)
]
HeightOption = Annotated[
    int | None,
    typer.Option(metavar="N", help="Image height, in pixels.", show_default="the camera's", min=1, max=20000),
]

PanOption = Annotated[float, typer.Option("--q1-deg", help="Pan joint angle, in degrees.")]
TiltOption = Annotated[
    float, typer.Option("--q2-deg", help="Tilt joint angle, in degrees; the gaze turns twice as far.")
]
LightOption = Annotated[Literal["draft", "full"], typer.Option(help="Light between surfaces; a draft is found sooner.")]
SeedOption = Annotated[int, typer.Option("--seed", metavar="N", help="Random seed.", min=0)]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the results as JSON.")]
OpenOption = Annotated[bool, typer.Option("--open", help="Open the page in a browser when it is written.")]
TablesOption = Annotated[
    Path | None, typer.Option("--output", "-o", metavar="DIR", help="Write tables and figures to this folder.")
]

WorkersOption = Annotated[
    int | None,
    typer.Option(metavar="N", help="Number of processes on this machine.", show_default="number of cores", min=1),
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Work on a dask cluster instead, such as tcp://10.0.0.1:8786."),
]
ShardOption = Annotated[
    str | None,
    typer.Option(metavar="I/N", help="Do part I of N alone; the same command without it puts all parts together."),
]
