"""Every action of the studio as a line that one can copy: a command, or Python."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from studio.results import ViewRequest


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
