"""Removal paths: straight moves out of a place, the last without an end, none of which hits anything.

A piece comes in along the path on which it can be taken out, so paths are sought from the place outwards.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cad.checks.sequence.lines import LINE_MM, Surface, free_travel_mm
from optics.kernels.arrays import FloatArray

ROUGH_MM = 0.5
"""Between the lines of a first search: what is in the path there, some 1.5 mm wide, is hit."""
SHORTEST_MM = 1.0
"""A first move that ends before this leads nowhere new."""
SHARES = (1.0, 0.5, 0.25)
"""Of a first move's free length, where a second one is tried."""
SPARE_MM = 0.2
"""That a first move ends before what is in its path."""
BEYOND_MM = 20.0
"""How far a piece is shown beyond what it came out of."""
FURTHEST_MM = 160.0


def removal_path(
    moving: Surface,
    still: Surface,
    directions: Sequence[FloatArray],
    *,
    then: Sequence[FloatArray] = (),
    shortest: bool = True,
) -> FloatArray | None:
    """Corners of a path, as shifts from the place in millimetres, shape (k, 3); None when none was found.

    The first move is along one of `directions`, a second one along one of these or of `then`.

    A single move is taken before two, and of several the shortest, or else the first. The last corner is where the
    piece is shown: from there it is free for ever in the same direction.
    """
    rough = [free_travel_mm(moving, still, direction, line_mm=ROUGH_MM) for direction in directions]
    shown = [_shown_mm(moving, still, direction) for direction in directions]
    straight = [number for number, length in enumerate(rough) if np.isinf(length)]
    for number in sorted(straight, key=lambda number: round(shown[number], 3) if shortest else 0.0):
        if _is_free(moving, still, directions[number]):
            return np.array([shown[number] * directions[number]])
    return _round_a_corner(moving, still, directions, (*directions, *then))


def _round_a_corner(
    moving: Surface, still: Surface, directions: Sequence[FloatArray], then: Sequence[FloatArray]
) -> FloatArray | None:
    """A path of two moves, a long one along one of `directions` first, and one along one of `then`."""
    lengths = [free_travel_mm(moving, still, direction) for direction in directions]
    for number in np.argsort(lengths)[::-1]:
        for share in SHARES:
            distance = share * lengths[number] - SPARE_MM
            if distance < SHORTEST_MM:
                continue
            first = distance * directions[number]
            there = moving.moved(first)
            for direction in then:
                if abs(direction @ directions[number]) < 0.99 and _is_free(there, still, direction):
                    return np.array([first, first + _shown_mm(there, still, direction) * direction])
    return None


def _is_free(moving: Surface, still: Surface, direction: FloatArray) -> bool:
    """Whether nothing is hit along a direction: sampled roughly, and where nothing is hit, closely."""
    return all(np.isinf(free_travel_mm(moving, still, direction, line_mm=pitch)) for pitch in (ROUGH_MM, LINE_MM))


def _shown_mm(moving: Surface, still: Surface, direction: FloatArray) -> float:
    """Distance along a direction after which the boxes of two bodies are apart, as far as that can be shown."""
    length = float((still.vertices_mm @ direction).max() - (moving.vertices_mm @ direction).min())
    return min(max(length, 0.0) + BEYOND_MM, FURTHEST_MM)
