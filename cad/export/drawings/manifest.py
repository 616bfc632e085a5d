"""What an export was made from and what it holds, so that a file found later can be told apart from another."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import tomlkit

from cad.hulls.files.triangles import hull_files
from rigs import Rig

SHAPING_PACKAGES = ("mirrorgaze", "build123d", "cadquery-ocp-novtk", "trimesh", "manifold3d", "lib3mf", "matplotlib")
"""Those whose version can change the bytes."""
HASH_DIGITS = 12
"""How much of the rig's hash is printed on drawings: no two rigs of a lab will share it."""


def rig_text(rig: Rig) -> str:
    """Rig as a rig file with every number in it, those of the servo catalogue and the defaults included.

    A hull's file is named without its folder: the text shall be the same on every machine.
    """
    numbers: dict[str, Any] = rig.model_dump(mode="json", exclude_none=True)
    if rig.file_hull is not None:
        numbers["hull"]["file"] = rig.file_hull.file.name
    return tomlkit.dumps(numbers)


def rig_hash(rig: Rig) -> str:
    """SHA-256 of all that the design comes from: the rig's text and, where they make its hull, files.

    What its owner asks for and calls it is no part of the design.
    """
    design = rig.model_copy(update={"requirements": None, "revision": None})
    digest = hashlib.sha256(rig_text(design).encode())
    if rig.file_hull is not None:
        for file in hull_files(rig.file_hull.file):
            digest.update(file.read_bytes())
    return digest.hexdigest()


def write_manifest(rig: Rig, folder: Path, files: Sequence[Path]) -> Path:
    """Write `manifest.json`: the rig, versions, and size and SHA-256 of every file, by its path in the folder."""
    contents = {
        "rig": {"name": rig.name, "sha256": rig_hash(rig), "text": rig_text(rig)},
        "versions": {name: version(name) for name in SHAPING_PACKAGES},
        "files": {path.relative_to(folder).as_posix(): _facts(path) for path in sorted(files)},
    }
    path = folder / "manifest.json"
    path.write_text(json.dumps(contents, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    return path


def _facts(path: Path) -> dict[str, Any]:
    content = path.read_bytes()
    return {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
