"""Dive the members of an ensemble, each in its own folder; what is finished stays finished."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import tomlkit

from dives.dive import Dive, find_dive, parse_dive, varied
from dives.ensembles.members import Member, folder_name
from dives.files import is_finished
from dives.known_target import with_known_target
from dives.metrics import dive_metrics
from dives.metrics.verdict import dive_verdict
from dives.runner import identity_of, run_dive
from optics.workers.run import Failure, all_ended, counted, run_many
from optics.workers.shards import Manifest, Shard
from rigs import Rig
from scenes.baking.light_quality import LightQuality, light_marks
from tracking.log import read_log

Work = Callable[[str, str], None]
"""Takes the text of a dive file and a folder, dives there, and goes on where an earlier dive stopped."""


RIGS = "rigs"
"""Folder of the rigs that members change."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What became of a member.

    Attributes
    ----------
    member : Member
    folder : Path
        Of its dive.
    metrics : dict, optional
        As `dives.metrics.dive_metrics` names them, after `passed` and `verdict` (`dives.metrics.verdict`); None for a
        dive that could not be made.
    failure : Failure, optional
    """

    member: Member
    folder: Path
    metrics: dict[str, Any] | None
    failure: Failure | None


def run_ensemble(
    dive: str | Path,
    members: Sequence[Member],
    folder: Path,
    *,
    workers: int,
    scheduler: str | None = None,
    shard: Shard | None = None,
    log: Callable[[str], None],
    video: bool = True,
    quality: LightQuality | None = None,
    work: Work | None = None,
) -> list[Outcome]:
    """Dive every member that is not finished; members that fail do not keep the others.

    Parameters
    ----------
    dive : str or Path
        Preset, or dive file.
    members : sequence of Member
    folder : Path
        Each member's dive is written to a folder of its name in it. New members may join those of an earlier run.
    workers : int
        Dives at a time, in processes of this machine.
    scheduler : str, optional
        Address of a dask cluster that dives instead; `folder` is then one that its workers share.
    shard : Shard, optional
        Dive this part of the members alone, and write a manifest of it.
    log : callable
        Takes a line for each dive that ends.
    video : bool
        Whether the dives write their videos; without, only what the loop looks at is rendered.
    quality : LightQuality, optional
        Of the light in the images, full by default.
    work : callable, optional
        Dives; `dive_into` when none is given. Of a module's top level: other processes import it.

    Returns
    -------
    list of Outcome
        In the order of `members`; of the shard alone, where one is given.

    Raises
    ------
    ValueError
        Before anything is dived: with every member that is no possible dive, or whose folder holds another dive.
    """
    total = len(members)
    members = members if shard is None else shard.part(members)
    dives = with_rigs(planned(dive, members), members, folder / RIGS)
    dives = {name: varied(each, video=video) for name, each in dives.items()}
    folders = {member.name: folder / member.name for member in members}
    left = unfinished(dives, folders, quality)
    # Workers of other machines are in another folder.
    waiting = {name: (dives[name].as_toml(), str(path.absolute())) for name, path in left.items()}
    told = [counted(log, len(members) - len(waiting), len(members), "dives")]
    if shard is not None:
        told.append(Manifest(folder, shard, total=total, done={name: name not in waiting for name in folders}).ended)
    work = work or partial(dive_into, quality=quality)
    failures = all_ended(run_many(work, waiting, workers=workers, scheduler=scheduler), *told)
    return [
        Outcome(
            member=member,
            folder=folders[member.name],
            metrics=None if member.name in failures else _judged(dives[member.name], folders[member.name], quality),
            failure=failures.get(member.name),
        )
        for member in members
    ]


def _judged(dive: Dive, folder: Path, quality: LightQuality | None) -> dict[str, Any]:
    """Metrics of a finished dive, after what it is judged to be."""
    metrics = dive_metrics(read_log(folder))
    verdict = dive_verdict(metrics, dive.limits, dive.load_rig())
    return {"passed": verdict.passed, "verdict": verdict.line, **metrics, **light_marks(quality)}


def planned(dive: str | Path, members: Sequence[Member]) -> dict[str, Dive]:
    """Dive of each member, by the member's name.

    Raises
    ------
    ValueError
        With every problem of every member, each said once.
    """
    path = find_dive(dive)
    base = Dive.load(dive)
    document = tomllib.loads(path.read_text(encoding="utf-8"))
    dives: dict[str, Dive] = {}
    problems: dict[str, None] = {}
    for member in members:
        try:
            text = tomlkit.dumps(member.document(document))
            dives[member.name] = parse_dive(text, source=f"{base.name} with {member.name}", folder=path.parent)
        except ValueError as error:
            problems[str(error)] = None
    if problems:
        raise ValueError("\n".join(problems))
    return dives


def with_rigs(dives: dict[str, Dive], members: Sequence[Member], folder: Path) -> dict[str, Dive]:
    """Dives whose members change the rig, with the files of such rigs, which are written into a folder.

    Raises
    ------
    ValueError
        Before anything is written: with every problem of every rig, each said once.
    """
    rigs: dict[str, Rig] = {}
    problems: dict[str, None] = {}
    for member in members:
        if member.rig_settings:
            changes = {key.replace(".", "__"): value for key, value in member.rig_settings.items()}
            try:
                rigs[member.name] = Rig.load(dives[member.name].rig).with_(**changes)
            except ValueError as error:
                problems[str(error)] = None
    if problems:
        raise ValueError("\n".join(problems))
    changed = dict(dives)
    for member in members:
        if member.name in rigs:
            folder.mkdir(parents=True, exist_ok=True)
            file = rigs[member.name].save(folder.absolute() / f"{folder_name(member.rig_settings)}.toml")
            changed[member.name] = dives[member.name].model_copy(update={"rig": str(file)})
    return changed


def unfinished(
    dives: dict[str, Dive], folders: dict[str, Path], quality: LightQuality | None = None
) -> dict[str, Path]:
    """Folders of the dives that are still to be made or finished, by name.

    Raises
    ------
    ValueError
        With every folder that holds another dive.
    """
    left: dict[str, Path] = {}
    problems = []
    for name, dive in dives.items():
        try:
            rig = dive.load_rig()
            if not is_finished(folders[name], identity_of(with_known_target(dive, rig), rig, quality)):
                left[name] = folders[name]
        except ValueError as error:
            problems.append(str(error))
    if problems:
        raise ValueError("\n".join(problems))
    return left


def dive_into(text: str, folder: str, *, quality: LightQuality | None = None) -> None:
    """Dive what a text says, into a folder."""
    run_dive(parse_dive(text, source=folder, folder=Path(folder).parent), folder, quality=quality)
