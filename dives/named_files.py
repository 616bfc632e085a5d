"""The files that a dive names, paths and learned models: found beside it, part of what it is, copied to its record."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from dives.specification import DiveSpecification, PlacedThing
from dives.trajectories.motions import FromFile, TravelFromFile
from rigs.section import Section

SomeDive = TypeVar("SomeDive", bound=DiveSpecification)
Thing = TypeVar("Thing", bound=PlacedThing)


def path_files(dive: DiveSpecification) -> dict[str, str]:
    """Files of robot, target and decoys, by whose path they are: ``robot``, ``target``, ``decoys[0]``."""
    moving: dict[str, Section | None] = {"robot": dive.robot, "target": dive.target.path}
    moving |= {f"decoys[{number}]": decoy.path for number, decoy in enumerate(dive.decoys)}
    return {whose: motion.file for whose, motion in moving.items() if isinstance(motion, FromFile | TravelFromFile)}


def named_files(dive: DiveSpecification) -> dict[str, str]:
    """Files of paths, and of the models of ``detector`` and ``offline_detector``, by what they are of."""
    detectors = {"detector": dive.detector, "offline_detector": dive.offline_detector}
    models = {name: each.onnx for name, each in detectors.items() if each is not None and each.onnx is not None}
    return path_files(dive) | models


def with_named_files(dive: SomeDive, name: Callable[[str, str], str]) -> SomeDive:
    """The dive with other names of its files: of what each is and its name until now."""
    files = {whose: name(whose, file) for whose, file in named_files(dive).items()}
    changes: dict[str, object] = {
        whose: getattr(dive, whose).model_copy(update={"onnx": files[whose]})
        for whose in ("detector", "offline_detector")
        if whose in files
    }
    if "robot" in files:
        changes["robot"] = dive.robot.model_copy(update={"file": files["robot"]})
    changes["target"] = _with_file(dive.target, files.get("target"))
    changes["decoys"] = tuple(
        _with_file(decoy, files.get(f"decoys[{number}]")) for number, decoy in enumerate(dive.decoys)
    )
    return dive.model_copy(update=changes)


def _with_file(thing: Thing, file: str | None) -> Thing:
    """It with another file of its path; as it is without one."""
    if thing.path is None or file is None:
        return thing
    return thing.model_copy(update={"path": thing.path.model_copy(update={"file": file})})


def digests(dive: DiveSpecification) -> dict[str, str]:
    """SHA-256 of each of these files' content, by what it is of."""
    return {whose: hashlib.sha256(Path(file).read_bytes()).hexdigest() for whose, file in named_files(dive).items()}


def copied_files(dive: SomeDive, folder: Path) -> SomeDive:
    """Copy the files into a folder, as ``robot.csv``, ``detector.onnx`` and so on; the dive that names the copies."""

    def copied(whose: str, file: str) -> str:
        name = f"{whose.replace('[', '_').rstrip(']')}{'.onnx' if whose.endswith('detector') else '.csv'}"
        if Path(file).resolve() != (folder / name).resolve():
            shutil.copyfile(file, folder / name)
        return name

    return with_named_files(dive, copied)
