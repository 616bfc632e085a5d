"""A new rig on the hull of a file: the file is read, what it is taken for is said, and the rig is written on it."""

from __future__ import annotations

from pathlib import Path

import tomlkit

from cad.hulls.files.taken import TakenHull, take_hull
from cad.hulls.files.triangles import read_hull_file
from reports.progress import Log
from rigs.new_rig import DEFAULT_PRESET, check_new_file, put_hull_file, rig_document, save_new_rig

LARGE_BYTES = 50_000_000
"""Reading a larger file takes long enough to be announced."""


def new_rig_on_hull(
    name: str,
    file: Path,
    hull: Path,
    *,
    preset: str = DEFAULT_PRESET,
    unit: str | None = None,
    forward: str | None = None,
    up: str | None = None,
    log: Log,
) -> TakenHull:
    """Write a rig whose hull is a file, and say what was found in the file.

    Parameters
    ----------
    name : str
        Of the rig.
    file : Path
        A new file in an existing folder.
    hull : Path
        The hull's file, in a format of `cad.read_hull_file`.
    preset : str
        Where everything but the hull comes from.
    unit : str, optional
        What the numbers in the hull's file mean: mm, cm, m or inch.
    forward, up : str, optional
        Axes of the hull's file, such as ``+x``.
    log : callable
        Takes lines of progress.

    Raises
    ------
    ValueError
        When the hull's file cannot be used, or what is given does not go with it; nothing is written then.
    FileExistsError, FileNotFoundError
        When there is such a rig already, no such folder, hull or preset.
    """
    check_new_file(file)
    document = rig_document(name, preset)
    taken = take(hull, unit=unit, forward=forward, up=up, log=log)
    put_taken_hull(document, taken, file.parent)
    save_new_rig(document, file)
    return taken


def take(
    hull: Path, *, unit: str | None = None, forward: str | None = None, up: str | None = None, log: Log
) -> TakenHull:
    """Read a hull's file and decide what it is taken for; raises as `new_rig_on_hull`."""
    if hull.is_file() and hull.stat().st_size > LARGE_BYTES:
        log(f"{hull.name}: reading {hull.stat().st_size / 1e6:.0f} MB")
    return take_hull(read_hull_file(hull), unit=unit, forward=forward, up=up)


def put_taken_hull(document: tomlkit.TOMLDocument, taken: TakenHull, folder: Path) -> None:
    """Write a hull's table into a rig that will lie in `folder`, and what the file says of the vehicle."""
    put_hull_file(document, taken.section(), folder=folder)
    mass_kg = taken.found.mass_kg
    if mass_kg is not None and "vehicle" in document:
        item = tomlkit.item(round(mass_kg, 3))
        item.comment(f"all links of {taken.found.file.name}")
        document["vehicle"]["mass_kg"] = item
