"""Figures of usable field of view and coverage, as PNG files whose bytes depend on the data alone."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from optics.analysis import Coverage, Fate
from optics.gaze import forward_gaze
from optics.layout import Layout
from rigs import Rig

INK = "#1c2b39"
COLOUR_MAP = "viridis"
RESOLUTION_DPI = 110

STYLE = {
    "font.size": 9,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
}

FATE_COLOURS = {
    Fate.SEEN: "#2a9d8f",
    Fate.HULL: "#e9c46a",
    Fate.MOUNT: "#e76f51",
    Fate.FOLD_MIRROR: "#6d597a",
    Fate.BACK_OF_MIRROR: "#b56576",
    Fate.MISSED_M2: "#94a3b8",
    Fate.MISSED_M1: "#cbd5e1",
    Fate.PORT: "#111827",
}

FATE_NAMES = {
    Fate.SEEN: "seen through both mirrors",
    Fate.HULL: "lost to the hull",
    Fate.MOUNT: "lost to mount and servos",
    Fate.FOLD_MIRROR: "lost to the mirrors' plates",
    Fate.BACK_OF_MIRROR: "back of a mirror",
    Fate.MISSED_M2: "past M2 (fold view)",
    Fate.MISSED_M1: "past M1 (direct view)",
    Fate.PORT: "port's rim",
}


def draw_usable_fov(coverage: Coverage, path: Path) -> None:
    """Map of the solid angle seen through both mirrors over the joint values, and where the rest of the image goes."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 3.9), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=[1.15, 1])
        _solid_angle_map(left, coverage)
        _shares(right, coverage)
        _save(figure, path)


def draw_coverage(coverage: Coverage, rig: Rig, path: Path) -> None:
    """Map of all directions around the robot: how densely each is looked at; equal areas are equal."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 4.2), layout="constrained")
        axes = figure.subplots()
        looks = np.where(coverage.covered, coverage.sphere / coverage.solid_angle_sr.size, np.nan)
        image = axes.imshow(
            looks,
            origin="lower",
            extent=(-180, 180, -1, 1),
            aspect="auto",
            cmap=COLOUR_MAP,
            norm=LogNorm(),
            interpolation="nearest",
        )
        axes.set_facecolor("#e5e7eb")
        axes.set_xlim(180, -180)  # the robot's left is on the left
        degrees = np.array([-90, -60, -45, -30, -15, 0, 15, 30, 45, 60, 90])
        axes.set_yticks(np.sin(np.radians(degrees)), [f"{value}" for value in degrees])
        axes.set_xticks(np.arange(-180, 181, 30))
        axes.set_xlabel("azimuth (degrees; 0 ahead, 90 left)")
        axes.set_ylabel("elevation (degrees)")
        covered = coverage.covered_fraction * 100
        axes.set_title(f"Directions seen through both mirrors: {covered:.1f} % of the sphere (grey: never seen)")
        _outline_of_gaze(axes, rig)
        figure.colorbar(image, ax=axes, label="rays into the cell per pose")
        _save(figure, path)


def _solid_angle_map(axes: Axes, coverage: Coverage) -> None:
    mesh = axes.pcolormesh(coverage.q1_deg, coverage.q2_deg, coverage.solid_angle_sr * 1000, cmap=COLOUR_MAP, vmin=0)
    axes.set_xlabel("q1, pan (degrees)")
    axes.set_ylabel("q2, tilt (degrees)")
    axes.set_title("Usable field of view (msr)")
    axes.figure.colorbar(mesh, ax=axes)


def _shares(axes: Axes, coverage: Coverage) -> None:
    """Stacked shares of the image over tilt, averaged over pan."""
    q2 = coverage.q2_deg
    counts = coverage.pixels.mean(axis=1)
    shares = [counts[:, fate] / counts.sum(axis=1) * 100 for fate in FATE_NAMES]
    axes.stackplot(q2, shares, labels=list(FATE_NAMES.values()), colors=[FATE_COLOURS[fate] for fate in FATE_NAMES])
    axes.set_xlim(q2[0], q2[-1])
    axes.set_ylim(0, 100)
    axes.set_xlabel("q2, tilt (degrees)")
    axes.set_ylabel("share of the image (%)")
    axes.set_title("Where the image's pixels go")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=8, reverse=True)


def _outline_of_gaze(axes: Axes, rig: Rig) -> None:
    """Edge of the joint limits in gaze directions: where the optical axis itself can look."""
    layout = Layout.from_rig(rig)
    q1 = np.radians(np.linspace(layout.pan.min_deg, layout.pan.max_deg, 181))
    q2 = np.radians(np.linspace(layout.tilt.min_deg, layout.tilt.max_deg, 361))
    edges = [(q1, q2[0]), (q1, q2[-1]), (q1[0], q2), (q1[-1], q2)]
    for pan, tilt in edges:
        gaze = forward_gaze(layout, pan, tilt)
        azimuth = np.degrees(gaze.azimuth)
        # A line across the seam at +-180 degrees would cross the whole map.
        azimuth = np.where(np.abs(np.diff(azimuth, append=azimuth[-1:])) > 180, np.nan, azimuth)
        axes.plot(azimuth, np.sin(gaze.elevation), color="#d1495b", linewidth=1.2)


def _save(figure: Figure, path: Path) -> None:
    FigureCanvasAgg(figure)
    partial = path.with_name(f".{path.stem}.partial.png")
    figure.savefig(partial, dpi=RESOLUTION_DPI, metadata={"Software": None})
    partial.replace(path)
