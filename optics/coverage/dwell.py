"""Dwell redundancy: by how many poses a direction is seen, and so how much a search may leave out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optics.coverage.coverage import Coverage


@dataclass(frozen=True, kw_only=True)
class Dwell:
    """Numbers of poses that see a direction, over the directions that some pose sees; zeros where none does.

    Attributes
    ----------
    minimum, maximum : int
    median : float
    once_fraction : float
        Share of the whole sphere that exactly one pose sees.
    histogram : tuple of int
        Cells of the sphere by number of poses, from none.
    """

    minimum: int
    median: float
    maximum: int
    once_fraction: float
    histogram: tuple[int, ...]


def dwell(coverage: Coverage) -> Dwell:
    """Dwell redundancy of a coverage."""
    histogram = np.bincount(coverage.poses_seeing, minlength=2)
    seen = coverage.poses_seeing[coverage.covered]
    return Dwell(
        minimum=int(seen.min()) if len(seen) else 0,
        median=float(np.median(seen)) if len(seen) else 0.0,
        maximum=int(seen.max()) if len(seen) else 0,
        once_fraction=float(histogram[1] / histogram.sum()),
        histogram=tuple(histogram.tolist()),
    )
