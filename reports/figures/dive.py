"""Figures of a dive: the paper's 13 (errors) and 14 (commands) with the truth beside, and one it had to leave out.

Black is what was measured with a detection, red what rests on the filter's prediction, purple boxes are the times in
which the detector has lost the target, as in the paper.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pyarrow as pa
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from dives.metrics.causes import Cause
from dives.metrics.frames import BoolArray, Frames
from dives.metrics.holding import LOSS_FRAMES, runs
from dives.metrics.pointing import crop_centre_px, pointing_metrics
from optics.kernels.arrays import FloatArray
from reports.figures.plotting import INK, STYLE, save_figure
from tracking.records import Mode

DETECTED = "black"
PREDICTED = "#d7301f"
LOST = "#7b3294"
TRUTH = "#2a7fb8"
LINE_WIDTH = 0.9

CAUSE_COLOURS = {
    Cause.NOT_IN_VIEW: "#94a3b8",
    Cause.SLEWING: "#2a9d8f",
    Cause.HIDDEN_BY_HULL: "#e9c46a",
    Cause.HIDDEN_BY_MOUNT: "#e76f51",
    Cause.HIDDEN_BY_WORLD: "#8a5a44",
    Cause.TOO_SMALL: "#6d597a",
    Cause.SATURATED: "#f9a8d4",
    Cause.TOO_DARK: "#111827",
    Cause.COLOUR: "#9b2226",
}
MODE_COLOURS = {Mode.CHECK: "#cbd5e1", Mode.SCAN: "#93c5fd", Mode.TRACK: "#2a9d8f", Mode.PREDICT: PREDICTED}

SHORTEST_AXIS_S = 0.1
"""A log of one frame lasts no time at all, and still needs an axis."""

SMALLEST_ERROR_DEG = 0.01
"""Where the logarithmic axis of the gaze error begins: nothing here is known better."""


def write_dive_figures(table: pa.Table, folder: Path) -> list[Path]:
    """Draw all three into a folder; the figure of the errors first, then commands, then the true gaze error."""
    files = [folder / name for name in ("errors.png", "commands.png", "gaze_error.png")]
    for draw, file in zip((draw_errors, draw_commands, draw_gaze_error), files, strict=True):
        draw(table, file)
    return files


def draw_errors(table: pa.Table, path: Path) -> None:
    """Figure 13: error in the crop on both axes over time as the loop measures it, and beside it the true one.

    Parameters
    ----------
    table : pyarrow.Table
        Log of a dive.
    path : Path
        PNG; the same log gives the same bytes.
    """
    frames = Frames.of(table)
    centre = crop_centre_px(frames)
    measured = [frames.numbers[f"error_{axis}_px"] for axis in "xy"]
    true = _inside(np.stack([frames.numbers[f"true_{axis}_px"] - centre[k] for k, axis in enumerate("xy")]), centre)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 4.6), layout="constrained")
        axes = figure.subplots(2, 2, sharex=True, sharey="row")
        for row, name in enumerate(("x, to the right", "y, downwards")):
            _draw_by_state(axes[row, 0], frames, measured[row])
            _draw_truth(axes[row, 1], frames, true[row])
            axes[row, 0].set_ylabel(f"error in {name} (px)")
            _limit_to_crop(axes[row, 0], [measured[row], true[row]], centre[row])
        axes[0, 0].set_title("As the loop has it (figure 13)")
        axes[0, 1].set_title("True: where the target's centre is in the crop")
        _finish(figure, axes, frames, path)


def draw_commands(table: pa.Table, path: Path) -> None:
    """Figure 14: commands to both servos over time, and beside them how far the joints are from them."""
    frames = Frames.of(table)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 4.6), layout="constrained")
        axes = figure.subplots(2, 2, sharex=True)
        for row, (joint, name) in enumerate((("q1", "q1, pan"), ("q2", "q2, tilt"))):
            asked, true = (frames.numbers[f"{joint}_{kind}_deg"] for kind in ("command", "true"))
            _draw_by_state(axes[row, 0], frames, asked)
            _draw_truth(axes[row, 1], frames, true - asked)
            axes[row, 0].set_ylabel(f"{name} (degrees)")
        axes[0, 0].set_title("Commands (figure 14)")
        axes[0, 1].set_title("True: joint less command of the same frame")
        _finish(figure, axes, frames, path)


def draw_gaze_error(table: pa.Table, path: Path) -> None:
    """What the paper could not draw: true angle between optical axis and target, why it was lost, and the mode."""
    frames = Frames.of(table)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.5, 3.9), layout="constrained")
        upper, causes, modes = figure.subplots(3, 1, sharex=True, height_ratios=[8, 1, 1])
        error = frames.numbers["gaze_error_deg"]
        upper.semilogy(frames.time_s, np.maximum(error, SMALLEST_ERROR_DEG), color=TRUTH, linewidth=LINE_WIDTH)
        rms = pointing_metrics(frames)["gaze_error_held_rms_deg"]
        if isinstance(rms, float) and rms > 0:
            upper.axhline(rms, color=INK, linewidth=0.8, linestyle="--")
            upper.set_title(f"dashed: RMS while held, {rms:.2f}°", loc="right", fontsize=8)
        upper.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        upper.yaxis.set_major_formatter("{x:g}")
        upper.yaxis.set_minor_formatter(NullFormatter())
        upper.set_ylabel("true gaze error (degrees)")
        upper.set_title("How far the gaze is off the target", loc="left")
        _bars(causes, frames, frames.cause, CAUSE_COLOURS, "not found")
        _bars(modes, frames, frames.mode, MODE_COLOURS, "mode")
        modes.set_xlabel("time (s)")
        modes.set_xlim(*_span(frames))
        save_figure(figure, path)


def _inside(from_centre_px: FloatArray, centre_px: FloatArray) -> FloatArray:
    """Places in the crop, shape (2, n), nan where they are outside of it."""
    return np.where((np.abs(from_centre_px) <= centre_px[:, np.newaxis] + 0.5).all(axis=0), from_centre_px, np.nan)


def _limit_to_crop(axes: Axes, signals: list[FloatArray], half_px: float) -> None:
    """Show what is in the crop: a prediction far outside of it would flatten all the rest."""
    largest = max((float(np.nanmax(np.abs(signal))) for signal in signals if np.isfinite(signal).any()), default=0.0)
    limit = float(np.nanmin([largest * 1.05, half_px + 0.5]))
    if limit > 0:
        axes.set_ylim(-limit, limit)


def _draw_by_state(axes: Axes, frames: Frames, signal: FloatArray) -> None:
    """Signal, black with a detection, red without; each piece reaches to its neighbour so that the line is whole."""
    without = ~frames.detected
    bridged = without | np.append(without[1:], False) | np.insert(without[:-1], 0, False)
    axes.plot(frames.time_s, np.where(bridged, signal, np.nan), color=PREDICTED, linewidth=LINE_WIDTH)
    axes.plot(frames.time_s, np.where(frames.detected, signal, np.nan), color=DETECTED, linewidth=LINE_WIDTH)
    # A detection between two frames without has no line of its own.
    alone = frames.detected & ~np.append(frames.detected[1:], False) & ~np.insert(frames.detected[:-1], 0, False)
    axes.plot(frames.time_s[alone], signal[alone], ".", color=DETECTED, markersize=2)
    _box_losses(axes, frames)


def _draw_truth(axes: Axes, frames: Frames, signal: FloatArray) -> None:
    axes.plot(frames.time_s, signal, color=TRUTH, linewidth=LINE_WIDTH)
    _box_losses(axes, frames)


def _box_losses(axes: Axes, frames: Frames) -> None:
    axes.axhline(0, color=INK, linewidth=0.4)
    # The functional check does not look: what is detected then is not followed, and cannot be lost.
    for first, end in detector_losses(frames.detected & frames.looking):
        start, stop = frames.time_s[first], frames.time_s[end - 1] + frames.lasts_s[end - 1]
        axes.axvspan(start, stop, facecolor=(*mpl.colors.to_rgb(LOST), 0.12), edgecolor=LOST, linewidth=0.6)


def detector_losses(detected: BoolArray) -> list[tuple[int, int]]:
    """First and one past the last frame of the purple boxes: longer gaps in the detections, once there was one."""
    seen = np.maximum.accumulate(detected) if len(detected) else detected
    return [(first, end) for first, end in runs(~detected & seen) if end - first > LOSS_FRAMES]


def _finish(figure: Figure, axes: NDArray[np.object_], frames: Frames, path: Path) -> None:
    for axis in axes[-1]:
        axis.set_xlabel("time (s)")
        axis.set_xlim(*_span(frames))
    lines = [
        Line2D([], [], color=DETECTED, label="with a detection"),
        Line2D([], [], color=PREDICTED, label="without: prediction or scan"),
        Patch(facecolor=(*mpl.colors.to_rgb(LOST), 0.12), edgecolor=LOST, label="lost by the detector"),
        Line2D([], [], color=TRUTH, label="ground truth"),
    ]
    figure.legend(handles=lines, loc="outside lower center", ncols=4, frameon=False, fontsize=8)
    save_figure(figure, path)


def _bars(
    axes: Axes, frames: Frames, words: NDArray[np.str_], colours: Mapping[Cause, str] | Mapping[Mode, str], name: str
) -> None:
    """One row of bars, coloured by a word per frame; a word that never occurs needs no line in the legend."""
    shown = []
    for word, colour in colours.items():
        spans = [
            (frames.time_s[first], frames.time_s[end - 1] + frames.lasts_s[end - 1] - frames.time_s[first])
            for first, end in runs(words == word)
        ]
        if spans:
            axes.broken_barh(spans, (0, 1), facecolors=colour)
            shown.append(Patch(color=colour, label=str(word)))
    axes.set_yticks([])
    axes.set_ylim(0, 1)
    axes.set_ylabel(name, rotation=0, ha="right", va="center")
    if shown:
        beside = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5), "ncols": 1 + (len(shown) - 1) // 4}
        axes.legend(handles=shown, frameon=False, fontsize=7, **beside)


def _span(frames: Frames) -> tuple[float, float]:
    start, end = float(frames.time_s[0]), float(frames.time_s[-1] + frames.lasts_s[-1])
    return start, max(end, start + SHORTEST_AXIS_S)
