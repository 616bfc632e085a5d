"""Stages of long work that remember what they finished, so that an interrupted run goes on where it stopped."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter

from optics.kernels.cache import result_key
from optics.kernels.clock import Pace
from rigs import Rig
from rigs.atomic_files import PARTIAL, write_text

STATE_FILE = ".stages.json"

STAGES_VERSION = 8
"""Raised when a stage computes or writes something else for the same rig and settings."""

Log = Callable[[str], None]
"""Takes one line of progress at a time."""

TENTHS = 10

Result = TypeVar("Result")


@dataclass
class Stages:
    """Finished stages of one piece of work in one folder.

    A stage's result is a dataclass, or of another type that JSON holds; it is trusted again only for the same rig and
    the same program, and only while every file it wrote is still there.

    The folder is marked as ours before the first stage writes into it: a program that is killed there goes on in it.
    When that stage fails the mark goes again.
    """

    folder: Path
    key: str
    log: Log
    done: dict[str, dict[str, Any]] = field(default_factory=dict)

    @classmethod
    def open(cls, folder: Path, rig: Rig, log: Log, *, settings: str = "") -> Stages:
        """Take up work in a folder: new, empty, or one that this function opened before.

        What was done for other settings is done again.

        Raises
        ------
        FileExistsError
            When the folder holds something else.
        """
        key = work_key(rig, settings)
        state = folder / STATE_FILE
        if not state.is_file() and _holds_something(folder):
            raise FileExistsError(f"{folder}: expected a new folder, an empty one or that of an earlier run")
        stages = cls(folder=folder, key=key, log=log)
        if state.is_file():
            try:
                saved = json.loads(state.read_text(encoding="utf-8"))
                if saved.pop("digest") != result_key("state", STAGES_VERSION, json.dumps(saved)):
                    raise ValueError("its digest is another one")
                stages.done = saved["done"] if saved["key"] == key else {}
            except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
                log(f"{state}: cannot be read, so all stages are made again ({type(error).__name__})")
        return stages

    def run(self, name: str, kind: type[Result], work: Callable[[], tuple[Result, list[Path]]]) -> Result:
        """Result of a stage: remembered, or computed by `work`, which returns it with the files it wrote."""
        before = self.recall(name, kind)
        if before is not None:
            self.log(f"{name}: done before")
            return before
        self.log(f"{name} ...")
        with self._marked():
            result, files = work()
        self.done[name] = {
            "result": plain(result),
            "files": [str(file.relative_to(self.folder)) for file in files],
            "date": today(),
        }
        self._save()
        return result

    @contextmanager
    def _marked(self) -> Iterator[None]:
        """Within it the folder is known as ours; what fails before anything was finished or written leaves no mark."""
        if self.done:
            yield
            return
        new = not self.folder.exists()
        self._save()
        try:
            yield
        except BaseException:
            if [path.name for path in self.folder.iterdir()] == [STATE_FILE]:
                (self.folder / STATE_FILE).unlink()
                if new:
                    self.folder.rmdir()
            raise

    def recall(self, name: str, kind: type[Result]) -> Result | None:
        """Result of a stage that was finished before; None when it was not, or when a file of it is gone."""
        finished = self.done.get(name)
        if finished is None or not all((self.folder / file).is_file() for file in finished["files"]):
            return None
        return TypeAdapter(kind).validate_python(finished["result"])

    @property
    def date(self) -> str:
        """Day of the newest finished stage, ISO 8601; today where there is none."""
        return max((stage["date"] for stage in self.done.values()), default=today())

    def _save(self) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        state = {"key": self.key, "done": self.done}
        state["digest"] = result_key("state", STAGES_VERSION, json.dumps(state))
        write_text(self.folder / STATE_FILE, json.dumps(state, indent=1))


def _holds_something(folder: Path) -> bool:
    """Whether there is something in a place that we have not put there."""
    if not folder.is_dir():
        return folder.exists()
    return any(not PARTIAL.fullmatch(path.name) for path in folder.iterdir())


def today() -> str:
    """Today's date in UTC, ISO 8601; the environment's SOURCE_DATE_EPOCH, where it is set, says which day that is."""
    said = os.environ.get("SOURCE_DATE_EPOCH")
    now = datetime.now(UTC) if said is None else datetime.fromtimestamp(_epoch(said), UTC)
    return now.date().isoformat()


def _epoch(said: str) -> int:
    if not said.isdecimal():
        raise ValueError(f"SOURCE_DATE_EPOCH={said}: expected seconds since 1970, such as 1767225600")
    return int(said)


def counter(log: Log, what: str) -> Callable[[int, int], None]:
    """Progress, from counts done and to do, as a line of the log for every tenth, with the time that is left."""
    pace = Pace()

    def count(done: int, total: int) -> None:
        rest = pace.to_go(done, total)
        if done * TENTHS // total > (done - 1) * TENTHS // total:
            log(f"  {done} of {total} {what}{rest}")

    return count


def plain(result: Any) -> Any:
    """Plain data of a dataclass, for JSON."""
    return TypeAdapter(type(result)).dump_python(result)


def work_key(rig: Rig, settings: str = "") -> str:
    """Key of the rig, of its hull's files if it has some, of the settings, and of the versions of what is computed."""
    # A file's hull takes libraries that other rigs do not need.
    from cad.hulls.files.triangles import hull_files  # noqa: PLC0415

    versions = version("mirrorgaze"), *physics_versions()
    files = None if rig.file_hull is None else hull_files(rig.file_hull.file)
    # What is asked for changes no result, nor does what its owner calls it.
    numbers = rig.model_dump(mode="json", exclude={"requirements", "revision"})
    return result_key("stages", STAGES_VERSION, versions, numbers, files, settings)


def physics_versions() -> tuple[int, ...]:
    """Versions of all that stages take from the cache."""
    # Renderer and solids take seconds to import, and tables are written by programs that need neither.
    from cad.assembly.part_meshes import MESH_VERSION  # noqa: PLC0415
    from cad.checks.printing.slicer import SLICE_VERSION  # noqa: PLC0415
    from cad.hulls.hull_mesh_key import HULL_MESH_VERSION  # noqa: PLC0415
    from optics.water.radiative_transfer.field import RADIANCE_VERSION  # noqa: PLC0415
    from scenes.baking.ambient import LIGHT_VERSION  # noqa: PLC0415

    return RADIANCE_VERSION, HULL_MESH_VERSION, MESH_VERSION, SLICE_VERSION, LIGHT_VERSION
