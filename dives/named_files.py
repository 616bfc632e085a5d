"""The files of paths that a dive names: found beside it, part of what it is, and copied to where it is recorded."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from dives.specification import DiveSpecification
from dives.trajectories.motions import FromFile, TravelFromFile
from rigs.section import Section

SomeDive = TypeVar("SomeDive", bound=DiveSpecification)


def path_files(dive: DiveSpecification) -> dict[str, str]:
    """Files of robot, target and decoys, by whose path they are: ``robot``, ``target``, ``decoys[0]``."""
    moving: dict[str, Section | None] = {"robot": dive.robot, "target": dive.target.path}
    moving |= {f"decoys[{number}]": decoy.path for number, decoy in enumerate(dive.decoys)}
    return {whose: motion.file for whose, motion in moving.items() if isinstance(motion, FromFile | TravelFromFile)}


def with_path_files(dive: SomeDive, name: Callable[[str, str], str]) -> SomeDive:
    """The dive with other names of its paths' files: of whose path it is and the name until now."""
    files = {whose: name(whose, file) for whose, file in path_files(dive).items()}
    changes: dict[str, object] = {}
    if "robot" in files:
        changes["robot"] = dive.robot.model_copy(update={"file": files["robot"]})
    if "target" in files:
        path = dive.target.path.model_copy(update={"file": files["target"]})
        changes["target"] = dive.target.model_copy(update={"path": path})
    changes["decoys"] = tuple(
        decoy.model_copy(update={"path": decoy.path.model_copy(update={"file": files[f"decoys[{number}]"]})})
        if decoy.path is not None and f"decoys[{number}]" in files
        else decoy
        for number, decoy in enumerate(dive.decoys)
    )
    return dive.model_copy(update=changes)


def digests(dive: DiveSpecification) -> dict[str, str]:
    """SHA-256 of each of these files' content, by whose path it is."""
    return {whose: hashlib.sha256(Path(file).read_bytes()).hexdigest() for whose, file in path_files(dive).items()}


def copied_path_files(dive: SomeDive, folder: Path) -> SomeDive:
    """Copy the files into a folder, as ``robot.csv`` and so on, and return the dive that names the copies."""

    def copied(whose: str, file: str) -> str:
        name = f"{whose.replace('[', '_').rstrip(']')}.csv"
        if Path(file).resolve() != (folder / name).resolve():
            shutil.copyfile(file, folder / name)
        return name

    return with_path_files(dive, copied)
