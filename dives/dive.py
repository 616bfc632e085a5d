"""A dive: read from its file and checked as a whole, with every problem at once."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit

from dives.checks import dive_problems
from dives.named_files import with_named_files
from dives.specification import DiveSpecification
from rigs.documents.changes import with_values
from rigs.documents.presets import Presets
from rigs.documents.problems import Problem, SpecificationError
from rigs.documents.toml import file_beside, parse_toml, read_toml
from rigs.documents.validation import validated
from tracking.loop.ablations import LOOPS

PRESETS = Path(__file__).parent / "presets"
DIVES = Presets("dive", PRESETS)

HARMLESS = {
    "name": "dive",
    "rig": "aqua2",
    "depth_m": 10.0,
    "duration_s": 60.0,
    "robot": {"motion": "hover"},
    "target": {"path": {"shape": "straight", "start_m": [2.0, 0.0, 0.0], "velocity_m_per_s": [0.0, 0.0, 0.0]}},
}
"""Stand-ins for required values that are wrong."""


class DiveError(SpecificationError):
    """A dive that cannot be made."""


class Dive(DiveSpecification):
    """A dive in simulation: what its file says (`DiveSpecification`), with what the file names known to be there."""

    @classmethod
    def load(cls, name_or_path: str | Path) -> Dive:
        """Read a preset by name or a TOML file by path; a relative rig, world or target file is taken from its folder.

        Raises
        ------
        DiveError
            With every problem of the file, its rig and its paths at once.
        FileNotFoundError
            When there is neither such a preset nor such a file.
        """
        return loaded_with(name_or_path, {})


def loaded_with(name_or_path: str | Path, settings: Mapping[str, Any]) -> Dive:
    """As `Dive.load`, with other values of some keys (dotted, such as ``target.start.azimuth_deg``)."""
    path = find_dive(name_or_path)
    source = str(name_or_path)
    text = read_toml(path, source=source, error=DiveError)
    if settings:
        text = tomlkit.dumps(with_values(parse_toml(text, source=source, error=DiveError), settings))
    return parse_dive(text, source=source, folder=path.parent)


def varied(
    dive: Dive,
    *,
    variant: str | None = None,
    frames: int | None = None,
    video: bool = True,
    functional_check: bool = True,
) -> Dive:
    """A dive with another variant of the loop, cut after a number of frames, or without videos or functional check.

    `ValueError` for an unknown variant.
    """
    if variant is not None and variant not in LOOPS:
        raise ValueError(f"variant {variant!r}: expected one of {', '.join(sorted(LOOPS))}")
    changes = {
        **({} if variant is None else {"variant": variant}),
        **({} if frames is None else {"duration_s": min(dive.duration_s, frames / dive.frame_rate_hz)}),
        **({} if functional_check else {"functional_check": False}),
        **({} if video else {"video": "none", "overlay": False}),
    }
    return dive.model_copy(update=changes)


def preset_names() -> list[str]:
    """Names of the dives that come with the package, in alphabetical order."""
    return DIVES.names()


def find_dive(name_or_path: str | Path) -> Path:
    """File of a dive given by preset name or by path; raises `FileNotFoundError` when there is none."""
    return DIVES.find(name_or_path)


def parse_dive(text: str, *, source: str, folder: Path) -> Dive:
    """Validate the text of a dive file; see `Dive.load`."""
    document = parse_toml(text, source=source, error=DiveError)
    dive, problems = validated(Dive, document)
    wrong = {_section(problem) for problem in problems}
    # Beside what is wrong with single values, a user reads what else is wrong: with harmless values in their place.
    whole = (
        dive
        or validated(
            Dive,
            {key: value for key, value in document.items() if key not in wrong}
            | {key: value for key, value in HARMLESS.items() if key in wrong},
        )[0]
    )
    if whole is not None:
        whole = _with_own_files(whole, folder)
        problems += [problem for problem in dive_problems(whole) if _section(problem) not in wrong]
    if whole is None or problems:
        raise DiveError(source, problems)
    return whole


def _section(problem: Problem) -> str:
    """Top-level key of a problem's place."""
    return problem.place.partition(".")[0].partition("[")[0]


def _with_own_files(dive: Dive, folder: Path) -> Dive:
    """The dive with files that lie beside it by their whole paths."""
    target = dive.target.model_copy(update={"shape": file_beside(dive.target.shape, folder)})
    decoys = tuple(decoy.model_copy(update={"shape": file_beside(decoy.shape, folder)}) for decoy in dive.decoys)
    own = {
        "rig": file_beside(dive.rig, folder),
        "world": file_beside(dive.world, folder),
        "target": target,
        "decoys": decoys,
    }
    return with_named_files(dive.model_copy(update=own), lambda _, file: file_beside(file, folder))
