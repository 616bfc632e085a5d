"""Sizing in figures and tables: outlines on both mirrors, and the trade-off over the distances d1 and d2."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from optics.kernels.arrays import FloatArray
from optics.sizing.outlines import Outlines
from optics.sizing.sizing import Sizing
from optics.sizing.trade_off import TradeOff
from reports.figures import plotting
from reports.figures.plotting import COLOUR_MAP, INK, STYLE
from rigs import Rig
from rigs.atomic_files import csv_text, write_text

OUTLINE_COLOURS = {
    "rectangle": "#1c2b39",
    "octagon": "#e76f51",
    "ellipse": "#8a5fbf",
    "free rectangle": "#94a3b8",
    "convex": "#2a9d8f",
}

DECIMALS_MM = 3
"""Corners are written to a micrometre, the step to which the convex outline is simplified."""


def trade_off_figure(result: TradeOff, rig: Rig) -> Figure:
    """Six maps over (d1, d2); a cross where a design does not fit, a ring at the rig's own distances."""
    panels = [
        ("M1 (cm²)", result.m1_cm2),
        ("M2 (cm²)", result.m2_cm2),
        ("view lost to the hull (%)", 100 * result.hull_share),
        ("view lost to the mirrors' plates (%)", 100 * result.plate_share),
        ("moment of the plates along x (g m)", 1000 * result.moment_kg_m[..., 0]),
        ("swept by M2 (litres)", result.sphere_l),
    ]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10.5, 6.2), layout="constrained")
        for axes, (title, values) in zip(figure.subplots(2, 3).flat, panels, strict=True):
            _map(axes, title, values, result, rig)
        figure.suptitle("Mirrors sized for the same view at each pair of distances (× does not fit)")
    return figure


def outlines_figure(sizing: Sizing) -> Figure:
    """Outlines of both mirrors in their own axes."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 4.4), layout="constrained")
        for axes, (name, outlines) in zip(figure.subplots(1, 2), _mirrors(sizing), strict=True):
            axes.set_xlabel("x (mm)")
            axes.set_ylabel("y (mm)")
            axes.set_title(name if outlines else f"{name}: no finite mirror does")
            if outlines is None:
                continue
            for kind, colour in OUTLINE_COLOURS.items():
                corners = 1000 * outlines.corners_m(kind)
                closed = np.vstack([corners, corners[:1]])
                axes.plot(*closed.T, color=colour, label=f"{kind}, {1e4 * outlines.area_m2(kind):.1f} cm²")
            axes.plot(0, 0, "+", color=INK)
            axes.set_aspect("equal", adjustable="datalim")
            axes.legend(fontsize=7, frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2)
    return figure


def save_figure(figure: Figure, path: Path) -> None:
    """Write one of these figures as PNG; the same data gives the same bytes."""
    with mpl.rc_context(STYLE):
        plotting.save_figure(figure, path)


def write_trade_off(result: TradeOff, path: Path) -> None:
    """One row per design, as CSV."""
    rows = trade_off_rows(result)
    write_text(path, csv_text([rows[0], *(row.values() for row in rows)]))


def trade_off_rows(result: TradeOff) -> list[dict[str, Any]]:
    """The trade-off as plain data, a dictionary per design; None where no finite mirror does."""
    rows = []
    for j, d2 in enumerate(result.d2_mm):
        for i, d1 in enumerate(result.d1_mm):
            numbers = {
                "d1_mm": d1,
                "d2_mm": d2,
                "m1_width_mm": result.m1_mm[j, i, 0],
                "m1_height_mm": result.m1_mm[j, i, 1],
                "m2_width_mm": result.m2_mm[j, i, 0],
                "m2_height_mm": result.m2_mm[j, i, 1],
                "m1_cm2": result.m1_cm2[j, i],
                "m2_cm2": result.m2_cm2[j, i],
                "lost_to_hull": result.hull_share[j, i],
                "lost_to_plates": result.plate_share[j, i],
                "plates_kg": result.mass_kg[j, i],
                **{f"moment_{axis}_kg_m": value for axis, value in zip("xyz", result.moment_kg_m[j, i], strict=True)},
                "swept_sphere_l": result.sphere_l[j, i],
                "swept_cylinder_l": result.cylinder_l[j, i],
            }
            plain = {name: round(float(value), 6) if np.isfinite(value) else None for name, value in numbers.items()}
            rows.append({**plain, "binds": result.constraint[j][i]})
    return rows


def outlines_as_data(sizing: Sizing) -> dict[str, Any]:
    """Outlines of both mirrors as plain data: corners (mm, in the mirror's axes) and area; None where there is none."""
    data: dict[str, Any] = {}
    for name, outlines in _mirrors(sizing):
        data[name] = outlines and {
            kind: {"area_cm2": round(1e4 * outlines.area_m2(kind), 3), "corners_mm": _mm(outlines.corners_m(kind))}
            for kind in OUTLINE_COLOURS
        }
    return data


def write_outlines(sizing: Sizing, path: Path) -> None:
    """Outlines as JSON."""
    write_text(path, json.dumps(outlines_as_data(sizing), indent=1))


def _mirrors(sizing: Sizing) -> tuple[tuple[str, Outlines | None], ...]:
    return ("M1", sizing.m1), ("M2", sizing.m2)


def _mm(corners_m: FloatArray) -> list[list[float]]:
    return [[float(value) for value in corner] for corner in np.round(1000 * corners_m, DECIMALS_MM)]


def _map(axes: Axes, title: str, values: FloatArray, result: TradeOff, rig: Rig) -> None:
    gaze = rig.require_gaze()
    image = axes.pcolormesh(result.d1_mm, result.d2_mm, values, cmap=COLOUR_MAP, shading="nearest")
    axes.figure.colorbar(image, ax=axes)
    d1, d2 = np.meshgrid(result.d1_mm, result.d2_mm)
    axes.plot(d1[~result.fits], d2[~result.fits], "x", color="white", markeredgecolor="white", markersize=5)
    axes.plot(
        gaze.fold_mirror.distance_mm,
        gaze.gaze_mirror.distance_mm,
        "o",
        color="none",
        markeredgecolor="#d1495b",
        markersize=10,
        markeredgewidth=1.6,
    )
    axes.set_title(title)
    axes.set_xlabel("d1 (mm)")
    axes.set_ylabel("d2 (mm)")
