"""A drill template at 1:1: where the mount's screws go into the hull, on A4 with a bar to check the print by."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch

from cad.export.drawings.manifest import HASH_DIGITS, rig_hash
from cad.export.drawings.sheet import POINTS_PER_MM, STYLE, THIN_MM
from cad.parts.flange import (
    BOLT_IN_HULL_MM,
    CORNER_RADIUS_MM,
    Seat,
    bolt_places,
    fold_seat,
)
from cad.parts.gimbal_base import base_placement, flange_seat
from cad.parts.gimbal_dimensions import GimbalDimensions
from optics.layout import Layout
from rigs import Rig

WIDTH_MM, HEIGHT_MM = 210.0, 297.0
CENTRES_MM = {"fold": (105.0, 200.0), "base": (105.0, 110.0)}
"""Of the flanges on the sheet, from its lower left corner."""
BAR_MM = 100.0
BAR_AT_MM = (55.0, 30.0)
CROSS_MM = 4.0
TAP_DRILL_MM = 3.3
"""For M4, ISO 2306."""
NAMES = {"fold": "Fold bracket", "base": "Gimbal base"}


def screwed_seats(rig: Rig) -> dict[str, Seat]:
    """Seats whose flange is screwed into the hull, by the end of the mount; body frame."""
    dimensions, layout = GimbalDimensions.from_rig(rig), Layout.from_rig(rig)
    seats = {"fold": fold_seat(rig), "base": flange_seat(rig, base_placement(dimensions, layout))}
    return {end: seat for end, seat in seats.items() if seat.attachment == "screws"}


def write_drill_template(rig: Rig, path: Path) -> list[Path]:
    """Write the template as a PDF of A4; none for a mount that needs no hole in the hull."""
    seats = screwed_seats(rig)
    if not seats:
        return []
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH_MM / 25.4, HEIGHT_MM / 25.4))
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set_xlim(0, WIDTH_MM)
        axes.set_ylim(0, HEIGHT_MM)
        axes.set_axis_off()
        _head(axes, rig)
        _bar(axes)
        for end, seat in seats.items():
            _flange(axes, end, seat)
        figure.savefig(path, metadata={"CreationDate": None, "Creator": "mirrorgaze", "Producer": None})
    return [path]


def hole_places_mm(seats: Mapping[str, Seat]) -> dict[str, list[tuple[float, float]]]:
    """Where the holes are on the sheet, from its lower left corner, by the end of the mount."""
    return {end: [(CENTRES_MM[end][0] + x, CENTRES_MM[end][1] + y) for x, y in bolt_places()] for end in seats}


def _head(axes: Axes, rig: Rig) -> None:
    _text(axes, (20, 280), f"{rig.name}: drill template 1:1", size_mm=5.0)
    words = "Print on A4 without scaling (100 %), and measure the bar below before you drill."
    _text(axes, (20, 272), f"{words}  Rig {rig_hash(rig)[:HASH_DIGITS]}.")
    _text(axes, (20, 266), "Seen from outside onto the hull. The cross is the anchor of the rig file.")


def _bar(axes: Axes) -> None:
    x, y = BAR_AT_MM
    _line(axes, (x, y), (x + BAR_MM, y))
    for tick in np.arange(0, BAR_MM + 1, 10):
        _line(axes, (x + tick, y), (x + tick, y + (4 if tick % 50 == 0 else 2)))
    _text(axes, (x + BAR_MM / 2, y - 4), f"{BAR_MM:g} mm", ha="center")


def _flange(axes: Axes, end: str, seat: Seat) -> None:
    centre = np.array(CENTRES_MM[end])
    corner = centre - np.array([seat.length_mm, seat.width_mm]) / 2
    inner = corner + CORNER_RADIUS_MM
    size = seat.length_mm - 2 * CORNER_RADIUS_MM, seat.width_mm - 2 * CORNER_RADIUS_MM
    style = f"round,pad={CORNER_RADIUS_MM:g}"
    axes.add_patch(FancyBboxPatch((inner[0], inner[1]), *size, boxstyle=style, fill=False, lw=THIN_MM * POINTS_PER_MM))
    _cross(axes, (centre[0], centre[1]))
    for place in hole_places_mm({end: seat})[end]:
        _cross(axes, place)
        axes.add_patch(Circle(place, TAP_DRILL_MM / 2, fill=False, lw=THIN_MM * POINTS_PER_MM))
    along, anchor = seat.body_from_seat.rotation.as_matrix()[:, 0], 1000 * seat.body_from_seat.translation
    tip = centre + np.array([seat.length_mm / 2 + 14, 0])
    _line(axes, (centre[0] + seat.length_mm / 2 + 2, centre[1]), (tip[0], tip[1]))
    for side in (-1, 1):
        _line(axes, (tip[0], tip[1]), (tip[0] - 3, tip[1] + 1.2 * side))
    _text(axes, (tip[0] + 2, tip[1]), f"along ({_numbers(along, 2)}) of the body")
    low, high = seat.contact.range_mm
    lines = [
        f"{NAMES[end]}: {len(bolt_places())} x M4, drill {TAP_DRILL_MM:g} mm, thread {BOLT_IN_HULL_MM:g} mm deep",
        f"anchor at ({_numbers(anchor, 1)}) mm of the body, normal ({_numbers(seat.normal, 2)})",
    ]
    if high - low > 0:
        lines.append(f"the hull rises by {high - low:.1f} mm under the flange: drill along the normal")
    for number, words in enumerate(lines):
        _text(axes, (20, centre[1] + seat.width_mm / 2 + 5 + 5 * (len(lines) - 1 - number)), words)


def _cross(axes: Axes, place: tuple[float, float]) -> None:
    x, y = place
    _line(axes, (x - CROSS_MM, y), (x + CROSS_MM, y))
    _line(axes, (x, y - CROSS_MM), (x, y + CROSS_MM))


def _line(axes: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    axes.plot([start[0], end[0]], [start[1], end[1]], color="black", lw=THIN_MM * POINTS_PER_MM, snap=False)


def _text(axes: Axes, place: tuple[float, float], words: str, *, size_mm: float = 3.0, ha: str = "left") -> None:
    axes.text(*place, words, fontsize=size_mm * POINTS_PER_MM, ha=ha, va="center")


def _numbers(values: np.ndarray, digits: int) -> str:
    # Adding zero turns the -0 of rounding into 0.
    return ", ".join(f"{value:g}" for value in np.round(values, digits) + 0.0)
