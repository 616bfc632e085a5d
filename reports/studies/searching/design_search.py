"""A design search in a folder: the front, some of its members as rig files that can be built, a figure and a summary.

Scored batches and mounts that were looked at are remembered, so that an interrupted search goes on where it stopped.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from cad.assembly.assembly import build_assembly
from cad.assembly.hull_surface import hull_surface
from cad.assembly.meshes import rig_meshes
from cad.checks.assembly_checks import assembly_problems
from cad.checks.rig_problems import rig_problems
from cad.hulls.mesh_repair import Faces, manifold
from cad.parts.clearance_envelope import envelope_margins_mm, with_standing_base
from optics.coverage.field import pixels_per_degree
from optics.kernels.arrays import FloatArray
from optics.kernels.clock import Pace
from optics.mesh import PartMesh
from optics.search.choice import choose
from optics.search.limits import BINDING_MM, binding, bounds_around, first_problem
from optics.search.objectives import PARAMETERS, objectives_named, rig_with
from optics.search.score import CoarseScorer, Grid
from optics.search.search import GRID, Recorded, Search, all_scores, feasible_scores, search_designs
from optics.train import OpticalTrain
from optics.workers.run import Workers
from reports.figures.search import draw_front, front_rows, write_front
from reports.progress import Log, Stages
from reports.studies.searching.search_results import SearchedDesign, SearchResults
from rigs import Rig, RigError, load_document, save_document
from rigs.atomic_files import write_text

NAMES = tuple(".".join(parameter) for parameter in PARAMETERS)

MIDDLE = 31
"""Cells along each side of the image: odd, so that one is in the middle."""

CHUNK = 64
"""Designs that a worker scores at a time: half a second or so."""

ROUNDING_MM = 0.1
"""As in the checks on solids: twice the tolerance of their triangles."""


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """What to search for; `count` members of the front become rig files."""

    objectives: tuple[str, ...]
    designs: int = 10_000
    seed: int = 0
    factor: float = 1.5
    count: int = 12

    def __post_init__(self) -> None:
        objectives_named(self.objectives)
        if self.designs < 1 or self.seed < 0 or self.count < 1:
            raise ValueError(
                f"expected designs > 0, seed >= 0 and count > 0, got {self.designs}, {self.seed} and {self.count}"
            )

    def __str__(self) -> str:
        return f"{','.join(self.objectives)}; {self.designs} designs, seed {self.seed}, factor {self.factor:g}"


@dataclass(frozen=True, kw_only=True)
class ScoredDesigns:
    """Designs that were looked at, and their scores."""

    designs: list[list[float]]
    scores: list[list[float]]


def search_into(
    rig: Rig, source: Path, folder: Path, wanted: Wanted, *, workers: Workers | None = None, log: Log
) -> SearchResults:
    """Search, and write what was found.

    Parameters
    ----------
    rig : Rig
        With mirrors, physically possible.
    source : Path
        Its file, whose comments the new rig files keep.
    folder : Path
        New, empty, or that of an earlier search, which goes on.
    wanted : Wanted
    workers : Workers, optional
        Score designs and build mounts, many at a time (`optics.workers.run.open_workers`); this process when none are
        given. The files are the same.
    log : callable
        Takes lines of progress.

    Returns
    -------
    SearchResults
        What `summary.json` holds.

    Raises
    ------
    ValueError
        For a rig without mirrors, or when nothing is possible within the bounds.
    FileExistsError
        When the folder holds something else.
    """
    bounds_around(rig, wanted.factor)
    stages = Stages.open(folder, rig, log, settings=str(wanted))

    pace, looked_at = Pace(), 0

    def checkpoint(name: str, work: Callable[[], Recorded]) -> Recorded:
        nonlocal looked_at

        def run() -> tuple[ScoredDesigns, list[Path]]:
            designs, scores = work()
            done = looked_at + len(designs)
            log(f"  {done} of {max(done, wanted.designs)} designs{pace.to_go(done, wanted.designs)}")
            return ScoredDesigns(designs=designs.tolist(), scores=scores.tolist()), []

        found = stages.run(name, ScoredDesigns, run)
        looked_at += len(found.designs)
        return (
            np.array(found.designs).reshape(-1, len(PARAMETERS)),
            np.array(found.scores).reshape(-1, len(wanted.objectives)),
        )

    def problems_of(designs: list[FloatArray]) -> list[str]:
        mounts = {"mounts: " + " x ".join(f"{value:g}" for value in design) + " mm": design for design in designs}

        def look(name: str, work: Callable[[], str]) -> str:
            return stages.run(name, str, lambda: (work(), []))

        if workers is not None:
            unknown = {name: (rig, design) for name, design in mounts.items() if name not in stages.done}
            for ended in workers.run(_problem, unknown):
                said = ended.value if ended.failure is None else ended.failure.sentence
                look(ended.name, partial(str, said))
        return [look(name, partial(_problem, rig, design)) for name, design in mounts.items()]

    parts, hull = rig_meshes(rig), _solid(rig)
    search = search_designs(
        rig,
        parts,
        wanted.objectives,
        designs=wanted.designs,
        seed=wanted.seed,
        factor=wanted.factor,
        buildable=_buildable(hull),
        checkpoint=checkpoint,
        score=None if workers is None else partial(_scores_by, workers, rig, wanted.objectives),
    )

    def held(design: FloatArray) -> list[str]:
        margins = envelope_margins_mm(rig_with(rig, design), hull).items()
        return binding(rig, design, search.low, search.high) + [name for name, margin in margins if margin < BINDING_MM]

    def described(row: int) -> SearchedDesign:
        design = search.designs[row]
        scores = [None if np.isnan(value) else float(value) for value in search.scores[row]]
        return SearchedDesign(
            design_mm=dict(zip(NAMES, design.tolist(), strict=True)),
            base_anchor_mm=list(_base_anchor_mm(rig, design)),
            scores=dict(zip((objective.name for objective in search.objectives), scores, strict=True)),
            binding=held(design),
        )

    chosen, problems = choose(search, wanted.count, problems_of)
    rows = np.array([0, *chosen])
    figures = stages.run(
        "figures", dict[str, list[float | None]], lambda: (_figures(rig, parts, search.designs[rows]), [])
    )
    figures_of = {row: {name: column[k] for name, column in figures.items()} for k, row in enumerate(rows.tolist())}
    files = _write_rigs(rig, source, folder / "rigs", search, chosen)
    log("front.csv, search.png, summary.json ...")
    names = {row: f"rigs/{file.name}" for row, file in files.items()}
    write_front(front_rows(search, lambda design: _base_anchor_mm(rig, design), held, names), folder / "front.csv")
    draw_front(search, chosen, folder / "search.png")
    results = SearchResults(
        rig=rig.name,
        objectives=search.objectives,
        designs=len(search.designs),
        seed=wanted.seed,
        bounds_mm={
            name: [float(low), float(high)] for name, low, high in zip(NAMES, search.low, search.high, strict=True)
        },
        possible=int(np.isfinite(search.scores).all(axis=1).sum()),
        rejected=search.rejected,
        front=len(search.front),
        pixels_per_degree=_pixels_per_degree(rig),
        own=replace(described(0), figures=figures_of[0]),
        chosen=[replace(described(row), file=names[row], figures=figures_of[row]) for row in chosen],
        thrown_out=[replace(described(row), problem=problem) for row, problem in problems.items()],
    )
    write_text(folder / "summary.json", json.dumps(results.as_dict(), indent=2))
    return results


@lru_cache(maxsize=1)
def _triangles(rig: Rig) -> tuple[FloatArray, Faces]:
    """Vertices and faces of the hull, copied: what they come from goes."""
    surface = hull_surface(rig)
    return np.array(surface.vertices), np.array(surface.faces, dtype=np.int64)


def _solid(rig: Rig) -> Any:
    """The hull as a body; not kept for good, since manifold3d complains at length of what is there at the end."""
    body = manifold(*_triangles(rig))
    assert body is not None
    return body


def _buildable(hull: Any) -> Callable[[Rig], str]:
    """The condition that a design's clearance envelope violates beside a hull; empty when it violates none."""

    def violated_condition(made: Rig) -> str:
        return next((name for name, margin in envelope_margins_mm(made, hull).items() if margin < -ROUNDING_MM), "")

    return violated_condition


