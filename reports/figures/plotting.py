"""Figures of usable field of view and coverage, as PNG files whose bytes depend on the data alone."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from optics.coverage.coverage import Coverage
from optics.coverage.outcome import Outcome
from optics.status import Region
from rigs.atomic_files import atomic_file

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

OUTCOME_COLOURS = {
    Outcome.SEEN: "#2a9d8f",
    Outcome.HULL: "#e9c46a",
    Outcome.FOLD_BRACKET: "#f4a261",
    Outcome.MOUNT: "#e76f51",
    Outcome.SERVO: "#9b2226",
    Outcome.MIRROR_PLATE: "#6d597a",
    Outcome.BACK_OF_MIRROR: "#b56576",
    Outcome.MISSED_M2: "#94a3b8",
    Outcome.MISSED_M1: "#cbd5e1",
    Outcome.PORT_RIM: "#111827",
    Outcome.TOTAL_REFLECTION: "#374151",
    Outcome.OUTSIDE_CAMERA_MODEL: "#6b7280",
}

OUTCOME_NAMES = {
    Outcome.SEEN: "seen through both mirrors",
    Outcome.HULL: "lost to the hull",
    Outcome.FOLD_BRACKET: "lost to the fold mirror's bracket",
    Outcome.MOUNT: "lost to the gimbal's parts",
    Outcome.SERVO: "lost to the servos",
    Outcome.MIRROR_PLATE: "lost to the mirrors' plates",
    Outcome.BACK_OF_MIRROR: "back of a mirror",
    Outcome.MISSED_M2: "past M2's edge (fold view)",
    Outcome.MISSED_M1: "past M1's edge (direct view)",
    Outcome.PORT_RIM: "port's rim",
    Outcome.TOTAL_REFLECTION: "total reflection at the port",
    Outcome.OUTSIDE_CAMERA_MODEL: "beyond the camera's model",
}

THINGS = {
    Outcome.SEEN: "open water",
    Outcome.HULL: "hull",
    Outcome.FOLD_BRACKET: "fold mirror's bracket",
    Outcome.MOUNT: "gimbal's parts",
    Outcome.SERVO: "servos",
    Outcome.MIRROR_PLATE: "mirrors' plates",
    Outcome.BACK_OF_MIRROR: "back of a mirror",
}
"""What a region of the image shows."""

REGION_NAMES = {
    Region.GAZE: "gaze (both mirrors)",
    Region.FOLD: "fold view (M1 only)",
    Region.DIRECT: "direct view (no mirror)",
}


def draw_usable_fov(coverage: Coverage, path: Path) -> None:
    """Map of the solid angle seen through both mirrors over the joint values, and where the rest of the image goes."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 3.9), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=[1.15, 1])
        _solid_angle_map(left, coverage)
        _shares(right, coverage)
        save_figure(figure, path)


def draw_regions(coverage: Coverage, path: Path) -> None:
    """What each region of the image shows, mean over the poses: bars as long as the region is large."""
    shown = coverage.solid_angle_by_region_sr.mean(axis=(0, 1)) * 1000
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 2.7), layout="constrained")
        axes = figure.subplots()
        regions = list(REGION_NAMES)
        left = np.zeros(len(regions))
        for outcome, name in THINGS.items():
            widths = shown[regions, outcome]
            if widths.any():
                axes.barh(
                    range(len(regions)), widths, left=left, color=OUTCOME_COLOURS[outcome], label=name, height=0.6
                )
            left = left + widths
        for k, region in enumerate(regions):
            axes.text(left[k] + left.max() * 0.01, k, f"{left[k]:.0f} msr", va="center", fontsize=8)
            total = shown[region].sum()
            open_water = shown[region, Outcome.SEEN] / total if total else 0
            if open_water:
                axes.text(left.max() * 0.005, k, f"{open_water:.0%}", va="center", fontsize=8, color="white")
        axes.set_yticks(range(len(regions)), [REGION_NAMES[region] for region in regions])
        axes.set_xlim(0, left.max() * 1.1)
        axes.set_xlabel("mean solid angle in the water (msr); white: share of open water")
        axes.invert_yaxis()
        axes.set_title("What each region of the image shows")
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=8)
        save_figure(figure, path)


def draw_dwell(coverage: Coverage, path: Path) -> None:
    """Histogram of the number of poses that see a direction: how redundant the coverage is."""
    poses = coverage.solid_angle_sr.size
    seeing = coverage.poses_seeing
    # Whole numbers of poses between edges on halves, in steps that look alike on the logarithmic axis.
    edges = np.unique(np.round(np.geomspace(1, max(2, seeing.max()) + 1, 30))) - 0.5
    counts = np.histogram(seeing, edges)[0] / len(seeing) * 100
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 2.8), layout="constrained")
        axes = figure.subplots()
        axes.bar(
            edges[:-1], counts, width=np.diff(edges), align="edge", color=OUTCOME_COLOURS[Outcome.SEEN], edgecolor="w"
        )
        median = float(np.median(seeing[coverage.covered])) if coverage.covered.any() else 0.0
        if median:
            axes.axvline(median, color=INK, linewidth=1, linestyle="--")
            axes.text(median * 1.03, 0.93, f"median {median:.0f}", transform=axes.get_xaxis_transform(), fontsize=8)
            axes.set_ylim(top=counts.max() * 1.15)
        axes.set_xscale("log")
        axes.set_xlabel(f"poses that see a direction, of {poses}")
        axes.set_ylabel("share of the sphere (%)")
        axes.set_title(f"How many poses see a direction (not shown: {coverage.blind_fraction:.1%} that none sees)")
        save_figure(figure, path)


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
    # A cause that never occurs needs no line in the legend.
    outcomes = [outcome for outcome in OUTCOME_NAMES if counts[:, outcome].any()]
    shares = [counts[:, outcome] / counts.sum(axis=1) * 100 for outcome in outcomes]
    names, colours = (
        [OUTCOME_NAMES[outcome] for outcome in outcomes],
        [OUTCOME_COLOURS[outcome] for outcome in outcomes],
    )
    axes.stackplot(q2, shares, labels=names, colors=colours)
    axes.set_xlim(q2[0], q2[-1])
    axes.set_ylim(0, 100)
    axes.set_xlabel("q2, tilt (degrees)")
    axes.set_ylabel("share of the image (%)")
    axes.set_title("Where the image's pixels go")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=8, reverse=True)


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as PNG; the same data gives the same bytes."""
    FigureCanvasAgg(figure)
    with atomic_file(path) as partial:
        figure.savefig(partial, dpi=RESOLUTION_DPI, metadata={"Software": None})
