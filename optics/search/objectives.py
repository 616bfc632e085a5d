"""What a design search weighs, and the six numbers it is free to choose.

A design is a row of six millimetres, in the order of `PARAMETERS`; designs are arrays of shape (n, 6). Scores are
arrays of shape (n, k), a column for each objective, in the objective's own unit; some are wanted large, some small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from optics.mirror_outline import OUTLINES, Centred
from rigs import Rig

PARAMETERS = (
    ("fold_mirror", "distance_mm"),
    ("gaze_mirror", "distance_mm"),
    ("fold_mirror", "width_mm"),
    ("fold_mirror", "height_mm"),
    ("gaze_mirror", "width_mm"),
    ("gaze_mirror", "height_mm"),
)
"""Section and key of each free number: d1, d2, and both mirrors' sides."""

D1, D2, M1_WIDTH, M1_HEIGHT, M2_WIDTH, M2_HEIGHT = range(len(PARAMETERS))
SIDES = ((M1_WIDTH, M1_HEIGHT), (M2_WIDTH, M2_HEIGHT))

RESOLUTION_MM = 0.1
"""Designs are whole multiples of it: a workshop cuts no finer, and a rig file holds such a number exactly."""


@dataclass(frozen=True, kw_only=True)
class Objective:
    """One thing to weigh: its unit, and whether more of it is better."""

    name: str
    unit: str
    larger_is_better: bool


OBJECTIVES = {
    objective.name: objective
    for objective in (
        Objective(name="coverage", unit="of the sphere", larger_is_better=True),
        Objective(name="area", unit="cm2", larger_is_better=False),
        Objective(name="swept-volume", unit="l", larger_is_better=False),
        Objective(name="resolution", unit="px", larger_is_better=True),
    )
}
"""coverage: share of all directions that some pose shows. area: both mirrors together. swept-volume: of the sphere in
which M2's plate turns. resolution: pixels of the image that look into open water over both mirrors, mean over the
joint ranges; flat mirrors leave the pixels per degree of the camera behind its port as they are, so what the mirrors
decide is how many pixels the gaze gets."""


def objectives_named(names: Sequence[str]) -> tuple[Objective, ...]:
    """Objectives by name; a `ValueError` for names that are unknown, doubled, or fewer than two."""
    unknown = [name for name in names if name not in OBJECTIVES]
    if unknown or len(set(names)) != len(names) or len(names) < 2:
        raise ValueError(f"expected two or more of the objectives {', '.join(OBJECTIVES)}, got {', '.join(names)!r}")
    return tuple(OBJECTIVES[name] for name in names)


def design_of(rig: Rig) -> FloatArray:
    """The free numbers of a rig, shape (6,), millimetres."""
    gaze = rig.require_gaze()
    return np.array([getattr(getattr(gaze, section), key) for section, key in PARAMETERS], dtype=np.float64)


def rig_with(rig: Rig, design: FloatArray) -> Rig:
    """A rig with the free numbers of a design."""
    changes: dict[str, dict[str, float]] = {}
    for (section, key), value in zip(PARAMETERS, rounded(design).tolist(), strict=True):
        changes.setdefault(section, {})[key] = value
    return rig.with_gaze(**changes)


def rounded(designs: FloatArray) -> FloatArray:
    """Designs on the grid of `RESOLUTION_MM`, as the nearest decimal numbers."""
    return np.round(designs, 1)


def outlines_of(rig: Rig, designs: FloatArray) -> tuple[Centred, Centred]:
    """Outlines of M1 and M2 of designs of a rig, whose sides are arrays of shape (n,)."""
    gaze = rig.require_gaze()
    m1, m2 = (
        OUTLINES[mirror.outline](half_width=designs[..., width] / 2000, half_height=designs[..., height] / 2000)
        for mirror, (width, height) in zip((gaze.fold_mirror, gaze.gaze_mirror), SIDES, strict=True)
    )
    return m1, m2


def area_cm2(rig: Rig, designs: FloatArray) -> FloatArray:
    """Area of both mirrors, shape (n,)."""
    m1, m2 = outlines_of(rig, designs)
    return np.asarray(1e4 * (m1.area_m2 + m2.area_m2))


def swept_radius_m(rig: Rig, designs: FloatArray) -> FloatArray:
    """Radius of the sphere around the crossing of the joint axes in which M2's plate turns, shape (n,)."""
    _, m2 = outlines_of(rig, designs)
    return np.asarray(np.hypot(m2.radius_m, rig.require_gaze().gaze_mirror.thickness_mm / 1000))


def swept_volume_l(rig: Rig, designs: FloatArray) -> FloatArray:
    """Volume of that sphere, shape (n,)."""
    return np.asarray(4000 / 3 * np.pi * swept_radius_m(rig, designs) ** 3)


def costs(scores: FloatArray, objectives: Sequence[Objective]) -> FloatArray:
    """Scores with their signs turned so that less is better everywhere."""
    signs = np.array([-1.0 if objective.larger_is_better else 1.0 for objective in objectives])
    return np.asarray(scores * signs)


def dominated_by(costs_of: FloatArray, others: FloatArray) -> NDArray[np.bool_]:
    """Which rows some other row is no worse than in all columns and better than in one; shape (n,)."""
    result = np.zeros(len(costs_of), dtype=np.bool_)
    # A few rows at a time: all pairs at once would not fit into memory.
    for first in range(0, len(costs_of), 256):
        rows = costs_of[first : first + 256, np.newaxis]
        better = np.logical_and((others <= rows).all(axis=2), (others < rows).any(axis=2))
        result[first : first + 256] = better.any(axis=1)
    return result


def front(costs_of: FloatArray) -> NDArray[np.int64]:
    """Rows that no other row dominates (the Pareto front); of equal rows the first."""
    if not len(costs_of):
        return np.empty(0, dtype=np.int64)
    _, first = np.unique(costs_of, axis=0, return_index=True)
    first = np.sort(first)
    kept = first
    # Blocks of candidates against the front so far, so that most comparisons are with few rows.
    chosen = np.empty(0, dtype=np.int64)
    for start in range(0, len(kept), 1024):
        together = np.concatenate([chosen, kept[start : start + 1024]])
        chosen = together[~dominated_by(costs_of[together], costs_of[together])]
    return np.sort(chosen)


def spread_out(costs_of: FloatArray, count: int) -> NDArray[np.int64]:
    """At most `count` rows that stand far apart, the best in each column among them.

    Rows are taken one by one, each the furthest from those already taken (Gonzalez 1985), with every column scaled to
    its range.
    """
    if len(costs_of) <= count:
        return np.arange(len(costs_of), dtype=np.int64)
    span = np.ptp(costs_of, axis=0)
    scaled = (costs_of - costs_of.min(axis=0)) / np.where(span > 0, span, 1)
    chosen = list(dict.fromkeys(int(row) for row in scaled.argmin(axis=0)))[:count]
    distance = np.linalg.norm(scaled[:, np.newaxis] - scaled[chosen], axis=2).min(axis=1)
    while len(chosen) < count:
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(scaled - scaled[chosen[-1]], axis=1))
    return np.sort(np.array(chosen, dtype=np.int64))
