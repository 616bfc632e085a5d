"""Dive files, damaged as documents or as text, and the CSV files of paths that they name."""

from __future__ import annotations

import random
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.attack.mutations import damaged_bytes
from benchmarks.attack.rigs import damaged_text

NAME = "dives"
GOAL = 10_000

DAMAGED_PATH = 0.3
"""Share of the cases that damage the file of a path and leave the dive alone."""

PATH = "track.csv"
ROWS = 200


def prepare(folder: Path) -> Callable[[random.Random], None]:
    """What the cases share: the presets, and a dive whose target moves on a path from a file."""
    from dives.dive import PRESETS, parse_dive

    files = [*sorted(PRESETS.glob("*.toml")), _dive_on_a_path(folder)]
    documents = [tomllib.loads(file.read_text(encoding="utf-8")) for file in files]
    track = (folder / PATH).read_bytes()
    for file in files:
        parse_dive(file.read_text(encoding="utf-8"), source=file.name, folder=folder)

    def case(rng: random.Random) -> None:
        if rng.random() < DAMAGED_PATH:
            (folder / PATH).write_bytes(damaged_bytes(track, rng))
            text = files[-1].read_text(encoding="utf-8")
        else:
            (folder / PATH).write_bytes(track)
            number = rng.randrange(len(files))
            text = damaged_text(files[number], documents[number], rng)
        parse_dive(text, source="attacked.toml", folder=folder)

    return case


def _dive_on_a_path(folder: Path) -> Path:
    """A dive after a ball that swims as a file says."""
    time_s = np.linspace(0, 20, ROWS)
    rows = np.column_stack([time_s, 3 + 0.02 * time_s, 0.5 * np.sin(time_s / 3), 0.1 * np.cos(time_s / 3)])
    header = "time_s,x_m,y_m,z_m"
    np.savetxt(folder / PATH, rows, delimiter=",", header=header, comments="", fmt="%.6f")
    file = folder / "on_a_path.toml"
    file.write_text(
        'name = "on-a-path"\nrig = "aqua2"\nduration_s = 15.0\ndepth_m = 8.0\n'
        f'[robot]\nmotion = "hover"\n[target.path]\nshape = "file"\nfile = "{PATH}"\n',
        encoding="utf-8",
    )
    return file
