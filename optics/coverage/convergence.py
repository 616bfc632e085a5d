"""How far a coverage result is off: the same result on finer and finer grids, one kind of step at a time.

Three steps are taken by choice: between the cells of the image, between the joint values, and between the cells of the
sphere. Each is halved twice with the others kept, and then all together; the observed order and Richardson's estimate
for a step of zero follow (Roache, Annu. Rev. Fluid Mech. 29, 123, 1997).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from optics.coverage.coverage import compute_coverage, stepped_joints
from optics.coverage.sphere import check_nside
from optics.mesh import PartMesh
from rigs import Rig

LEVELS = 3


@dataclass(frozen=True, kw_only=True)
class Extrapolation:
    """A value at three steps, each half of the one before.

    Attributes
    ----------
    values : tuple of float
        The coarsest first.
    order : float or None
        p of an error that shrinks as step^p; None when the differences do not shrink, so that nothing can be said.
    estimate : float or None
        The value at a step of zero (Richardson); None with the order, but for a value that the step does not change.
    """

    values: tuple[float, float, float]
    order: float | None
    estimate: float | None


@dataclass(frozen=True, kw_only=True)
class Refinement:
    """What halving one kind of step does.

    Attributes
    ----------
    name : str
        The step that is halved.
    sizes : tuple of str
        Grids in words, the coarsest first.
    covered_fraction, mean_solid_angle_sr : Extrapolation
    """

    name: str
    sizes: tuple[str, ...]
    covered_fraction: Extrapolation
    mean_solid_angle_sr: Extrapolation


def extrapolate(values: Sequence[float]) -> Extrapolation:
    """Order and limit of three values at steps that halve each time."""
    coarse, middle, fine = (float(value) for value in values)
    first, second = middle - coarse, fine - middle
    if first == second == 0:
        return Extrapolation(values=(coarse, middle, fine), order=None, estimate=fine)
    if first * second <= 0 or abs(second) >= abs(first):
        return Extrapolation(values=(coarse, middle, fine), order=None, estimate=None)
    ratio = first / second
    return Extrapolation(
        values=(coarse, middle, fine), order=float(np.log2(ratio)), estimate=fine + second / (ratio - 1)
    )


def convergence(
    rig: Rig,
    parts: Sequence[PartMesh],
    *,
    step_deg: float = 1.0,
    columns: int = 64,
    rows: int = 48,
    nside: int = 64,
    done: Callable[[str], None] | None = None,
) -> list[Refinement]:
    """Halve the steps of a coverage, up to the given grid.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    parts : sequence of PartMesh
    step_deg : float
        Of both joints.
    columns, rows : int
        Cells of the image, multiples of four.
    nside : int
        Of the sphere, at least 4.
    done : callable, optional
        Called with each grid that has been computed, in words.

    Returns
    -------
    list of Refinement
        "pixels", "poses", "sphere", and "all", whose finest grid is the one given. The others are computed on as coarse
        a grid of what they keep as their differences allow; their values are not to be compared with each other's.
    """
    if columns % 4 or rows % 4 or columns < 4 or rows < 4:
        raise ValueError(f"expected columns and rows to be multiples of 4, got {columns} and {rows}")
    check_nside(nside)
    if nside < 4:
        raise ValueError(f"expected nside of at least 4, got {nside}")
    # The coarsest first, as multiples of the finest step.
    steps = [2 ** (LEVELS - 1 - k) for k in range(LEVELS)]
    grids = {
        "pixels": [(2 * step_deg, columns // k, rows // k, nside // 2) for k in steps],
        "poses": [(k * step_deg, columns // 2, rows // 2, nside // 2) for k in steps],
        "sphere": [(2 * step_deg, columns, rows, nside // k) for k in steps],
        "all": [(k * step_deg, columns // k, rows // k, nside // k) for k in steps],
    }
    return [_refine(rig, parts, name, levels, done) for name, levels in grids.items()]


def _refine(
    rig: Rig,
    parts: Sequence[PartMesh],
    name: str,
    levels: Sequence[tuple[float, int, int, int]],
    done: Callable[[str], None] | None,
) -> Refinement:
    sizes, covered, solid_angles = [], [], []
    for step_deg, columns, rows, nside in levels:
        q1, q2 = stepped_joints(rig, step_deg)
        found = compute_coverage(rig, parts, q1=q1, q2=q2, columns=columns, rows=rows, nside=nside)
        sizes.append(f"{columns} × {rows} pixels, {len(q1)} × {len(q2)} poses, nside {nside}")
        covered.append(found.covered_fraction)
        solid_angles.append(found.mean_solid_angle_sr)
        if done is not None:
            done(f"{name}: {sizes[-1]}")
    return Refinement(
        name=name,
        sizes=tuple(sizes),
        covered_fraction=extrapolate(covered),
        mean_solid_angle_sr=extrapolate(solid_angles),
    )
