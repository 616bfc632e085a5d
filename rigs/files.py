"""Rig files: TOML in and out, and the presets that come with the package."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigs.atomic_files import write_text
from rigs.documents.presets import Presets
from rigs.documents.problems import Problem

if TYPE_CHECKING:
    import tomlkit

PRESETS = Path(__file__).parent / "presets"
RIGS = Presets("rig", PRESETS)

STEP_SUFFIXES = (".step", ".stp")
ROBOT_SUFFIXES = (".urdf", ".xacro", ".sdf")
FIXED_UNIT_SUFFIXES = (*STEP_SUFFIXES, *ROBOT_SUFFIXES)
"""Hulls' files whose unit nobody needs to say, or may."""
OWN_UNIT_SUFFIXES = (*FIXED_UNIT_SUFFIXES, ".dae", ".glb", ".gltf", ".3mf")
"""Hulls' files that say themselves what their numbers mean."""

FILE_KEYS = (("hull", "file"), ("water", "iop_file"), ("camera", "response_file"))
"""Sections and keys of a rig file that name another file; a relative name is taken from the rig file's folder."""


def preset_names() -> list[str]:
    """Names of the presets, in alphabetical order."""
    return RIGS.names()


def preset_path(name: str) -> Path:
    """File of a preset; raises `FileNotFoundError` when there is none of that name."""
    return RIGS.path(name)


def find_rig(name_or_path: str | Path) -> Path:
    """File of a rig given by preset name or by path; raises `FileNotFoundError` when there is none."""
    return RIGS.find(name_or_path)


def preset_with_hull(shape: str) -> str:
    """Name of a preset whose hull has a given shape of our own; raises `ValueError` when there is none."""
    documents = {name: load_document(preset_path(name)) for name in reversed(preset_names())}
    shapes = {document["hull"]["shape"]: name for name, document in documents.items() if "hull" in document}
    shapes.pop("file", None)
    if shape not in shapes:
        raise ValueError(f"hull {shape!r}: expected {', '.join(sorted(shapes))} or the name of a file")
    return shapes[shape]


def with_absolute_files(document: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The same document with the files that it names, relative to `folder`, by their full paths."""
    tables = {
        section: {**document[section], key: str((folder / document[section][key]).resolve())}
        for section, key in FILE_KEYS
        if _names_a_file(document, section, key)
    }
    return {**document, **tables}


def _names_a_file(document: Mapping[str, Any], section: str, key: str) -> bool:
    table = document.get(section)
    return isinstance(table, Mapping) and isinstance(table.get(key), str)


def missing_files(document: Mapping[str, Any], folder: Path) -> list[Problem]:
    """Problems of the files that a document names, relative to `folder`, and that are not there."""
    problems = []
    for section, key in FILE_KEYS:
        if _names_a_file(document, section, key):
            named = document[section][key]
            if "\0" in named:
                problems.append(Problem(place=f"{section}.{key}", value=named, expected="a file's name without NUL"))
                continue
            file = (folder / named).resolve()
            if not file.is_file():
                expected = f"a file; there is none at {file}"
                problems.append(Problem(place=f"{section}.{key}", value=named, expected=expected))
    return problems


def load_document(path: Path) -> tomlkit.TOMLDocument:
    """Read a TOML file so that its comments survive writing it again."""
    import tomlkit  # noqa: PLC0415  (only what writes rig files needs it)

    return tomlkit.parse(path.read_text(encoding="utf-8"))


def save_document(document: tomlkit.TOMLDocument, path: Path) -> None:
    """Write a TOML document, whole or not at all."""
    import tomlkit  # noqa: PLC0415

    write_text(path, tomlkit.dumps(document))
