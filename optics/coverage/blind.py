"""Blind directions: what no pose shows, patch by patch, and what stands in the way there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from optics.coverage.coverage import Coverage
from optics.coverage.outcome import BLOCKERS, Outcome
from optics.coverage.sphere import cell_directions, cell_solid_angle_sr

OUT_OF_REACH = -1
"""Cause of a blind direction at which no pose points a ray: the joints' limits and the mirrors' edges end before it."""

NEIGHBOURS = 1.5
"""Cells whose centres are at most this many cell widths (roots of the solid angle) apart belong together: all that
share an edge (HEALPix's are at most 1.45 apart) and some that share a corner."""


@dataclass(frozen=True, kw_only=True)
class BlindPatch:
    """Connected directions that no pose shows.

    Attributes
    ----------
    azimuth_deg, elevation_deg : float
        Its middle: the direction farthest from anything that is seen.
    radius_deg : float
        From there to the nearest direction that is seen.
    solid_angle_sr : float
    cause : str
        What stops the rays in most of its cells, by its name (`cause_name`).
    cause_share : float
        Share of the patch of which that is true.
    """

    azimuth_deg: float
    elevation_deg: float
    radius_deg: float
    solid_angle_sr: float
    cause: str
    cause_share: float


def blind_causes(coverage: Coverage) -> NDArray[np.int64]:
    """Why each cell of the sphere is blind, shape (cells,): what stops it in most poses, OUT_OF_REACH, or SEEN."""
    stopped = coverage.poses_by_outcome[list(BLOCKERS)]
    cause = np.where(stopped.sum(axis=0) > 0, np.array(BLOCKERS)[stopped.argmax(axis=0)], OUT_OF_REACH)
    return np.where(coverage.covered, int(Outcome.SEEN), cause)


def cause_name(cause: int) -> str:
    """Name of what makes a direction blind; empty where it is seen."""
    if cause == OUT_OF_REACH:
        return "reach"
    return "" if cause == Outcome.SEEN else Outcome(cause).name.lower()


def patch_cells(coverage: Coverage) -> list[NDArray[np.int64]]:
    """Cells of each connected blind patch, the largest first."""
    blind = np.flatnonzero(~coverage.covered)
    patch_of_cell = _patches(cell_directions(coverage.nside)[blind], NEIGHBOURS * _width(coverage.nside))
    patches = [blind[patch_of_cell == number] for number in range(patch_of_cell.max(initial=-1) + 1)]
    return sorted(patches, key=lambda cells: -len(cells))


def blind_patches(coverage: Coverage) -> list[BlindPatch]:
    """Connected blind patches, in the order of `patch_cells`."""
    directions, causes = cell_directions(coverage.nside), blind_causes(coverage)
    patches = []
    for cells in patch_cells(coverage):
        clearance = _clearance(directions[cells], directions[coverage.covered])
        middle = clearance.argmax()
        x, y, z = directions[cells[middle]]
        kinds, counts = np.unique(causes[cells], return_counts=True)
        main = int(kinds[counts.argmax()])
        patches.append(
            BlindPatch(
                azimuth_deg=float(np.degrees(np.arctan2(y, x))),
                elevation_deg=float(np.degrees(np.arcsin(z))),
                radius_deg=float(np.degrees(clearance[middle])),
                solid_angle_sr=float(len(cells) * cell_solid_angle_sr(coverage.nside)),
                cause=cause_name(main),
                cause_share=float(counts.max() / len(cells)),
            )
        )
    return patches


def rim_cells(coverage: Coverage) -> NDArray[np.bool_]:
    """Cells at the rim of what is seen, shape (cells,): seen ones beside a blind one, and blind ones beside a seen."""
    directions, width, seen = cell_directions(coverage.nside), _width(coverage.nside), coverage.covered
    rim = np.zeros(len(seen), dtype=bool)
    rim[seen] = _clearance(directions[seen], directions[~seen]) < NEIGHBOURS * width
    rim[~seen] = _clearance(directions[~seen], directions[seen]) < NEIGHBOURS * width
    return rim


def rim_fraction(coverage: Coverage) -> float:
    """Share of the sphere in seen cells beside a blind one: many are seen in part, and counted as a whole.

    As many at the rim are blind in part and not counted, so that the covered fraction is off by far less.
    """
    return float((rim_cells(coverage) & coverage.covered).mean())


def _width(nside: int) -> float:
    return float(np.sqrt(cell_solid_angle_sr(nside)))


def _patches(directions: NDArray[np.float64], reach: float) -> NDArray[np.int64]:
    """Number of the patch of each direction; those within `reach` of each other are in one."""
    if not len(directions):
        return np.empty(0, dtype=np.int64)
    pairs = cKDTree(directions).query_pairs(reach, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(directions), len(directions)))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)


def _clearance(directions: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angle from each direction to the nearest of the others, radians; pi where there are none."""
    if not len(others) or not len(directions):
        return np.full(len(directions), np.pi)
    chord = cKDTree(others).query(directions)[0]
    return np.asarray(2 * np.arcsin(np.minimum(chord / 2, 1)))
