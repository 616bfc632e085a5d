"""From a front of hundreds to a handful: members that stand far apart and pass a closer check."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.search.objectives import costs, spread_out
from optics.search.search import Search

MOST_CHECKED = 60
"""Members of the front that are checked closely, at most; building a mount takes seconds."""


def choose(
    search: Search, count: int, problems_of: Callable[[list[FloatArray]], list[str]]
) -> tuple[list[int], dict[int, str]]:
    """Members of the front that stand far apart and pass a closer check.

    Parameters
    ----------
    search : Search
    count : int
        How many are wanted at most.
    problems_of : callable
        What is wrong with each of some designs, empty when nothing is. It may be slow: only members that are about to
        be chosen are checked, about `MOST_CHECKED` at most.

    Returns
    -------
    chosen : list of int
        Rows of `search.designs`.
    problems : dict of int to str
        Members that were thrown out, and why.
    """
    problems: dict[int, str] = {}
    passed: set[int] = set()
    while True:
        candidates = np.array([row for row in search.front.tolist() if row not in problems], dtype=np.int64)
        rows = candidates[spread_out(costs(search.scores[candidates], search.objectives), count)].tolist()
        unseen = [row for row in rows if row not in passed]
        news = dict(zip(unseen, problems_of([search.designs[row] for row in unseen]), strict=True))
        passed |= {row for row, problem in news.items() if not problem}
        problems |= {row: problem for row, problem in news.items() if problem}
        if not any(news.values()) or len(passed) + len(problems) >= MOST_CHECKED:
            return [row for row in rows if row in passed], problems
