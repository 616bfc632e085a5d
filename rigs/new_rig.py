"""New rig files: copies of presets, with another name and hull."""

from __future__ import annotations

from pathlib import Path

import tomlkit

from rigs.files import load_document, preset_path, preset_with_hull, put_hull_file, save_document
from rigs.rig import Rig

DEFAULT_PRESET = "aqua2"


def create_rig_file(name: str, file: Path, *, preset: str | None, hull: str | None, unit: str | None) -> str:
    """Create a rig file from a preset, with the preset's comments; return the preset's name.

    Parameters
    ----------
    name : str
        Of the rig.
    file : Path
        A new file in an existing folder.
    preset : str, optional
        By default the one that has the hull's shape, else `DEFAULT_PRESET`.
    hull : str, optional
        Shape, or a file that takes the place of the preset's hull.
    unit : str, optional
        Of the numbers in a hull's file.

    Raises
    ------
    ValueError
        When preset, hull and unit do not go together, or the rig would be invalid.
    FileExistsError, FileNotFoundError
        When there is such a file already, or no such folder.
    """
    is_file = hull is not None and "." in hull
    if unit is not None and not is_file:
        raise ValueError(f"--unit {unit}: expected with the file of a hull only")
    if preset is None:
        preset = preset_with_hull(hull) if hull is not None and not is_file else DEFAULT_PRESET
    elif hull is not None and not is_file:
        raise ValueError(f"--hull {hull}: expected --from or the shape of a hull, got both")
    document = load_document(preset_path(preset))
    document["name"] = name
    if hull is not None and is_file:
        put_hull_file(document, Path(hull), unit=unit, folder=file.parent)
    Rig.parse(tomlkit.dumps(document), source=f"new rig {name!r}", folder=file.parent)
    if file.exists():
        raise FileExistsError(f"{file}: expected a new file, but there is one already")
    if not file.parent.is_dir():
        raise FileNotFoundError(f"{file}: expected an existing folder, but there is no {file.parent}")
    save_document(document, file)
    return preset
