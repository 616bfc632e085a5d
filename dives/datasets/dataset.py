"""A data set's file, read and checked as a whole, with every problem at once."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, cast, get_args

from cad.export.drawings.manifest import rig_hash
from dives.checks import check_world, collecting
from dives.datasets.grid import Grid
from dives.datasets.specification import DatasetSpecification
from dives.specification import DiveThing
from rigs import JerlovType, Rig
from rigs.documents.problems import Problem, SpecificationError
from rigs.documents.toml import file_beside, parse_toml, parsed, read_toml
from rigs.documents.validation import validated
from rigs.files import find_rig
from rigs.water import Water
from scenes.baking.light_quality import LightQuality, light_identity
from scenes.stage.targets import Ball

OF_THE_SET = frozenset({"samples", "formats", "boxes", "description", "licence"})
"""Keys that say nothing about a single sample."""


RECORD_VERSION = 3
"""Raised when records hold something else: a folder that was begun before is then refused, not mixed."""


class DatasetError(SpecificationError):
    """A data set that cannot be made."""


@dataclass(frozen=True, kw_only=True)
class Dataset:
    """A data set: what its file says, and the rigs that it names.

    Attributes
    ----------
    spec : DatasetSpecification
        Files by their whole paths.
    rigs : dict of str to Rig
        By the names in the file.
    text : str
        The file.
    folder : Path
        From which it names files.
    quality : LightQuality, optional
        Of the light in its images, full by default.
    """

    spec: DatasetSpecification
    rigs: dict[str, Rig]
    text: str
    folder: Path
    quality: LightQuality | None = None

    @classmethod
    def load(cls, path: str | Path, *, quality: LightQuality | None = None) -> Dataset:
        """Read a data set's file; files that it names are taken from its folder.

        Raises
        ------
        DatasetError
            With every problem of the file, and of the rigs, worlds, targets and waters that it names.
        FileNotFoundError
            When there is no such file.
        """
        text = read_toml(Path(path), source=str(path), error=DatasetError)
        return parse_dataset(text, source=str(path), folder=Path(path).parent, quality=quality)

    @cached_property
    def grid(self) -> Grid:
        """All combinations of what the file lists."""
        return Grid.of(self.spec)

    @cached_property
    def identity(self) -> str:
        """Digest of what a sample comes from, but for its number and the code."""
        document = {key: value for key, value in parsed(self.text).items() if key not in OF_THE_SET}
        rigs = {name: rig_hash(rig) for name, rig in self.rigs.items()}
        waters = {name: Path(name).read_text(encoding="utf-8") for name in water_files(self.spec)}
        numbers = [RECORD_VERSION, document, rigs, list(waters.values()), *light_identity(self.quality)]
        return hashlib.sha256(json.dumps(numbers, default=str).encode()).hexdigest()


def parse_dataset(text: str, *, source: str, folder: Path, quality: LightQuality | None = None) -> Dataset:
    """Validate the text of a data set's file; see `Dataset.load`."""
    document = parse_toml(text, source=source, error=DatasetError)
    spec, problems = validated(DatasetSpecification, document)
    if spec is None:
        raise DatasetError(source, problems)
    spec = _located(spec, folder)
    rigs: dict[str, Rig] = {}
    for place, name in _places("scene.rig", spec.scene.rig):
        with collecting(problems, place, name):
            rigs[name] = Rig.load(find_rig(name))
    problems += _problems(spec, rigs)
    if problems:
        raise DatasetError(source, problems)
    return Dataset(spec=spec, rigs=rigs, text=text, folder=folder, quality=quality)


