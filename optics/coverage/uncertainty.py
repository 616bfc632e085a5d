"""Between what the covered fraction lies when joints and cells are as fine as one likes.

The steps of the joints leave gaps between views, so that they only ever take from what is covered. How much is found by
looking again at what is blind, and at that alone, with half the steps: what is seen then is certain, and of what finer
steps add to it, first-order convergence gives as much again. Roache's factor of safety is for an order that is less
(P. J. Roache, Annu. Rev. Fluid Mech. 29, 123, 1997). The sphere's cells err by chance, but a rim along a ring of them
takes or leaves the whole ring: those at the rim are looked at again in quarters. The image's cells do not matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from optics.coverage.blind import rim_cells, rim_fraction
from optics.coverage.coverage import Coverage, covered_cells
from optics.coverage.sphere import cell_count, cell_directions, cells_of
from optics.kernels.arrays import FloatArray
from optics.mesh import PartMesh
from rigs import Rig

SAFETY = 1.25
STANDARD_ERRORS = 2.0
"""Of the sphere's cells, on either side."""


@dataclass(frozen=True, kw_only=True)
class CoveredRange:
    """A covered fraction and what its grids may hide.

    Attributes
    ----------
    low, high : float
        Between these it lies on the finest of grids.
    half_step_fraction : float
        Covered with half the steps of the joints.
    joints : float
        What finer steps of the joints may add.
    cells : float
        What the cells of the sphere may have added or taken: what quarters of those at the rim change, and two standard
        errors.
    coarsest : str
        Which of the two is the larger: "joints" or "cells".
    """

    low: float
    high: float
    half_step_fraction: float
    joints: float
    cells: float
    coarsest: str


def covered_range(rig: Rig, parts: Sequence[PartMesh], coverage: Coverage) -> CoveredRange:
    """Range of a coverage's covered fraction.

    Parameters
    ----------
    rig, parts
        As the coverage was computed with.
    coverage : Coverage
    """
    count = cell_count(coverage.nside)
    blind = np.flatnonzero(~coverage.covered)
    q1, q2 = (_halved(np.radians(values)) for values in (coverage.q1_deg, coverage.q2_deg))
    found = int(covered_cells(rig, parts, q1=q1, q2=q2, nside=coverage.nside, cells=blind).sum()) / count
    joints = min((1 + SAFETY) * found, coverage.blind_fraction)
    quartered = _with_quartered_rim(rig, parts, coverage) - coverage.covered_fraction
    cells = STANDARD_ERRORS * cells_standard_error(coverage) + abs(quartered)
    return CoveredRange(
        low=max(0.0, coverage.covered_fraction - cells),
        high=min(1.0, coverage.covered_fraction + joints + cells),
        half_step_fraction=coverage.covered_fraction + found,
        joints=joints,
        cells=cells,
        coarsest="joints" if joints > cells else "cells",
    )


def _with_quartered_rim(rig: Rig, parts: Sequence[PartMesh], coverage: Coverage) -> float:
    """Covered fraction when each cell at the rim counts by its four quarters."""
    nside, rim = 2 * coverage.nside, rim_cells(coverage)
    quarters = np.flatnonzero(rim[cells_of(cell_directions(nside), coverage.nside)])
    q1, q2 = np.radians(coverage.q1_deg), np.radians(coverage.q2_deg)
    seen = covered_cells(rig, parts, q1=q1, q2=q2, nside=nside, cells=quarters)
    return float((coverage.covered & ~rim).sum() + seen.sum() / 4) / cell_count(coverage.nside)


def cells_standard_error(coverage: Coverage) -> float:
    """Of the covered fraction, when each cell at the rim is seen, or not, with the same probability."""
    return 0.5 * float(np.sqrt(rim_fraction(coverage) / cell_count(coverage.nside)))


def _halved(values: FloatArray) -> FloatArray:
    """The same values and those half way between neighbours."""
    halved = np.interp(np.arange(2 * len(values) - 1) / 2, np.arange(len(values)), values)
    # Interpolation may round a limit to beyond itself.
    return np.clip(halved, values.min(), values.max())
