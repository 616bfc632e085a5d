"""Tolerances as a figure and tables: what matters most, and how large the errors are before and after calibration."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from optics.tolerance.tolerance import PERCENTILES, Errors, ToleranceStudy
from reports.figures.plotting import STYLE, save_figure
from rigs.atomic_files import csv_text, write_text

FIRST_ORDER, FROZEN = "#2a9d8f", "#e9c46a"
BUILT, CALIBRATED = "#e76f51", "#2a9d8f"


def ranking_rows(study: ToleranceStudy) -> list[dict[str, Any]]:
    """One row per tolerance, the most important first."""
    return [
        {
            "tolerance": item.source.name,
            "value": item.source.value,
            "spread": item.source.spread,
            "gaze_rms_deg": item.gaze_rms_deg,
            "gaze_share": item.gaze_share,
            "gaze_share_frozen": item.gaze_share_frozen,
            "image_rms_px": item.image_rms_px,
            "image_share": item.image_share,
            "image_share_frozen": item.image_share_frozen,
        }
        for item in study.ranking
    ]


def percentile_rows(study: ToleranceStudy) -> list[dict[str, Any]]:
    """Percentiles of the errors over all built rigs: all poses together, then pose by pose."""
    rows = []
    for name, errors in (("built", study.built), ("calibrated", study.calibrated)):
        rows.append({"rig": name, "q1_deg": None, "q2_deg": None, **_percentiles(errors)})
        for position, (q1, q2) in enumerate(study.q_deg.tolist()):
            column = Errors(gaze_deg=errors.gaze_deg[:, position], image_px=errors.image_px[:, position])
            rows.append({"rig": name, "q1_deg": round(q1, 6), "q2_deg": round(q2, 6), **_percentiles(column)})
    return rows


def _percentiles(errors: Errors) -> dict[str, float]:
    return {
        f"{name}_p{percent}": float(value)
        for name, values in errors.percentiles().items()
        for percent, value in zip(PERCENTILES, values, strict=True)
    }


def write_tolerances(study: ToleranceStudy, folder: Path) -> list[Path]:
    """Write `ranking.csv`, `percentiles.csv` and `tolerances.png` into a folder, made if there is none."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / name for name in ("ranking.csv", "percentiles.csv", "tolerances.png")]
    write_rows(files[0], ranking_rows(study))
    write_rows(files[1], percentile_rows(study))
    draw_tolerances(study, files[2])
    return files


def write_rows(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """CSV of rows that share their keys; numbers to six digits."""
    write_text(path, csv_text([rows[0] if rows else (), *([_cell(value) for value in row.values()] for row in rows)]))


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def draw_tolerances(study: ToleranceStudy, path: Path) -> None:
    """Figure: the ranking by both ways of computing it, and the gaze error of built and of calibrated rigs."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 4.6), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=[1.2, 1])
        _ranking(left, study)
        _distributions(
            right, (("as built", study.built, BUILT), ("joint offsets calibrated", study.calibrated, CALIBRATED))
        )
        save_figure(figure, path)


def _ranking(axes: Axes, study: ToleranceStudy) -> None:
    items = study.ranking
    places = np.arange(len(items))
    axes.barh(places - 0.2, [100 * item.gaze_share for item in items], 0.4, color=FIRST_ORDER, label="first order")
    frozen = [100 * item.gaze_share_frozen for item in items]
    axes.barh(places + 0.2, frozen, 0.4, color=FROZEN, label="Monte Carlo without it")
    axes.set_yticks(places, [f"{item.source.name} {item.source.value:g}" for item in items])
    axes.invert_yaxis()
    axes.set_xlabel("share of the mean squared gaze error (%)")
    axes.set_title("What matters")
    axes.legend(loc="lower right", frameon=False)


def _distributions(axes: Axes, groups: Iterable[tuple[str, Errors, str]]) -> None:
    for name, errors, colour in groups:
        values = np.sort(errors.gaze_deg.ravel())
        share = 100 * (np.arange(len(values)) + 1) / len(values)
        every = max(1, len(values) // 2000)
        axes.plot(values[::every], share[::every], color=colour, label=name)
    axes.set_xlabel("gaze error (degrees)")
    axes.set_ylabel("rigs and poses with less (%)")
    axes.set_xlim(left=0)
    axes.set_ylim(0, 100)
    axes.grid(alpha=0.3)
    axes.set_title("Gaze error")
    axes.legend(loc="lower right", frameon=False)
