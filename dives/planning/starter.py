"""A dive file to begin with: commented, and ready to be dived."""

from __future__ import annotations

import os
from pathlib import Path

import tomlkit

from dives.dive import parse_dive
from rigs.atomic_files import write_text
from rigs.files import find_rig
from rigs.new_rig import check_new_file

STARTER = Path(__file__).with_name("starter.toml")


def create_dive_file(name: str, file: Path, *, rig: str | None = None) -> None:
    """Create a dive file with every section commented.

    Parameters
    ----------
    name : str
        Of the dive.
    file : Path
        A new file in an existing folder.
    rig : str, optional
        Preset, or path of a rig file; by default the preset aqua2.

    Raises
    ------
    ValueError
        For a name, or a rig, that no dive can have.
    FileExistsError, FileNotFoundError
        When there is such a file already, no such folder, or no such rig.
    """
    check_new_file(file)
    document = tomlkit.parse(STARTER.read_text(encoding="utf-8"))
    document["name"] = name
    if rig is not None:
        found = find_rig(rig)
        document["rig"] = os.path.relpath(found, file.parent) if Path(rig).is_file() else rig
    text = tomlkit.dumps(document)
    parse_dive(text, source=str(file), folder=file.parent)
    write_text(file, text)
