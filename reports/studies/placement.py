"""Placement in a rig file: the keys that were decided for the user carry the comment "# placed", with the reason.

Such a key is decided again by the next placement. Without that comment a key is the user's own: it is pinned.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit
import trimesh
from tomlkit.items import Item

from cad.hulls.files.found import FoundHull
from cad.hulls.hull import closed_surface, file_hull_solid
from cad.loads.seawater import water_density
from cad.placement.fold_frame import BASE_ANCHOR, DIRECTION, FOLD_ANCHOR, PLACED_KEYS
from cad.placement.placement import Placement, place
from reports.progress import Log
from rigs import Rig, Water, load_document, save_document
from rigs.files import PRESETS, find_rig

MARK = "placed"


def place_rig_file(name: str, *, log: Log) -> Placement:
    """Place camera, mirrors and anchors of a rig file again, but for what its user pinned, and write them into it.

    Parameters
    ----------
    name : str
        Path of a rig file; presets are refused.
    log : callable
        Takes lines of progress.

    Raises
    ------
    ValueError
        For a preset, when the rig's hull is not a file's, everything is pinned, or nothing fits; the file is then left
        as it was.
    """
    file = find_rig(name)
    if file.resolve().parent == PRESETS.resolve():
        raise ValueError(f"{name!r}: expected a rig file of yours; copy the preset first: mirrorgaze new my-rig")
    document = load_document(file)
    pinned = pinned_keys(document)
    rig = Rig.load(file)
    if set(PLACED_KEYS) <= pinned:
        raise ValueError(
            f"{rig.name}: expected keys to place, got all of them pinned; put the comment '# {MARK}' behind the keys "
            f"that may change, such as {FOLD_ANCHOR} and {BASE_ANCHOR}"
        )
    if rig.file_hull is None:
        raise ValueError(f"hull of {rig.name!r}: expected the hull of a file, on which a mount can be placed")
    solid = closed_surface(file_hull_solid(rig.file_hull))
    placement = place_document(document, file.parent, solid, pinned=pinned, log=log)
    save_document(document, file)
    return placement


def place_document(
    document: tomlkit.TOMLDocument, folder: Path, hull: trimesh.Trimesh, *, pinned: Collection[str], log: Log
) -> Placement:
    """Place what is not pinned, and write it into a rig's document.

    Parameters
    ----------
    document : TOMLDocument
        A whole rig with the hull of a file; changed in place.
    folder : Path
        Where it lies, for the files that it names.
    hull : Trimesh
        Closed surface of its hull, body frame, millimetres.
    pinned : collection of str
        Those of `PLACED_KEYS` that stay as they are.
    log : callable
        Takes lines of progress.

    Raises
    ------
    ValueError
        When nothing fits; the document is then as it was.
    """
    rig = Rig.parse(tomlkit.dumps(document), source=f"rig {document['name']!r}", folder=folder)
    placement = place(rig, hull, pinned=pinned, log=log)
    values = placement.rig.model_dump(mode="json")
    for key, reason in placement.reasons.items():
        section, name = key.split(".")
        _put(document, section, name, values[section][name], reason)
    if DIRECTION in placement.reasons:
        for name in ("min_deg", "max_deg"):
            document["joints"]["tilt"][name] = values["joints"]["tilt"][name]
    for end, anchor in (("fold", FOLD_ANCHOR), ("base", BASE_ANCHOR)):
        if anchor in placement.reasons:
            document["mount"].pop(f"{end}_plane", None)
            _put(document, "mount", f"{end}_normal", values["mount"][f"{end}_normal"], "the hull's normal there")
    return placement


def placement_rows(placement: Placement) -> list[tuple[str, str, str]]:
    """Key, value and reason of what was decided."""
    values = placement.rig.model_dump(mode="json")
    rows = []
    for key, reason in placement.reasons.items():
        section, name = key.split(".")
        value = values[section][name]
        text = ", ".join(f"{number:g}" for number in value) if isinstance(value, list) else f"{value}"
        rows.append((key, text, reason))
    return rows


def put_vehicle(document: tomlkit.TOMLDocument, hull: trimesh.Trimesh, found: FoundHull) -> None:
    """Write what a vehicle weighs, by its file or by what its hull displaces, and where its centre of buoyancy is.

    Parameters
    ----------
    document : TOMLDocument
    hull : Trimesh
        Closed, body frame, millimetres.
    found : FoundHull
        What its file says.
    """
    if "vehicle" not in document:
        return
    displaced = water_density(Water.model_validate(document.get("water", {}))) * float(hull.volume) / 1e9
    mass, reason = (displaced, "what the hull displaces when nothing floods it; weigh the vehicle")
    if found.mass_kg is not None:
        mass, reason = found.mass_kg, f"all links of {found.file.name}"
    _put(document, "vehicle", "mass_kg", round(mass, 3), reason)
    centre = np.round(hull.center_mass, 1) + 0.0
    _put(document, "vehicle", "centre_mm", centre.tolist(), "the middle of the hull's volume")


def pinned_keys(document: Mapping[str, Any]) -> set[str]:
    """Keys among `PLACED_KEYS` that a document has without the mark of a placement."""
    return {key for key in PLACED_KEYS if _is_pinned(document, *key.split("."))}


def _is_pinned(document: Mapping[str, Any], section: str, name: str) -> bool:
    table = document.get(section, {})
    if name not in table:
        return False
    item = table.item(name)
    return not item.trivia.comment.lstrip("# ").startswith(MARK)


def _put(document: tomlkit.TOMLDocument, section: str, name: str, value: Any, reason: str) -> None:
    item: Item = tomlkit.item(value)
    item.comment(f"{MARK}: {reason}")
    document[section][name] = item