def _scores_by(workers: Workers, rig: Rig, objectives: tuple[str, ...], designs: FloatArray) -> FloatArray:
    """Scores of designs, shape (n, k), a chunk by each worker at a time."""
    chunks = {
        str(first): (rig, GRID, objectives, designs[first : first + CHUNK]) for first in range(0, len(designs), CHUNK)
    }
    scores = {ended.name: ended.result() for ended in workers.run(_scores, chunks)}
    return np.concatenate([np.empty((0, len(objectives))), *(scores[name] for name in chunks)])


def _scores(rig: Rig, grid: Grid, objectives: tuple[str, ...], designs: FloatArray) -> FloatArray:
    """What a worker does: scores as the search has them."""
    return feasible_scores(rig, _scorer(rig, grid), objectives_named(objectives), _buildable(_solid(rig)), designs)


@lru_cache(maxsize=1)
def _scorer(rig: Rig, grid: Grid) -> CoarseScorer:
    return CoarseScorer(rig, rig_meshes(rig), grid)


def _with_mount(rig: Rig, design: FloatArray) -> Rig:
    """The rig of a design, the base's anchor moved along the hull where the design needs that."""
    return with_standing_base(rig_with(rig, design))


def _base_anchor_mm(rig: Rig, design: FloatArray) -> tuple[float, float, float]:
    return _with_mount(rig, design).require_gaze().mount.base_anchor_mm


