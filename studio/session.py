"""A rig file being changed: its text, what can be undone, and the file that keeps it meanwhile.

The text is the state, not the rig: comments stay, and undo brings back the very bytes.
"""

from __future__ import annotations

import hashlib
import os
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import tomlkit

from rigs import Rig, RigError
from rigs.atomic_files import write_text
from rigs.documents.changes import bring_up_to_date
from rigs.documents.toml import read_toml
from rigs.files import FILE_KEYS, PRESETS, find_rig

GESTURE_S = 1.0
"""Changes of the same values that follow each other faster are one step of undo: a slider being dragged."""


class Session:
    """A rig file being changed.

    Parameters
    ----------
    source : str
        Preset name or path of a rig file with mirrors.
    folder : Path, optional
        Where the autosaved rig lies; by default beside the rig file, for a preset the working directory.
    clock : callable
        Seconds, for telling one gesture from the next.

    Attributes
    ----------
    source : str
        As given.
    autosave : Path
        Rig file that always holds the present text; a session of the same source begins with it.
    recovered : bool
        Whether this one did.

    Raises
    ------
    RigError, FileNotFoundError, ValueError
        For a file that holds no rig with mirrors.
    """

    def __init__(self, source: str, *, folder: Path | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        file = find_rig(source).resolve()
        is_preset = file.parent == PRESETS.resolve()
        self.source = source
        self._file = file
        place = folder or (Path.cwd() if is_preset else file.parent)
        self.autosave = place / autosave_name(file)
        self.own_file = None if is_preset else file
        self._clock = clock
        self._lock = threading.RLock()
        self._text = text_for(file, place)
        self._rig = self._parsed(self._text)
        self._undo: list[str] = []
        self._redo: list[str] = []
        self._gesture: tuple[tuple[str, ...], float] | None = None
        self.recovered = self._recover()
        write_text(self.autosave, self._text)

    @property
    def text(self) -> str:
        """Present text of the rig file."""
        return self._text

    @property
    def rig(self) -> Rig:
        """The rig that the text says."""
        return self._rig

    @property
    def can_undo(self) -> bool:
        """Whether there is a step to take back."""
        return bool(self._undo)

    @property
    def can_redo(self) -> bool:
        """Whether there is a step to take again."""
        return bool(self._redo)

    def change(self, values: Mapping[str, Any]) -> Rig:
        """Give keys such as ``gaze_mirror.width_mm`` other values; what else the file says stays as it is written.

        Raises
        ------
        RigError
            With every problem; nothing is changed then.
        """
        with self._lock:
            now = self._rig.with_(**{place.replace(".", "__"): value for place, value in values.items()})
            if now == self._rig:
                return now
            document = tomlkit.parse(self._text)
            bring_up_to_date(document, _values(self._rig), _values(now))
            self._step(tomlkit.dumps(document), tuple(sorted(values)))
            return self._rig

    def replace(self, text: str) -> Rig:
        """Put another text in the place of the present one, as one step; `RigError` when it is no rig with mirrors."""
        with self._lock:
            if text != self._text:
                self._step(text, ())
            return self._rig

    def undo(self) -> bool:
        """Take the last step back; whether there was one."""
        return self._move(self._undo, self._redo)

    def redo(self) -> bool:
        """Take the last undone step again; whether there was one."""
        return self._move(self._redo, self._undo)

    def save(self, path: Path) -> Path:
        """Write the rig as a rig file; files that it names are found from there.

        Raises
        ------
        FileNotFoundError
            When the folder does not exist.
        """
        path = path.expanduser()
        if not path.parent.is_dir():
            raise FileNotFoundError(f"{path}: expected an existing folder, but there is no {path.parent}")
        write_text(path, moved(self._text, self.autosave.parent, path.resolve().parent))
        return path

    def back_to_file(self) -> Rig:
        """Take over what the rig file says by now, as one step."""
        return self.replace(text_for(self._file, self.autosave.parent))

    def read_back(self) -> Rig:
        """Take over what a command wrote into the autosaved file, as one step."""
        return self.replace(read_toml(self.autosave, source=str(self.autosave), error=RigError))

    def close(self) -> None:
        """Take the kept file away when it says nothing that the rig file does not say."""
        with self._lock:
            if self._text == text_for(self._file, self.autosave.parent):
                self.autosave.unlink(missing_ok=True)

    def _step(self, text: str, gesture: tuple[str, ...]) -> None:
        rig = self._parsed(text)
        now = self._clock()
        goes_on = gesture and self._gesture is not None and self._gesture[0] == gesture
        if not (goes_on and self._gesture is not None and now - self._gesture[1] < GESTURE_S):
            self._undo.append(self._text)
        self._gesture = (gesture, now)
        self._redo.clear()
        self._put(text, rig)

    def _move(self, source: list[str], to: list[str]) -> bool:
        with self._lock:
            if not source:
                return False
            to.append(self._text)
            self._gesture = None
            text = source.pop()
            self._put(text, self._parsed(text))
            return True

    def _put(self, text: str, rig: Rig) -> None:
        write_text(self.autosave, text)
        self._text, self._rig = text, rig

    def _parsed(self, text: str) -> Rig:
        rig = Rig.parse(text, source=self.source, folder=self.autosave.parent)
        rig.require_gaze()
        return rig

    def _recover(self) -> bool:
        """Go on with what an earlier session left; what cannot be read is left out, and overwritten."""
        if not self.autosave.is_file():
            return False
        try:
            text = read_toml(self.autosave, source=str(self.autosave), error=RigError)
            if text == self._text:
                return False
            self._step(text, ())
        except (RigError, ValueError):
            return False
        return True


def autosave_name(file: Path) -> str:
    """Name of the file that keeps a session of a rig file; of two files of one name they differ."""
    return f".{file.stem}-{hashlib.sha256(str(file).encode()).hexdigest()[:8]}.studio.toml"


def text_for(file: Path, folder: Path) -> str:
    """Text of a rig file, as it has to be in another folder."""
    return moved(read_toml(file, source=str(file), error=RigError), file.parent, folder)


def moved(text: str, before: Path, now: Path) -> str:
    """Text of a rig file that moves from one folder to another: relative names of files are changed, nothing else."""
    if before.resolve() == now.resolve():
        return text

    document = tomlkit.parse(text)
    for section, key in FILE_KEYS:
        name = document.get(section, {}).get(key)
        if name is not None and not Path(name).is_absolute():
            document[section][key] = os.path.relpath(before / name, now)
    return tomlkit.dumps(document)


def _values(rig: Rig) -> dict[str, Any]:
    return rig.model_dump(mode="json", exclude_none=True)