def water_of(rig: Rig, water: str | None) -> Water:
    """Water of a scene: the rig's, of a Jerlov type, or from a file; `ValueError` for what is neither."""
    if water is None:
        return rig.water
    if water.lower().endswith(".csv"):
        if not Path(water).is_file():
            raise ValueError("expected a file that is there")
        kept = rig.water.model_dump(exclude={"jerlov_type", "source", "iop_file"})
        return Water.model_validate(kept | {"iop_file": Path(water)})
    if water not in get_args(JerlovType):
        raise ValueError(f"expected a Jerlov type ({', '.join(get_args(JerlovType))}) or a CSV file")
    return rig.water.of_type(cast(JerlovType, water))


def water_files(spec: DatasetSpecification) -> list[str]:
    """Files of absorption and scattering that a data set names."""
    return [name for name in spec.scene.water or () if name.lower().endswith(".csv")]


def _located(spec: DatasetSpecification, folder: Path) -> DatasetSpecification:
    """The same with files that lie beside it by their whole paths."""

    def all_whole(names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(file_beside(name, folder) for name in names)

    scene, target = spec.scene, spec.target
    own = {
        "rig": all_whole(scene.rig),
        "world": all_whole(scene.world),
        "water": scene.water and all_whole(scene.water),
    }
    return spec.model_copy(
        update={
            "scene": scene.model_copy(update=own),
            "target": target.model_copy(update={"shape": all_whole(target.shape)}),
            "decoys": tuple(each.model_copy(update={"shape": file_beside(each.shape, folder)}) for each in spec.decoys),
        }
    )


def _problems(spec: DatasetSpecification, rigs: dict[str, Rig]) -> list[Problem]:
    """What single values do not show."""
    problems: list[Problem] = []
    for place, name in _places("scene.world", spec.scene.world):
        with collecting(problems, place, name):
            check_world(name)
    for place, name in _places("scene.water", spec.scene.water or ()):
        for rig in rigs.values():
            with collecting(problems, place, name):
                water_of(rig, name)
    balls = []
    for place, name in _places("target.shape", spec.target.shape):
        with collecting(problems, place, name):
            balls.append(isinstance(DiveThing(shape=name).load_shape(), Ball))
    if not all(balls) and (spec.target.colour is not None or spec.target.diameter_m is not None):
        expected = "no colour and diameter_m in [target], since one of its shapes is no ball"
        problems.append(Problem(place="target.shape", value=None, expected=expected))
    if "bop" in spec.formats and spec.target.diameter_m is not None and spec.target.diameter_m.all_values() is None:
        expected = "a number, a list or a table of values: an object of the format bop has one size"
        problems.append(Problem(place="target.diameter_m", value=spec.target.diameter_m.document(), expected=expected))
    for number, decoy in enumerate(spec.decoys):
        with collecting(problems, f"decoys[{number}].shape", decoy.shape):
            DiveThing(shape=decoy.shape, diameter_m=decoy.diameter_m, colour=decoy.colour).load_shape()
    problems += [problem for rig in rigs.values() for problem in _joint_problems(spec, rig)]
    with collecting(problems, "(whole file)", None):
        Grid.of(spec)
    return problems


def _joint_problems(spec: DatasetSpecification, rig: Rig) -> Iterator[Problem]:
    """Joint values that a rig does not reach."""
    for key, draws in (("q1_deg", spec.joints.q1_deg), ("q2_deg", spec.joints.q2_deg)):
        if draws is None or rig.gaze is None:
            continue
        joint = rig.gaze.joints.pan if key == "q1_deg" else rig.gaze.joints.tilt
        low, high = draws.ends()
        if not joint.min_deg <= low <= high <= joint.max_deg:
            expected = f"angles from {joint.min_deg:g} to {joint.max_deg:g}, which the rig {rig.name!r} reaches"
            yield Problem(place=f"joints.{key}", value=f"{low:g}..{high:g}", expected=expected)


def _places(key: str, values: tuple[Any, ...]) -> list[tuple[str, Any]]:
    """Values of an axis, each with its place in the file."""
    return [(key if len(values) == 1 else f"{key}[{number}]", value) for number, value in enumerate(values)]
