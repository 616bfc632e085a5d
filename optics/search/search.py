"""Design search: the Pareto front over both mirrors' distances and sizes.

Sobol points fill the space of designs, then generations of children gather around the front (differential steps between
its members), then each member is polished along the gradient of its resolution. Whatever is scored stays in the pool,
and the front is that of the whole pool. Every random number comes from the seed and the number of the batch, every
batch from those before it: a search that is stopped and taken up again ends at the same front.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from optics.kernels.arrays import FloatArray
from optics.mesh import PartMesh
from optics.search.limits import CONSTRAINTS, bounds_around, rooms_mm, violated
from optics.search.objectives import (
    M1_HEIGHT,
    M1_WIDTH,
    M2_HEIGHT,
    M2_WIDTH,
    OBJECTIVES,
    Objective,
    costs,
    design_of,
    front,
    objectives_named,
    rig_with,
    rounded,
    spread_out,
)
from optics.search.score import CoarseScorer, Grid
from rigs import Rig

GRID = Grid()
"""Poses and rays by which a design is scored."""

DERIVATIVE_GRID = Grid(pan_steps=9, tilt_steps=17, columns=16, rows=12)
"""And by which derivatives are taken: soft edges need fewer rays, and differentiated lanes cost ten times as much."""

BATCH = 512
"""Designs that are scored between two checkpoints; some seconds."""

SOBOL_SHARE = 0.5
"""Of the designs, how many fill the space before the others gather around the front."""

STEP_SHARE = 0.05
"""Standard deviation of a child's random step, of the range of each number."""

POLISHED = 40
"""Members of the front that are polished."""

POLISH_STEPS_MM = (4.0, 2.0, 1.0, 0.5)
"""Lengths of the steps along the gradient, tried one after the other."""

NOTHING_SEEN = "nothing seen over both mirrors"

Recorded = tuple[FloatArray, FloatArray]
"""Designs, shape (n, 6), and their scores, shape (n, k): NaN where a constraint is violated."""

Bounds = tuple[FloatArray, FloatArray]
"""Smallest and largest values of the free numbers, shape (6,) each."""

Score = Callable[[FloatArray], FloatArray]

Checkpoint = Callable[[str, Callable[[], Recorded]], Recorded]
"""Takes a batch's name and what computes it; returns its result, computed or remembered."""


@dataclass(frozen=True, kw_only=True)
class Search:
    """Result of `search_designs`.

    Attributes
    ----------
    objectives : tuple of Objective
    low, high : arrays, shape (6,)
        Bounds of the free numbers, millimetres.
    designs : array, shape (n, 6)
        All that was looked at.
    scores : array, shape (n, k)
        NaN for designs that violate a constraint, or show nothing over both mirrors.
    front : array, shape (m,)
        Rows of `designs` that no other dominates, the rig's own design among the candidates.
    rejected : dict of str to int
        How many designs each constraint threw out (one design may violate several).
    """

    objectives: tuple[Objective, ...]
    low: FloatArray
    high: FloatArray
    designs: FloatArray
    scores: FloatArray
    front: NDArray[np.int64]
    rejected: dict[str, int]


def all_scores(rig: Rig, parts: Sequence[PartMesh], designs: FloatArray) -> dict[str, FloatArray]:
    """Scores of designs of a rig, shape (n, 6), by every objective there is, each of shape (n,), as a search scores."""
    objectives = tuple(OBJECTIVES.values())
    scores = CoarseScorer(rig, parts, GRID).scores(designs, objectives)
    return {objective.name: scores[:, column] for column, objective in enumerate(objectives)}


