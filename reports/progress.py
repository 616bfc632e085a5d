"""Stages of long work that remember what they finished, so that an interrupted run goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rigs import Rig

STATE_FILE = ".stages.json"

SOURCE_PACKAGES = ("rigs", "optics", "cad", "scenes", "tracking", "reports")

Announce = Callable[[str], None]
"""Takes one line of progress at a time."""


@dataclass
class Stages:
    """Finished stages of one piece of work in one folder, which appears with the first of them.

    A stage's result is plain JSON data; it is trusted again only for the same rig and the same program, and only
    while every file it wrote is still there.
    """

    folder: Path
    key: str
    announce: Announce
    done: dict[str, dict[str, Any]] = field(default_factory=dict)

    @classmethod
    def open(cls, folder: Path, rig: Rig, announce: Announce, *, settings: str = "") -> Stages:
        """Take up work in a folder: new, empty, or one that this function opened before.

        What was done for other settings is done anew.

        Raises
        ------
        FileExistsError
            When the folder holds something else.
        """
        key = work_key(rig, settings)
        state = folder / STATE_FILE
        if folder.exists() and not state.is_file() and (not folder.is_dir() or any(folder.iterdir())):
            raise FileExistsError(f"{folder}: expected a new folder, an empty one or an earlier dossier")
        stages = cls(folder=folder, key=key, announce=announce)
        if state.is_file():
            saved = json.loads(state.read_text(encoding="utf-8"))
            stages.done = saved["done"] if saved["key"] == key else {}
        return stages

    def run(self, name: str, work: Callable[[], tuple[dict[str, Any], list[Path]]]) -> dict[str, Any]:
        """Result of a stage: remembered, or computed by `work`, which returns it with the files it wrote."""
        finished = self.done.get(name)
        if finished is not None and all((self.folder / file).is_file() for file in finished["files"]):
            self.announce(f"{name}: done before")
            result: dict[str, Any] = finished["result"]
            return result
        self.announce(f"{name} ...")
        result, files = work()
        self.done[name] = {"result": result, "files": [str(file.relative_to(self.folder)) for file in files]}
        self._save()
        return result

    def _save(self) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        write_text(self.folder / STATE_FILE, json.dumps({"key": self.key, "done": self.done}, indent=1))


def write_text(path: Path, text: str) -> None:
    """Write a text file beside its place, then put it there."""
    partial = path.with_name(f".{path.name}.partial")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)


def work_key(rig: Rig, settings: str = "") -> str:
    """Hash of the rig, of its hull file if it has one, of the settings, and of the program itself."""
    digest = hashlib.sha256((rig.model_dump_json() + settings).encode())
    if rig.hull is not None and rig.hull.shape == "file":
        digest.update(rig.hull.file.read_bytes())
    root = Path(__file__).parent.parent
    for package in SOURCE_PACKAGES:
        for path in sorted((root / package).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()
