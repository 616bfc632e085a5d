"""Rig files: TOML in and out, and the presets that come with the package."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from typing import Any

import tomlkit
from pydantic import ValidationError

from rigs.problems import Problem, RigError, problems_from_validation
from rigs.specification import Rig

PRESETS = Path(__file__).parent / "presets"


def preset_names() -> list[str]:
    """Names of the presets, in alphabetical order."""
    return sorted(path.stem for path in PRESETS.glob("*.toml"))


def preset_path(name: str) -> Path:
    """File of a preset; raises `FileNotFoundError` when there is none of that name."""
    path = PRESETS / f"{name}.toml"
    if not path.is_file():
        raise FileNotFoundError(f"rig {name!r}: expected a preset ({', '.join(preset_names())}) or a TOML file")
    return path


def find_rig(name_or_path: str | Path) -> Path:
    """File of a rig given by preset name or by path."""
    path = Path(name_or_path)
    return path if path.is_file() else preset_path(str(name_or_path))


def load_rig(name_or_path: str | Path) -> Rig:
    """Read and validate a rig; see `Rig.load`."""
    path = find_rig(name_or_path)
    return parse_rig(path.read_text(encoding="utf-8"), source=str(name_or_path), folder=path.parent)


def parse_rig(text: str, *, source: str, folder: Path) -> Rig:
    """Validate the text of a rig file; relative file names in it are taken from `folder`.

    Raises
    ------
    RigError
        With every problem at once.
    """
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise RigError(source, [Problem(place="(syntax)", value=str(error), expected="valid TOML")]) from None
    rig = validate(document, source=source)
    if rig.hull is not None and rig.hull.shape == "file":
        file = (folder / rig.hull.file).resolve()
        if not file.is_file():
            problem = Problem(place="hull.file", value=str(rig.hull.file), expected=f"a file; there is none at {file}")
            raise RigError(source, [problem])
        rig = rig.model_copy(update={"hull": rig.hull.model_copy(update={"file": file})})
    return rig


def validate(document: dict[str, Any], *, source: str) -> Rig:
    """Validate parsed TOML.

    Unknown keys would hide what else is wrong beside them (pydantic checks a section as a whole only when all its
    fields are good), so they are reported, taken out, and the rest is looked at again.
    """
    problems: dict[str, Problem] = {}
    while True:
        try:
            rig = Rig.model_validate(document)
        except ValidationError as error:
            found = problems_from_validation(error, document, Rig)
            problems |= {str(problem): problem for problem in found}
            unknown = [p.place for p in found if p.expected.startswith(("a known key", "one of the known keys"))]
            if not unknown:
                break
            document = _without(document, unknown)
        else:
            break
    if problems:
        raise RigError(source, problems.values())
    return rig


def _without(document: dict[str, Any], places: list[str]) -> dict[str, Any]:
    pruned = {key: dict(value) if isinstance(value, dict) else value for key, value in document.items()}
    for place in places:
        *parents, last = place.split(".")
        here: dict[str, Any] = pruned
        for parent in parents:
            here[parent] = dict(here[parent])
            here = here[parent]
        here.pop(last, None)
    return pruned


def load_document(path: Path) -> tomlkit.TOMLDocument:
    """Read a TOML file so that its comments survive writing it again."""
    return tomlkit.parse(path.read_text(encoding="utf-8"))


def save_document(document: tomlkit.TOMLDocument, path: Path) -> None:
    """Write a TOML document beside its target, then put it in place."""
    partial = path.with_name(f".{path.name}.partial")
    partial.write_text(tomlkit.dumps(document), encoding="utf-8")
    os.replace(partial, path)
