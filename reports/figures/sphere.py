"""Figures on the sphere of directions: Mollweide's map; equal areas are equal, the robot's left is on the left."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FixedLocator, FuncFormatter
from numpy.typing import NDArray

from optics.camera import camera_from_spec
from optics.coverage.blind import OUT_OF_REACH, blind_causes
from optics.coverage.coverage import Coverage
from optics.coverage.field import pixels_per_degree
from optics.coverage.outcome import BLOCKERS
from optics.coverage.sphere import cells_of
from optics.gaze.kinematics import forward_gaze
from optics.layout import Layout
from optics.ports.port import port_from_spec
from reports.figures.plotting import COLOUR_MAP, INK, OUTCOME_COLOURS, STYLE, THINGS, save_figure
from rigs import Rig

MAP_COLUMNS, MAP_ROWS = 720, 360
"""Half a degree: finer than the sphere's cells, so that none is lost."""

OF_TWO_COLOURS = ("#e9c46a", "#2a9d8f", "#264653", "#d9dee5")
"""Of what the first alone sees, the second alone, both, and neither."""

GAZE_COLOUR = "#d1495b"
REACH_COLOUR = "#d9dee5"
CAUSE_COLOURS = {OUT_OF_REACH: REACH_COLOUR, **{int(outcome): OUTCOME_COLOURS[outcome] for outcome in BLOCKERS}}
CAUSE_NAMES = {
    OUT_OF_REACH: "beyond joints and mirror edges",
    **{int(outcome): THINGS[outcome] for outcome in BLOCKERS},
}
"""Why a direction is blind."""


def draw_coverage(coverage: Coverage, rig: Rig, path: Path) -> None:
    """Map of all directions around the robot: how many poses see each, and why the blind ones are blind."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 5.2), layout="constrained")
        axes = map_axes(figure, 111)
        seeing = np.where(coverage.covered, coverage.poses_seeing, np.nan)
        norm = LogNorm(vmin=1, vmax=max(2, coverage.poses_seeing.max()))
        image = paint(axes, coverage.nside, seeing, norm)
        causes = blind_causes(coverage)
        present = [cause for cause in CAUSE_NAMES if (causes == cause).any()]
        for cause in present:
            paint(axes, coverage.nside, np.where(causes == cause, 1.0, np.nan), colour=CAUSE_COLOURS[cause])
        outline_of_gaze(axes, rig)
        marks: list[Artist] = [Patch(facecolor=CAUSE_COLOURS[cause], edgecolor=INK, linewidth=0.4) for cause in present]
        names = [f"blind: {CAUSE_NAMES[cause]}" for cause in present]
        marks.append(Line2D([], [], color=GAZE_COLOUR, linewidth=1.2))
        names.append("limits of the joints, as seen along the optical axis")
        figure.legend(marks, names, loc="outside lower center", ncols=3, frameon=False, fontsize=8)
        axes.set_title(f"Directions seen through both mirrors: {coverage.covered_fraction:.1%} of the sphere", pad=14)
        figure.colorbar(image, ax=axes, label=f"poses that see it, of {coverage.solid_angle_sr.size}", shrink=0.75)
        save_figure(figure, path)


def draw_coverage_of_two(first: Coverage, second: Coverage, names: tuple[str, str], path: Path) -> None:
    """Map of the directions that both of two rigs see, or only one of them; their spheres have the same cells."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 5.2), layout="constrained")
        axes = map_axes(figure, 111)
        a, b = first.covered, second.covered
        shares = ((f"only {names[0]}", a & ~b), (f"only {names[1]}", b & ~a), ("both", a & b), ("neither", ~a & ~b))
        marks = []
        for (name, cells), colour in zip(shares, OF_TWO_COLOURS, strict=True):
            if cells.any():
                paint(axes, first.nside, np.where(cells, 1.0, np.nan), colour=colour)
            marks.append(Patch(facecolor=colour, edgecolor=INK, linewidth=0.4, label=f"{name}: {cells.mean():.1%}"))
        figure.legend(handles=marks, loc="outside lower center", ncols=4, frameon=False, fontsize=8)
        axes.set_title(f"Directions seen through both mirrors: {names[0]} and {names[1]}", pad=14)
        save_figure(figure, path)


