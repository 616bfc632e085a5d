"""Which joint values keep the clearance, when not all do: a grid of proven cells, and the largest rectangle of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from cad.checks.clearance.gap_search import Cell
from cad.checks.clearance.moving_pair import MovingPair, joint_box
from optics.kernels.arrays import FloatArray
from optics.layout import Layout

GRID_CELLS = 128
"""Along each joint, a power of two: 1.2 degrees for the 155 degrees of a servo."""


class CellState(IntEnum):
    """What is known about the joint values of a cell; the larger, the worse."""

    CLEAR = 0
    """The clearance is kept in all of it."""
    UNDECIDED = 1
    """The clearance is kept in its middle, but not proven for all of it."""
    TOO_NEAR = 2
    """The clearance is not kept in its middle."""


@dataclass(frozen=True, kw_only=True)
class Rectangle:
    """Ranges of both joints, degrees."""

    q1_deg: tuple[float, float]
    q2_deg: tuple[float, float]

    def __str__(self) -> str:
        (a, b), (c, d) = self.q1_deg, self.q2_deg
        return f"q1 {a:.1f} to {b:.1f}, q2 {c:.1f} to {d:.1f} deg"


@dataclass(frozen=True, kw_only=True)
class AdmissibleRegion:
    """Joint values that keep the clearance.

    Attributes
    ----------
    state : array, shape (n1, n2), int8
        State of each cell (`CellState`); q1 along the first axis.
    q1_edges_deg, q2_edges_deg : array, shape (n1 + 1,) and (n2 + 1,)
        Edges of the cells.
    reachable : array, shape (n1, n2), bool
        Clear cells that are joined to the rest position by clear cells; all clear cells when it is not clear itself.
    largest : Rectangle or None
        Largest rectangle of reachable cells around the rest position; None when nothing is reachable.
    """

    state: NDArray[np.int8]
    q1_edges_deg: FloatArray
    q2_edges_deg: FloatArray
    reachable: NDArray[np.bool_]
    largest: Rectangle | None

    @property
    def fraction(self) -> float:
        """Reachable share of the box of both ranges."""
        return float(self.reachable.mean())


def admissible_region(pairs: Iterable[tuple[MovingPair, float]], layout: Layout) -> AdmissibleRegion:
    """Joint values at which every pair keeps its gap.

    Parameters
    ----------
    pairs : iterable of (MovingPair, float)
        Pairs that do not keep their gap everywhere, with the gap that the triangles must keep, millimetres.
    layout : Layout
        For the joint ranges.
    """
    state = np.zeros((GRID_CELLS, GRID_CELLS), dtype=np.int8)
    for pair, limit_mm in pairs:
        state = np.maximum(state, pair_states(pair, limit_mm))
    box = joint_box(layout)
    low, high = np.degrees(box.middle - box.half), np.degrees(box.middle + box.half)
    edges = [np.linspace(low[k], high[k], GRID_CELLS + 1) for k in (0, 1)]
    rest = tuple(int(np.clip(np.searchsorted(edge, 0.0, side="right") - 1, 0, GRID_CELLS - 1)) for edge in edges)
    clear = state == CellState.CLEAR
    reachable = clear
    if clear[rest]:
        regions, _ = label(clear)
        reachable = regions == regions[rest]
    return AdmissibleRegion(
        state=state,
        q1_edges_deg=edges[0],
        q2_edges_deg=edges[1],
        reachable=reachable,
        largest=_in_degrees(largest_rectangle(reachable, _seed(reachable, (rest[0], rest[1]))), edges),
    )


def pair_states(pair: MovingPair, limit_mm: float) -> NDArray[np.int8]:
    """State of every cell for one pair, by halving cells until they are proven or as small as the grid's."""
    state = np.full((GRID_CELLS, GRID_CELLS), CellState.UNDECIDED, dtype=np.int8)
    reach, joints = pair.reach_mm(), pair.joints
    box = joint_box(pair.layout)
    # A joint that does not matter is not divided.
    stack = [((0, GRID_CELLS), (0, GRID_CELLS))]
    while stack:
        spans = stack.pop()
        cell = _cell(box, spans)
        gap = pair.gap_mm(cell.middle)
        swing = float(cell.half @ reach)
        sizes = [(high - low) if on else 1 for (low, high), on in zip(spans, joints, strict=True)]
        where = tuple(slice(*span) for span in spans)
        if gap - swing >= limit_mm:
            state[where] = CellState.CLEAR
        elif gap + swing < limit_mm or max(sizes) == 1:
            state[where] = CellState.TOO_NEAR if gap < limit_mm else CellState.UNDECIDED
        else:
            stack += _halved(spans, int(np.argmax(sizes * reach)) if min(sizes) > 1 else int(np.argmax(sizes)))
    return state


Spans = tuple[tuple[int, int], tuple[int, int]]


def _cell(box: Cell, spans: Spans) -> Cell:
    share = np.array(spans, dtype=float) / GRID_CELLS
    low = box.middle - box.half
    return Cell.between(low + 2 * box.half * share[:, 0], low + 2 * box.half * share[:, 1])


def _halved(spans: Spans, axis: int) -> list[Spans]:
    low, high = spans[axis]
    middle = (low + high) // 2
    parts = [(low, middle), (middle, high)]
    return [(part, spans[1]) if axis == 0 else (spans[0], part) for part in parts]


def _seed(reachable: NDArray[np.bool_], rest: tuple[int, int]) -> tuple[int, int] | None:
    """Rest cell, or the reachable one nearest to it."""
    cells = np.argwhere(reachable)
    if not len(cells):
        return None
    nearest = cells[np.abs(cells - rest).sum(axis=1).argmin()]
    return int(nearest[0]), int(nearest[1])


def largest_rectangle(
    good: NDArray[np.bool_], around: tuple[int, int] | None
) -> tuple[tuple[int, int], tuple[int, int]] | None:
    """Largest rectangle of good cells that holds a given good cell.

    Returns
    -------
    ((row_start, row_end), (column_start, column_end)) or None
        Half-open spans; None without a cell to begin with.
    """
    if around is None:
        return None
    row, column = around
    # Of every row, the run of good cells around the column; rows without one end the rectangle.
    bad = ~good
    left = np.array([column - np.argmax(line[column::-1]) + 1 if line[column::-1].any() else 0 for line in bad])
    right = np.array([column + np.argmax(line[column:]) if line[column:].any() else good.shape[1] for line in bad])
    best, size = None, 0
    for top in range(row, -1, -1):
        if bad[top, column]:
            break
        for bottom in range(row, good.shape[0]):
            if bad[bottom, column]:
                break
            span = int(left[top : bottom + 1].max()), int(right[top : bottom + 1].min())
            area = (bottom + 1 - top) * (span[1] - span[0])
            if area > size:
                best, size = ((top, bottom + 1), span), area
    return best


def _in_degrees(found: tuple[tuple[int, int], tuple[int, int]] | None, edges: list[FloatArray]) -> Rectangle | None:
    if found is None:
        return None
    rows, columns = found
    return Rectangle(
        q1_deg=(float(edges[0][rows[0]]), float(edges[0][rows[1]])),
        q2_deg=(float(edges[1][columns[0]]), float(edges[1][columns[1]])),
    )