def search_designs(
    rig: Rig,
    parts: Sequence[PartMesh],
    objectives: Sequence[str],
    *,
    designs: int = 10_000,
    seed: int = 0,
    factor: float = 1.5,
    buildable: Callable[[Rig], str] | None = None,
    checkpoint: Checkpoint | None = None,
    score: Score | None = None,
) -> Search:
    """Search for designs that are not worse than another in everything.

    Parameters
    ----------
    rig : Rig
        With mirrors; where the search begins.
    parts : sequence of PartMesh
        The hull is taken from them.
    objectives : sequence of str
        Two or more of `optics.search.objectives.OBJECTIVES`.
    designs : int
        How many to look at, before the polish.
    seed : int
    factor : float
        The free numbers stay between the rig's divided and multiplied by it.
    buildable : callable, optional
        What keeps a design's mount from being built, as a word, empty when nothing does; asked for every design that
        violates nothing else, so it must be quick.
    checkpoint : callable, optional
        Remembers batches, so that a search can be taken up again.
    score : callable, optional
        Gives designs, shape (n, 6), the scores that `feasible_scores` gives them, shape (n, k), wherever that is done.

    Raises
    ------
    ValueError
        For a rig without mirrors, unknown objectives, or when no design satisfies the constraints: named then.
    """
    chosen = objectives_named(objectives)
    if designs < 1 or seed < 0:
        raise ValueError(f"expected designs > 0 and seed >= 0, got {designs} and {seed}")
    own = rounded(design_of(rig)[np.newaxis])
    bounds = low, high = bounds_around(rig, factor)
    if score is None:
        scorer = CoarseScorer(rig, parts, GRID)
        score = partial(feasible_scores, rig, scorer, chosen, buildable)
    remember = checkpoint or (lambda _name, work: work())
    pool: list[Recorded] = []

    def record(name: str, make: Callable[[], FloatArray]) -> None:
        def work() -> Recorded:
            made = make()
            return made, score(made)

        pool.append(remember(name, work))

    record("own design", lambda: own)
    filling = max(1, round(designs * SOBOL_SHARE))
    for first in range(0, filling, BATCH):
        record(f"filling: from {first}", partial(_sobol, bounds, seed, first, min(BATCH, filling - first)))
    for first in range(filling, designs, BATCH):
        count = min(BATCH, designs - first)
        record(f"gathering: from {first}", partial(_children, pool, chosen, bounds, count, [seed, first]))
    if "resolution" in _names(chosen):
        for step_mm in POLISH_STEPS_MM:
            record(
                f"polishing: by {step_mm:g} mm",
                partial(_uphill, CoarseScorer(rig, [], DERIVATIVE_GRID), pool, chosen, bounds, step_mm),
            )
    everything, scores = (np.concatenate(column) for column in zip(*pool, strict=True))
    rejected = _rejected(rig, everything, scores, buildable)
    good = np.flatnonzero(np.isfinite(scores).all(axis=1))
    if not len(good):
        raise ValueError(
            f"expected bounds within which some design is possible, got none of {len(everything)}; they violate "
            + ", ".join(f"{name} ({count})" for name, count in rejected.items())
        )
    return Search(
        objectives=chosen,
        low=low,
        high=high,
        designs=everything,
        scores=scores,
        front=good[front(costs(scores[good], chosen))],
        rejected=rejected,
    )


def _rejected(
    rig: Rig, designs: FloatArray, scores: FloatArray, buildable: Callable[[Rig], str] | None
) -> dict[str, int]:
    """How many designs each constraint threw out, the most frequent first."""
    wrong = violated(rooms_mm(rig, designs))
    counts = Counter({name: int(count) for name, count in zip(CONSTRAINTS, wrong.sum(axis=0), strict=True) if count})
    for design in designs[~wrong.any(axis=1) & np.isnan(scores).any(axis=1)]:
        counts[(buildable(rig_with(rig, design)) if buildable else "") or NOTHING_SEEN] += 1
    return dict(counts.most_common())


def _names(objectives: Sequence[Objective]) -> set[str]:
    return {objective.name for objective in objectives}


def feasible_scores(
    rig: Rig,
    scorer: CoarseScorer,
    objectives: Sequence[Objective],
    buildable: Callable[[Rig], str] | None,
    designs: FloatArray,
) -> FloatArray:
    """Scores of designs, shape (n, 6), by objective, shape (n, k): NaN for those that violate something.

    A design scores the same among others as alone.
    """
    scores = np.full((len(designs), len(objectives)), np.nan)
    possible = np.asarray(~violated(rooms_mm(rig, designs)).any(axis=1))
    if buildable is not None:
        possible[possible] = [not buildable(rig_with(rig, design)) for design in designs[possible]]
    scores[possible] = scorer.scores(designs[possible], objectives)
    return scores