def draw_resolution(coverage: Coverage, rig: Rig, path: Path) -> None:
    """Pixels per degree in the water: across the image, and the best that any pose gives each direction."""
    camera, port = camera_from_spec(rig.camera), port_from_spec(rig.port, rig.water)
    columns, rows = 160, 120
    across = pixels_per_degree(camera, port, columns, rows).reshape(rows, columns)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 3.7), layout="constrained")
        grid = figure.add_gridspec(1, 2, width_ratios=[1, 1.5])
        left = figure.add_subplot(grid[0])
        extent = (-0.5, camera.width_px - 0.5, camera.height_px - 0.5, -0.5)
        picture = left.imshow(np.where(across > 0, across, np.nan), extent=extent, cmap="cividis")
        figure.colorbar(picture, ax=left, shrink=0.62)
        left.set_xlabel("u (px)")
        left.set_ylabel("v (px)")
        left.set_title("Pixels per degree across the image")
        right = map_axes(figure, grid[1])
        best = np.where(coverage.covered, coverage.pixels_per_degree, np.nan)
        image = paint(right, coverage.nside, best, colour_map="cividis")
        right.set_title("Best that any pose gives a direction (grey: blind)", pad=14)
        figure.colorbar(image, ax=right, label="pixels per degree in the water", shrink=0.75)
        save_figure(figure, path)


def map_axes(figure: Figure, place: Any) -> Axes:
    """Axes of a map of all directions, at a place that `Figure.add_subplot` takes; longitude is minus azimuth."""
    axes: Axes = figure.add_subplot(place, projection="mollweide")
    axes.set_facecolor(REACH_COLOUR)
    # Matplotlib counts longitude to the right; azimuth grows to the left.
    axes.xaxis.set_major_locator(FixedLocator(np.radians(np.arange(-120, 121, 60)).tolist()))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{-round(np.degrees(x)) + 0}°"))
    axes.yaxis.set_major_locator(FixedLocator(np.radians([-60, -30, 0, 30, 60]).tolist()))
    axes.tick_params(labelsize=8)
    for label in axes.get_xticklabels():
        # These stand on the map itself.
        label.set_path_effects([withStroke(linewidth=2, foreground="white")])
    axes.set_xlabel("azimuth (0° ahead, 90° left) and elevation", fontsize=8)
    axes.grid(color=INK, alpha=0.25, linewidth=0.5)
    return axes


def paint(
    axes: Axes,
    nside: int,
    values: NDArray[np.float64],
    norm: Normalize | None = None,
    *,
    colour: str | None = None,
    colour_map: str = COLOUR_MAP,
) -> mpl.collections.QuadMesh:
    """Colour the cells of the sphere that have a value, by value or all in one colour."""
    longitude = np.linspace(-np.pi, np.pi, MAP_COLUMNS + 1)
    latitude = np.linspace(-np.pi / 2, np.pi / 2, MAP_ROWS + 1)
    x, y = np.meshgrid((longitude[1:] + longitude[:-1]) / 2, (latitude[1:] + latitude[:-1]) / 2)
    directions = np.stack([np.cos(y) * np.cos(-x), np.cos(y) * np.sin(-x), np.sin(y)], axis=-1).reshape(-1, 3)
    painted = values[cells_of(directions, nside)].reshape(y.shape)
    return axes.pcolormesh(
        longitude,
        latitude,
        np.ma.masked_invalid(painted),
        cmap=colour_map if colour is None else ListedColormap([colour]),
        norm=norm,
        rasterized=True,
    )


def outline_of_gaze(axes: Axes, rig: Rig) -> None:
    """Edge of the joint limits in gaze directions: where the optical axis itself can point."""
    layout = Layout.from_rig(rig)
    q1, q2 = layout.pan.values(181), layout.tilt.values(361)
    for pan, tilt in [(q1, q2[0]), (q1, q2[-1]), (q1[0], q2), (q1[-1], q2)]:
        gaze = forward_gaze(layout, pan, tilt)
        # A line across the seam at +-180 degrees would cross the whole map.
        jumps = np.abs(np.diff(gaze.azimuth, append=gaze.azimuth[-1:])) > np.pi
        axes.plot(-np.where(jumps, np.nan, gaze.azimuth), gaze.elevation, color=GAZE_COLOUR, linewidth=1.2)