def _problem(rig: Rig, design: FloatArray) -> str:
    """First thing wrong with a design, its mount built and moved over the joint range; empty when nothing is."""
    first = first_problem(rig, design)
    if first:
        return first
    try:
        problems = assembly_problems(build_assembly(_with_mount(rig, design)))
    except ValueError as error:
        return str(error)
    return str(problems[0]) if problems else ""


def _write_rigs(rig: Rig, source: Path, folder: Path, search: Search, chosen: Sequence[int]) -> dict[int, Path]:
    """Rig files of chosen members, copies of the source with their comments; what an earlier search left goes."""
    folder.mkdir(parents=True, exist_ok=True)
    files = {row: folder / f"{rig.name}-{number:02d}.toml" for number, row in enumerate(chosen, start=1)}
    for old in set(folder.glob(f"{rig.name}-*.toml")) - set(files.values()):
        old.unlink()
    for row, file in files.items():
        document = load_document(source)
        document["name"] = file.stem
        if rig.file_hull is not None:
            # A name relative to the source would not be found from here.
            document["hull"]["file"] = str(rig.file_hull.file)
        design = search.designs[row]
        _put_design(document, dict(zip(NAMES, design.tolist(), strict=True)), _base_anchor_mm(rig, design))
        save_document(document, file)
    return files


def _figures(rig: Rig, parts: Sequence[PartMesh], designs: FloatArray) -> dict[str, list[float | None]]:
    """Scores of designs by every objective there is, whichever were searched by; None for designs that show nothing."""
    scores = all_scores(rig, parts, designs)
    return {name: [None if np.isnan(value) else float(value) for value in column] for name, column in scores.items()}


def _pixels_per_degree(rig: Rig) -> float:
    """Resolution in the water in the middle of the image; flat mirrors keep it, whatever the design."""
    train = OpticalTrain.bare(rig)
    return float(pixels_per_degree(train.camera, train.port, MIDDLE, MIDDLE)[MIDDLE**2 // 2])


def apply_design(results: SearchResults, number: int, file: Path) -> None:
    """Write a design of a search into a rig file, comments kept, once the result is known to be a good rig.

    Parameters
    ----------
    results : SearchResults
        What `search_into` returned.
    number : int
        Of the design among the chosen, from 1.
    file : Path
        The rig file.

    Raises
    ------
    ValueError
        When there is no such design.
    RigError
        When the rig with these numbers is impossible; nothing is written then.
    """
    chosen = results.chosen
    if not 1 <= number <= len(chosen):
        raise ValueError(f"expected the number of a design, 1 to {len(chosen)}, got {number}")
    design = chosen[number - 1]
    document = load_document(file)
    _put_design(document, design.design_mm, design.base_anchor_mm)
    changed = Rig.parse(tomlkit.dumps(document), source=str(file), folder=file.parent)
    problems = rig_problems(changed)
    if problems:
        raise RigError(str(file), problems)
    save_document(document, file)


def _put_design(document: tomlkit.TOMLDocument, numbers: Mapping[str, float], base_anchor_mm: Sequence[float]) -> None:
    """Change a rig file's numbers to those of a design."""
    for name, value in numbers.items():
        section, _, key = name.partition(".")
        document[section][key] = value
    document["mount"]["base_anchor_mm"] = list(base_anchor_mm)
