"""New rig files: copies of presets, with another name and hull."""

from __future__ import annotations

import os
from pathlib import Path

import tomlkit

from rigs.catalogue import DATA
from rigs.files import PRESETS, load_document, preset_path, preset_with_hull, save_document
from rigs.mounting import FileHull
from rigs.rig import Rig

DEFAULT_PRESET = "aqua2"
PLAIN_RIG = DATA / "new_rig.toml"
"""Numbers for a robot of one's own, to be placed on its hull."""
POSE = {
    "position_mm": "where the file's origin lies in the body",
    "yaw_deg": "turns the file to the left",
    "pitch_deg": "nose up",
    "roll_deg": "clockwise, seen from behind; first roll, then pitch, then yaw",
}
"""Keys of a hull file's pose and what they say in a new rig."""


def create_rig_file(name: str, file: Path, *, preset: str | None = None, shape: str | None = None) -> str:
    """Create a rig file from a preset, with the preset's comments; return the preset's name.

    Parameters
    ----------
    name : str
        Of the rig.
    file : Path
        A new file in an existing folder.
    preset : str, optional
        By default the one that has the hull's shape, else `DEFAULT_PRESET`.
    shape : str, optional
        Of the hull.

    Raises
    ------
    ValueError
        When preset and shape are both given, or the rig would be invalid.
    FileExistsError, FileNotFoundError
        When there is such a file already, or no such folder.
    """
    if preset is not None and shape is not None:
        raise ValueError(f"--hull {shape}: expected --from or the shape of a hull, got both")
    preset = preset or (DEFAULT_PRESET if shape is None else preset_with_hull(shape))
    check_new_file(file)
    document = rig_document(name, preset)
    if "file" in document.get("hull", {}):
        # A preset's hull stays where the preset is.
        document["hull"]["file"] = os.path.relpath(PRESETS / document["hull"]["file"], file.parent)
    save_new_rig(document, file)
    return preset


def rig_document(name: str, preset: str) -> tomlkit.TOMLDocument:
    """A preset under another name; raises `FileNotFoundError` when there is none."""
    document = load_document(preset_path(preset))
    document["name"] = name
    return document


def put_hull_file(document: tomlkit.TOMLDocument, hull: FileHull, *, folder: Path) -> None:
    """Let a hull's file take the place of the hull in a rig that will lie in `folder`, with the file's pose.

    Raises
    ------
    ValueError
        When the rig has no mirrors, and so no hull.
    """
    if "hull" not in document:
        raise ValueError(f"hull {hull.file.name!r}: expected a preset with mirrors, got one that has no hull")
    table = tomlkit.table()
    table["shape"] = "file"
    table["file"] = os.path.relpath(hull.file, folder)
    if hull.unit is not None:
        table["unit"] = hull.unit
    if hull.keep != "all":
        table["keep"] = hull.keep
    for key, meaning in POSE.items():
        value = getattr(hull, key)
        table[key] = list(value) if isinstance(value, tuple) else value
        table[key].comment(meaning)
    document["hull"] = table
    for end in ("fold", "base"):
        document["mount"].pop(f"{end}_plane", None)
        if document["mount"].get(f"{end}_attachment") == "clamps":
            # They go around a cylinder, which a file's hull is not known to be.
            document["mount"].pop(f"{end}_attachment")


def check_new_file(file: Path) -> None:
    """Raise `FileExistsError` or `FileNotFoundError` unless a file is new and its folder there."""
    if file.exists():
        raise FileExistsError(f"{file}: expected a new file, but there is one already")
    if not file.parent.is_dir():
        raise FileNotFoundError(f"{file}: expected an existing folder, but there is no {file.parent}")


def save_new_rig(document: tomlkit.TOMLDocument, file: Path) -> None:
    """Write a rig to a new file; raises `RigError`, with nothing written, when it is not valid."""
    Rig.parse(tomlkit.dumps(document), source=f"new rig {document['name']!r}", folder=file.parent)
    check_new_file(file)
    save_document(document, file)
