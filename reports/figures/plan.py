"""Figure of a planned dive: where the target goes seen from above, and over which directions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.spatial import ConvexHull

from dives.planning.availability import NSIDE
from dives.planning.plan import DivePlan
from optics.kernels.arrays import FloatArray
from optics.mesh import PartMesh, Role
from reports.figures.plotting import INK, STYLE, save_figure
from reports.figures.sphere import REACH_COLOUR, map_axes, outline_of_gaze, paint
from rigs import Rig

COVERED_COLOUR = "#bfe3dd"
AVAILABLE_COLOUR = "#126e63"
COLOURS = {
    "no gaze shows it past hull and mount": "#d1495b",
    "the world hides it": "#8a5a44",
    "a decoy hides it": "#edae49",
}
"""By the reasons of `dives.planning.plan`."""

SWAY_M = 0.5
"""Up to which a robot's way is its sway, and not drawn."""

CLOCK_S = (1, 2, 5, 10, 20, 30, 60, 120, 300, 600)
"""Steps of the times that are written beside the path: the first with at most ten of them."""
MOST_TIMES = 10


def draw_plan(plan: DivePlan, rig: Rig, parts: Sequence[PartMesh], path: Path) -> None:
    """Draw the plan: on the left from above, bow upwards, on the right the directions that the target takes."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(12.5, 5.6), layout="constrained")
        grid = figure.add_gridspec(1, 2, width_ratios=[1, 1.5])
        _from_above(figure.add_subplot(grid[0]), plan, parts)
        right = map_axes(figure, grid[1])
        paint(right, NSIDE, np.where(plan.covered, 1.0, np.nan), colour=COVERED_COLOUR)
        outline_of_gaze(right, rig)
        direction = plan.availability.direction
        azimuth = np.arctan2(direction[:, 1], direction[:, 0])
        _draw_path(right, plan, -azimuth, np.arcsin(direction[:, 2]), jump=np.pi)
        right.set_title("Directions from the gaze mirror, body frame", pad=14)
        present = {gap.reason for gap in plan.gaps}
        marks = [
            Line2D([], [], color=AVAILABLE_COLOUR, linewidth=2.5, label="available"),
            *(Line2D([], [], color=COLOURS[each], linewidth=2.5, label=each) for each in COLOURS if each in present),
            Patch(facecolor=COVERED_COLOUR, edgecolor=INK, linewidth=0.4, label="directions that some gaze shows"),
            Patch(facecolor=REACH_COLOUR, edgecolor=INK, linewidth=0.4, label="directions that none shows"),
        ]
        figure.legend(handles=marks, loc="outside lower center", ncols=len(marks), frameon=False, fontsize=8)
        save_figure(figure, path)


def _from_above(axes: Axes, plan: DivePlan, parts: Sequence[PartMesh]) -> None:
    """Robot's start, its own path where it moves, the target's path and what else is there; y to the left."""
    hull = np.concatenate([part.vertices_m for part in parts if part.role is Role.HULL] or [np.zeros((0, 3))])
    if len(hull):
        outline = hull[ConvexHull(hull[:, :2]).vertices, :2]
        axes.fill(-outline[:, 1], outline[:, 0], facecolor="#e2e8f0", edgecolor=INK, linewidth=0.8)
    axes.annotate("", (0, 0.5), (0, 0), arrowprops={"arrowstyle": "->", "color": INK})
    if np.ptp(plan.robot_m[:, :2], axis=0).max() > SWAY_M:
        axes.plot(-plan.robot_m[:, 1], plan.robot_m[:, 0], color=INK, linewidth=1.0, linestyle="--")
    _draw_path(axes, plan, -plan.target_m[:, 1], plan.target_m[:, 0])
    for index in _written(plan.availability.time_s, plan.dive.duration_s):
        x, y = -plan.target_m[index, 1], plan.target_m[index, 0]
        axes.plot(x, y, "o", color=INK, markersize=3)
        axes.annotate(f"{plan.availability.time_s[index]:g} s", (x, y), (4, 4), textcoords="offset points", fontsize=7)
    for decoy in plan.dive.decoys:
        if decoy.position_m is not None:
            axes.plot(-decoy.position_m[1], decoy.position_m[0], "x", color=COLOURS["a decoy hides it"])
    axes.set_aspect("equal")
    axes.margins(0.12)
    axes.grid(color=INK, alpha=0.15, linewidth=0.5)
    axes.set_xlabel("to the right (m)")
    axes.set_ylabel("ahead (m)")
    axes.set_title(f"{plan.dive.name} from above, {plan.availability.available.mean():.0%} of the time available")


def _draw_path(axes: Axes, plan: DivePlan, x: FloatArray, y: FloatArray, *, jump: float = np.inf) -> None:
    """Path in the colours of what becomes of the target; broken where x jumps."""
    broken = np.where(np.abs(np.diff(x, append=x[-1:])) > jump, np.nan, x)
    axes.plot(broken, y, color=AVAILABLE_COLOUR, linewidth=2.5, solid_capstyle="round")
    times_s = plan.availability.time_s
    for gap in plan.gaps:
        within = (times_s >= gap.from_s) & (times_s <= gap.to_s)
        axes.plot(np.where(within, broken, np.nan), y, color=COLOURS[gap.reason], linewidth=2.5)


def _written(times_s: FloatArray, duration_s: float) -> list[int]:
    """Indices of the times that are written beside the path."""
    step_s = next((step for step in CLOCK_S if duration_s / step <= MOST_TIMES), CLOCK_S[-1])
    return [int(np.argmin(np.abs(times_s - time_s))) for time_s in np.arange(0, duration_s, step_s)]
