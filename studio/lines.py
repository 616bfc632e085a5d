"""Every action of the studio as a line that one can copy: a command, or Python."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from studio.results import ViewRequest
from studio.surroundings import Surroundings


def change_line(values: Mapping[str, Any]) -> str:
    """Python of a change."""
    arguments = ", ".join(f"{place.replace('.', '__')}={value!r}" for place, value in values.items())
    return f"rig = rig.with_({arguments})"


def view_line(file: Path | str, request: ViewRequest) -> str:
    """Command that renders the same image."""
    words = ["render", str(file), "--q1-deg", f"{request.q1_deg:g}", "--q2-deg", f"{request.q2_deg:g}"]
    words += request.surroundings.options()
    if request.sensor:
        words.append("--sensor")
    return command_line(words)


def command_line(words: Iterable[str]) -> str:
    """A command of mirrorgaze, as it is typed."""
    return shlex.join(["mirrorgaze", *words])


def size_words(
    file: str, window: str, azimuth_deg: tuple[float, float], elevation_deg: tuple[float, float]
) -> list[str]:
    """Words of the command that sizes the mirrors of a rig file."""
    ranges = (("--azimuth-deg", azimuth_deg), ("--elevation-deg", elevation_deg))
    asked = [word for name, pair in ranges for word in (name, *(f"{value:g}" for value in pair))]
    return ["size", file, "--window", window, *asked, "--apply"]


def search_words(file: str, folder: str, designs: int, take: int | None = None) -> list[str]:
    """Words of the command that searches around a rig file, or takes a design of that search."""
    words = ["search", file, "--designs", str(designs), "--rigs", "4", "-o", f"{folder}/search"]
    return words if take is None else [*words, "--apply", str(take)]


def dive_words(file: Path, folder: str, seconds: float, surroundings: Surroundings) -> list[str]:
    """Words of the command that takes a rig on a short dive in its surroundings."""
    settings = {"rig": str(file), "duration_s": f"{seconds:g}", "world": surroundings.world}
    settings |= {"depth_m": f"{surroundings.depth_m:g}", "target.path.wait_s": "0"}
    chosen = [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
    return ["dive", "spiral", *chosen, "--no-check", "-o", folder]