def _sobol(bounds: Bounds, seed: int, first: int, count: int) -> FloatArray:
    """Points `first` to `first + count` of a scrambled Sobol sequence between the bounds."""
    low, high = bounds
    sequence = qmc.Sobol(d=len(low), scramble=True, rng=np.random.default_rng(seed))
    points = sequence.random_base2((first + count - 1).bit_length())
    return rounded(low + points[first : first + count] * (high - low))


def _front_of(pool: Sequence[Recorded], objectives: Sequence[Objective]) -> Recorded:
    designs, scores = (np.concatenate(column) for column in zip(*pool, strict=True))
    good = np.flatnonzero(np.isfinite(scores).all(axis=1))
    rows = good[front(costs(scores[good], objectives))]
    return designs[rows], scores[rows]


def _children(
    pool: Sequence[Recorded], objectives: Sequence[Objective], bounds: Bounds, count: int, seed: Sequence[int]
) -> FloatArray:
    """New designs near the front: a member, part of the way between two others, and a small random step.

    The step between members is that of differential evolution (Storn & Price 1997): it is as long as the front is wide,
    number by number.
    """
    rng = np.random.default_rng(seed)
    low, high = bounds
    parents, _ = _front_of(pool, objectives)
    if not len(parents):
        # Nothing possible was found so far: go on filling the space.
        return rounded(rng.uniform(low, high, (count, len(low))))
    first, second, third = (parents[rng.integers(len(parents), size=count)] for _ in range(3))
    crossed = rng.random((count, len(low))) < 0.5
    moved = first + crossed * rng.uniform(0, 1, (count, 1)) * (second - third)
    moved = moved + rng.normal(scale=STEP_SHARE, size=moved.shape) * (high - low)
    return rounded(np.clip(moved, low, high))


def _uphill(
    scorer: CoarseScorer, pool: Sequence[Recorded], objectives: Sequence[Objective], bounds: Bounds, step_mm: float
) -> FloatArray:
    """Members of the front, moved along the gradient of the resolution without changing area or swept volume.

    The gradient is projected onto the directions in which the other smooth objectives stay as they are. Whether the
    step pays is decided where it is scored, rays, hull and all: what is dominated does not enter the front.
    """
    parents, scores = _front_of(pool, objectives)
    designs = parents[spread_out(costs(scores, objectives), POLISHED)]
    if not len(designs):
        return designs
    _, derivatives = scorer.soft_resolution_derivatives(designs)
    for row, kept in enumerate(_smooth_derivatives(designs, objectives)):
        normals = np.linalg.qr(kept.T)[0].T
        derivatives[row] = derivatives[row] - normals.T @ (normals @ derivatives[row])
    length = np.linalg.norm(derivatives, axis=1, keepdims=True)
    return rounded(np.clip(designs + step_mm * derivatives / np.where(length > 0, length, 1), *bounds))


def _smooth_derivatives(designs: FloatArray, objectives: Sequence[Objective]) -> FloatArray:
    """Derivatives of area and of the squared swept radius, those that are objectives; shape (n, 0 to 2, 6)."""
    area, radius = np.zeros((2, *designs.shape))
    area[:, [M1_WIDTH, M1_HEIGHT, M2_WIDTH, M2_HEIGHT]] = designs[:, [M1_HEIGHT, M1_WIDTH, M2_HEIGHT, M2_WIDTH]]
    radius[:, [M2_WIDTH, M2_HEIGHT]] = designs[:, [M2_WIDTH, M2_HEIGHT]]
    derivatives = {"area": area, "swept-volume": radius}
    chosen = [derivative for name, derivative in derivatives.items() if name in _names(objectives)]
    return np.stack(chosen, axis=1) if chosen else np.empty((len(designs), 0, designs.shape[1]))
