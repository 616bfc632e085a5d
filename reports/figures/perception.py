"""Figures of perception: the error of interpolated corners over the joints, and the steps from image to mask."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.figures.plotting import COLOUR_MAP, INK, STYLE, save_figure
from tracking.perception.corners.errors import CornerError

if TYPE_CHECKING:
    # It renders; what draws the maps of corners need not load the renderer.
    from dives.evaluation.detector_evaluation import Detector, EvaluationImage

OUTLINE, FOUND, TRUE = "#2a9d8f", "#e76f51", "#00e5ff"

SHOWN_PX = (1, 2, 5, 10, 20, 50, 100)
"""Marks of the logarithmic axis of errors."""


def draw_corner_errors(errors: Mapping[tuple[int, float], CornerError], path: Path, *, power: float) -> None:
    """Figure: maps over (q1, q2) for one power, one for each number of samples, and the error of every power.

    Parameters
    ----------
    errors : mapping
        By number of samples and power.
    path : Path
        PNG.
    power : float
        Of the maps.
    """
    counts, powers = (sorted({key[place] for key in errors}) for place in (0, 1))
    largest = max(errors[int(count), power].largest_px for count in counts)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(2.6 * len(counts) + 3.2, 3.2), layout="constrained")
        axes = figure.subplots(1, len(counts) + 1, width_ratios=[1.0] * len(counts) + [1.15])
        for place, count in enumerate(counts):
            image = _map(axes[place], errors[int(count), power], largest)
            axes[place].set_title(f"N = {count:.0f}, p = {power:g}")
            if place == 0:
                axes[place].set_ylabel("q2, tilt (degrees)")
        figure.colorbar(image, ax=axes[:-1], label="corner error (px, rms of four)", shrink=0.9)
        for each in powers:
            values = [errors[int(count), each].rms_px for count in counts]
            axes[-1].loglog(counts, values, marker="o", markersize=4, label=f"p = {each:g}")
        axes[-1].set_xticks(counts, [f"{count:.0f}" for count in counts])
        axes[-1].set_yticks(SHOWN_PX, [f"{each:d}" for each in SHOWN_PX])
        axes[-1].minorticks_off()
        axes[-1].set_xlabel("samples N")
        axes[-1].set_ylabel("corner error (px, rms)")
        axes[-1].set_title("over all poses")
        axes[-1].grid(alpha=0.3, which="both")
        axes[-1].legend(loc="upper right", frameon=False)
        save_figure(figure, path)


def _map(axes: Axes, error: CornerError, largest_px: float) -> mpl.image.AxesImage:
    q1, q2 = np.degrees(error.q1), np.degrees(error.q2)
    image = axes.imshow(
        error.error_px.T,
        origin="lower",
        extent=(q1[0], q1[-1], q2[0], q2[-1]),
        aspect="auto",
        cmap=COLOUR_MAP,
        vmin=0,
        vmax=largest_px,
    )
    axes.set_xlabel("q1, pan (degrees)")
    return image


def draw_detection(images: Sequence[EvaluationImage], detector: Detector, path: Path) -> None:
    """Figure: for each image the mirror's outline in it, the crop with what was found, and the mask (figure 8)."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(3.2 * len(images), 7.0), layout="constrained")
        rows = figure.subplots(3, len(images), squeeze=False)
        for (whole, crop, mask), each in zip(rows.T, images, strict=True):
            detection = detector(each)
            whole.imshow(each.image)
            outline = np.vstack([each.corners_px, each.corners_px[:1]])
            whole.plot(*outline.T, color=OUTLINE, linewidth=1.5)
            whole.plot(*each.corners_px[0], marker="o", color=OUTLINE, markersize=5)
            whole.set_xlim(-0.5, each.image.shape[1] - 0.5)
            whole.set_ylim(each.image.shape[0] - 0.5, -0.5)
            whole.set_title(f"{each.distance_m:.1f} m away, {each.elevation_deg:+.0f} degrees")
            crop.imshow(each.crop)
            crop.contour(each.target, levels=[0.5], colors=[TRUE], linewidths=0.8)
            mask.imshow(detection.mask, cmap="gray", vmin=0, vmax=255)
            for blob in detection.blobs:
                x, y, width, height = blob.box_px
                for axes in (crop, mask):
                    axes.add_patch(
                        mpl.patches.Rectangle((x - 0.5, y - 0.5), width, height, edgecolor=FOUND, facecolor="none")
                    )
            if detection.centroid_px is not None:
                mask.plot(*detection.centroid_px, marker="+", color=FOUND, markersize=10)
            for axes in (whole, crop, mask):
                axes.set_xticks([])
                axes.set_yticks([])
                axes.spines[:].set_color(INK)
        for axes, name in zip(rows[:, 0], ("image", "crop", "mask"), strict=True):
            axes.set_ylabel(name)
        save_figure(figure, path)
