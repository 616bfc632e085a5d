"""The front of a design search as a figure and a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from optics.kernels.arrays import FloatArray
from optics.search.objectives import PARAMETERS
from optics.search.search import Search
from reports.figures.plotting import STYLE, save_figure
from rigs.atomic_files import csv_text, write_text

POSSIBLE, FRONT, CHOSEN, OWN = "#cbd5e1", "#2a9d8f", "#d1495b", "#1c2b39"


def draw_front(search: Search, chosen: Sequence[int], path: Path) -> None:
    """Each pair of objectives: possible designs, the front, the chosen members by number, and the rig as it is."""
    pairs = list(combinations(range(len(search.objectives)), 2))
    columns = min(3, len(pairs))
    rows = -(-len(pairs) // columns)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(4.2 * columns, 3.6 * rows), layout="constrained")
        grid = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, pair in zip(grid, pairs, strict=False):
            _pair(axes, search, chosen, pair)
        for axes in grid[len(pairs) :]:
            axes.set_axis_off()
        shown = grid[0].get_legend_handles_labels()
        figure.legend(*shown, loc="outside lower center", ncols=4, frameon=False, fontsize=8)
        save_figure(figure, path)


def _pair(axes: Axes, search: Search, chosen: Sequence[int], pair: tuple[int, int]) -> None:
    x, y = search.scores[:, pair].T
    axes.scatter(x, y, s=3, color=POSSIBLE, label="possible", rasterized=True)
    axes.scatter(x[search.front], y[search.front], s=7, color=FRONT, label="front")
    axes.scatter(x[chosen], y[chosen], s=26, facecolors="none", edgecolors=CHOSEN, label="chosen")
    for number, row in enumerate(chosen, start=1):
        axes.annotate(str(number), (x[row], y[row]), xytext=(4, 4), textcoords="offset points", color=CHOSEN, size=8)
    if np.isfinite(x[0]):
        axes.scatter(x[:1], y[:1], s=60, marker="*", color=OWN, label="the rig as it is", zorder=3)
    for name, index in (("x", pair[0]), ("y", pair[1])):
        objective = search.objectives[index]
        better = "more is better" if objective.larger_is_better else "less is better"
        getattr(axes, f"set_{name}label")(f"{objective.name} ({objective.unit}); {better}")


def front_rows(
    search: Search,
    base_anchor_mm: Callable[[FloatArray], tuple[float, float, float]],
    held: Callable[[FloatArray], list[str]],
    files: dict[int, str],
) -> list[dict[str, str]]:
    """One row per member of the front: its numbers, its scores, what binds, and its rig file if it has one.

    Parameters
    ----------
    search : Search
    base_anchor_mm : callable
        Where the gimbal's base of a design is bolted on.
    held : callable
        What binds a design.
    files : dict of int to str
        Rig files by row of `search.designs`.
    """
    rows = []
    for row in search.front.tolist():
        design = search.designs[row]
        numbers = {f"{section}.{key}": f"{value:g}" for (section, key), value in zip(PARAMETERS, design, strict=True)}
        scores = {
            objective.name: f"{value:.6g}"
            for objective, value in zip(search.objectives, search.scores[row], strict=True)
        }
        anchor = " ".join(f"{value:g}" for value in base_anchor_mm(design))
        more = {"mount.base_anchor_mm": anchor, **scores, "binding": "; ".join(held(design))}
        rows.append({"row": str(row), **numbers, **more, "rig": files.get(row, "")})
    return rows


def write_front(rows: Sequence[dict[str, str]], path: Path) -> None:
    """CSV of `front_rows`."""
    write_text(path, csv_text([rows[0], *(row.values() for row in rows)]))
