"""What a grid of dives found of a metric: means by each factor, and by each two of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dives.ensembles.factors import Effect
from reports.figures.plotting import COLOUR_MAP, INK, STYLE, save_figure


def write_factors(effects: Sequence[Effect], folder: Path) -> list[str]:
    """Draw each metric's effects into a folder; returns the names of the files."""
    names = []
    for metric in dict.fromkeys(each.metric for each in effects):
        names.append(f"{metric}.png")
        draw_factors([each for each in effects if each.metric == metric], folder / names[-1])
    return names


def draw_factors(effects: Sequence[Effect], path: Path) -> None:
    """A square of factors by factors for one metric: its means with intervals on the diagonal, those of pairs below.

    Parameters
    ----------
    effects : sequence of Effect
        Of one metric, all of them.
    path : Path
        Of the PNG.
    """
    factors = [each.factors[0] for each in effects if len(each.factors) == 1]
    means = [level.interval.estimate for each in effects for level in each.levels]
    known = [mean for mean in means if mean is not None] or [0.0]
    limits = min(known), max(known)
    count = len(factors)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(1.2 + 3.0 * count, 1.0 + 2.7 * count), layout="constrained")
        grid = figure.subplots(count, count, squeeze=False)
        for axes in grid.ravel():
            axes.set_axis_off()
        for each in effects:
            row, column = (factors.index(each.factors[index]) for index in (-1, 0))
            grid[row, column].set_axis_on()
            (_means if row == column else _pairs)(grid[row, column], each, limits)
        figure.suptitle(effects[0].metric)
        save_figure(figure, path)


def _means(axes: Axes, effect: Effect, limits: tuple[float, float]) -> None:
    names = [level.levels[0] for level in effect.levels]
    for place, level in enumerate(effect.levels):
        interval = level.interval
        if interval.estimate is None:
            continue
        axes.plot(place, interval.estimate, "o", color=INK)
        if interval.low is not None and interval.high is not None:
            axes.plot([place, place], [interval.low, interval.high], color=INK)
    axes.set_xticks(range(len(names)), names)
    axes.set_xlim(-0.5, len(names) - 0.5)
    axes.set_title(_title(effect))


def _pairs(axes: Axes, effect: Effect, limits: tuple[float, float]) -> None:
    across, down = (list(dict.fromkeys(level.levels[index] for level in effect.levels)) for index in (0, 1))
    values = np.full((len(down), len(across)), np.nan)
    for level in effect.levels:
        if level.interval.estimate is not None:
            values[down.index(level.levels[1]), across.index(level.levels[0])] = level.interval.estimate
    axes.imshow(values, cmap=COLOUR_MAP, vmin=limits[0], vmax=limits[1], aspect="auto")
    middle = sum(limits) / 2
    for (row, column), value in np.ndenumerate(values):
        text, colour = ("-", INK) if np.isnan(value) else (f"{value:.2g}", "black" if value > middle else "white")
        axes.text(column, row, text, ha="center", va="center", color=colour)
    axes.set_xticks(range(len(across)), across)
    axes.set_yticks(range(len(down)), down)
    axes.set_title(_title(effect))


def _title(effect: Effect) -> str:
    name = " x ".join(factor.rpartition(".")[2] for factor in effect.factors)
    return name if effect.share is None else f"{name}: {100 * effect.share:.0f} %"
