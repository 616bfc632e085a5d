"""An A3 drawing sheet: frame, title block, lines, dimensions, tables; written as SVG and PDF.

Drawn with matplotlib, which the project has anyway: it writes both formats from one figure, as vectors, and the same
bytes every time once date and identifiers are fixed. One unit of the axes is one millimetre on paper.
"""

from __future__ import annotations

import pathlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, PathPatch, Rectangle
from matplotlib.path import Path
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray

WIDTH_MM, HEIGHT_MM = 420.0, 297.0
MARGIN_MM = 10.0
TITLE_MM = (180.0, 36.0)
POINTS_PER_MM = 72 / 25.4
VISIBLE_MM, THIN_MM = 0.35, 0.18
"""Line widths of ISO 128."""
TEXT_MM = 2.8
SMALL_TEXT_MM = 2.3
ARROW_MM = 2.2
SCALES = (10.0, 5.0, 2.0, 1.0, 1 / 2, 1 / 5, 1 / 10, 1 / 20, 1 / 50)
"""ISO 5455."""
SVG_SALT = "mirrorgaze"
"""Identifiers inside an SVG are hashed with this instead of a random number."""
STYLE = {
    "font.family": "DejaVu Sans",
    "svg.hashsalt": SVG_SALT,
    "svg.fonttype": "path",
    "path.simplify": False,
}


@dataclass(frozen=True, kw_only=True)
class Title:
    """What the title block says."""

    rig: str
    name: str
    material: str
    scale: str
    rig_hash: str
    note: str = ""


def at(x: float, y: float) -> FloatArray:
    """Point or step on paper, millimetres."""
    return np.array([x, y], dtype=np.float64)


def scale_name(scale: float) -> str:
    """Scale as drawings write it, `1:2` for a half."""
    return f"{scale:g}:1" if scale >= 1 else f"1:{1 / scale:g}"


def largest_scale(size_mm: ArrayLike, room_mm: ArrayLike) -> float:
    """Largest standard scale at which something fits into the room on paper; the smallest one when none does."""
    size, room = np.asarray(size_mm, dtype=float), np.asarray(room_mm, dtype=float)
    return next((scale for scale in SCALES if (scale * size <= room).all()), SCALES[-1])


def pen(polylines: Sequence[FloatArray], **style: Any) -> PathPatch:
    """Polylines of shape (k, 2) as one path: a drawing holds thousands, and an artist each takes most of its time."""
    codes = np.full(sum(len(line) for line in polylines), Path.LINETO, dtype=np.uint8)
    codes[np.cumsum([0, *(len(line) for line in polylines[:-1])])] = Path.MOVETO
    # Above what is filled, as lines are in matplotlib.
    options: dict[str, Any] = {"zorder": 2, **style}
    return PathPatch(Path(np.concatenate(polylines), codes), fill=False, **options)


class Sheet:
    """A sheet that is being drawn; positions are millimetres on paper from the lower left corner."""

    def __init__(self, title: Title) -> None:
        with mpl.rc_context(STYLE):
            self.figure = Figure(figsize=(WIDTH_MM / 25.4, HEIGHT_MM / 25.4))
            self.axes = self.figure.add_axes((0, 0, 1, 1))
        self.axes.set_xlim(0, WIDTH_MM)
        self.axes.set_ylim(0, HEIGHT_MM)
        self.axes.set_axis_off()
        self._frame(title)

    def write(self, path: pathlib.Path) -> list[pathlib.Path]:
        """Write SVG and PDF beside each other; `path` is without suffix."""
        written = [path.with_suffix(".svg"), path.with_suffix(".pdf")]
        with mpl.rc_context(STYLE):
            self.figure.savefig(written[0], metadata={"Date": None, "Creator": "mirrorgaze"})
            self.figure.savefig(written[1], metadata={"CreationDate": None, "Creator": "mirrorgaze", "Producer": None})
        return written

    def lines(
        self,
        polylines: Sequence[FloatArray],
        *,
        width_mm: float = VISIBLE_MM,
        window: tuple[FloatArray, FloatArray] | None = None,
        **style: Any,
    ) -> None:
        """Draw polylines on paper, or what of them is in a window given by two corners."""
        if not polylines:
            return
        options: dict[str, Any] = {"edgecolor": "black", "joinstyle": "round", **style}
        if "linestyle" not in options:
            options["capstyle"] = "round"
        drawn = pen(polylines, linewidth=width_mm * POINTS_PER_MM, **options)
        self.axes.add_artist(drawn)
        if window is not None:
            low, high = window
            frame = Rectangle((float(low[0]), float(low[1])), *(high - low), transform=self.axes.transData)
            drawn.set_clip_path(frame)

    def text(self, position: ArrayLike, words: str, *, size_mm: float = TEXT_MM, **style: Any) -> None:
        """Write words on paper."""
        x, y = np.asarray(position, dtype=float)
        options: dict[str, Any] = {"ha": "left", "va": "center", **style}
        self.axes.text(x, y, words, fontsize=size_mm * POINTS_PER_MM, **options)

    def centre_mark(self, position: ArrayLike, radius_mm: float, words: str = "") -> None:
        """Cross over a hole, and what it is called."""
        centre = np.asarray(position, dtype=float)
        reach = radius_mm + 1.5
        for arm in np.eye(2) * reach:
            self.lines([np.array([centre - arm, centre + arm])], width_mm=THIN_MM)
        if words:
            self.text(centre + radius_mm * 0.7 + 0.6, words, size_mm=SMALL_TEXT_MM, va="bottom", color="#0b4f9c")

    def axis_line(self, start: ArrayLike, end: ArrayLike) -> None:
        """Chain line, for axes."""
        self.lines([np.array([start, end], dtype=float)], width_mm=THIN_MM, linestyle=(0, (14, 3, 2, 3)))

    def ring(self, centre: ArrayLike, radius_mm: float, **style: Any) -> None:
        """Circle on paper."""
        x, y = np.asarray(centre, dtype=float)
        options: dict[str, Any] = {"fill": False, "edgecolor": "black", **style}
        self.axes.add_patch(Circle((float(x), float(y)), radius_mm, linewidth=THIN_MM * POINTS_PER_MM, **options))

    def distance(self, start: ArrayLike, end: ArrayLike, words: str, *, line: float, along: str = "x") -> None:
        """Dimension of the distance from `start` to `end` along x or y, its line at height (or abscissa) `line`."""
        first, second = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
        if along == "x":
            feet = np.array([[first[0], line], [second[0], line]])
        else:
            feet = np.array([[line, first[1]], [line, second[1]]])
        for point, foot in zip((first, second), feet, strict=True):
            away = foot - point
            length = float(np.linalg.norm(away))
            if length > 1:
                unit = away / length
                self.lines([np.array([point + unit, foot + unit])], width_mm=THIN_MM)
        self._arrows(feet)
        middle = feet.mean(axis=0)
        if along == "x":
            self.text(middle + at(0, 0.8), words, ha="center", va="bottom")
        else:
            self.text(middle - at(0.8, 0), words, ha="right", va="center", rotation=90)

    def _arrows(self, feet: FloatArray) -> None:
        length = float(np.linalg.norm(feet[1] - feet[0]))
        unit = (feet[1] - feet[0]) / max(length, 1e-9)
        # Between feet that are too close, the arrows point inwards from outside.
        inside = length > 3 * ARROW_MM
        shaft = feet if inside else np.array([feet[0] - 2 * ARROW_MM * unit, feet[1] + 2 * ARROW_MM * unit])
        self.lines([shaft], width_mm=THIN_MM)
        for foot, direction in ((feet[0], unit), (feet[1], -unit)):
            back = direction if inside else -direction
            side = 0.18 * np.array([-back[1], back[0]])
            tip = np.array([foot, foot + ARROW_MM * (back + side), foot + ARROW_MM * (back - side)])
            self.axes.fill(tip[:, 0], tip[:, 1], color="black", linewidth=0)

    def balloon(self, point: ArrayLike, label_at: ArrayLike, number: int) -> None:
        """Number in a circle, with a line to what it stands for."""
        tip, place = np.asarray(point, dtype=float), np.asarray(label_at, dtype=float)
        self.lines([np.array([tip, place])], width_mm=THIN_MM, zorder=1)
        self.ring(tip, 0.5, fill=True, facecolor="black")
        self.ring(place, 2.8, fill=True, facecolor="white", zorder=2)
        self.text(place, str(number), size_mm=SMALL_TEXT_MM, ha="center", va="center_baseline")

    def leader(self, point: ArrayLike, label_at: ArrayLike, words: str, **style: Any) -> None:
        """Words with a line to what they are about."""
        tip, place = np.asarray(point, dtype=float), np.asarray(label_at, dtype=float)
        self.lines([np.array([tip, place])], width_mm=THIN_MM)
        self.ring(tip, 0.5, fill=True, facecolor="black")
        right = place[0] >= tip[0]
        self.text(place + at(1 if right else -1, 0), words, ha="left" if right else "right", **style)

    def table(
        self,
        corner: ArrayLike,
        widths_mm: Sequence[float],
        rows: Sequence[Sequence[str]],
        *,
        row_mm: float = 4.2,
        numbers: Sequence[int] = (),
    ) -> float:
        """Table with its upper left corner at `corner`, the first row its head; returns its lower edge."""
        left, top = (float(value) for value in np.asarray(corner, dtype=float))
        right, bottom = left + sum(widths_mm), top - row_mm * len(rows)
        edges = left + np.concatenate([[0], np.cumsum(widths_mm)])
        self.lines([np.array([[x, bottom], [x, top]]) for x in edges], width_mm=THIN_MM)
        heights = top - row_mm * np.arange(len(rows) + 1)
        self.lines([np.array([[left, y], [right, y]]) for y in heights], width_mm=THIN_MM)
        for y, row in zip(heights, rows, strict=False):
            for column, words in enumerate(row):
                colour = "#0b4f9c" if y == top else "black"
                is_number = column in numbers
                x = edges[column + 1] - 1 if is_number else edges[column] + 1
                place = (x, y - row_mm / 2)
                aligned = "right" if is_number else "left"
                self.text(place, words, size_mm=SMALL_TEXT_MM, ha=aligned, va="center_baseline", color=colour)
        return bottom

    def _frame(self, title: Title) -> None:
        size = (WIDTH_MM - 2 * MARGIN_MM, HEIGHT_MM - 2 * MARGIN_MM)
        width = 2 * VISIBLE_MM * POINTS_PER_MM
        self.axes.add_patch(Rectangle((MARGIN_MM, MARGIN_MM), *size, fill=False, linewidth=width))
        left, bottom = WIDTH_MM - MARGIN_MM - TITLE_MM[0], MARGIN_MM
        self.axes.add_patch(Rectangle((left, bottom), *TITLE_MM, fill=False, linewidth=width))
        third = TITLE_MM[1] / 3
        for row in (1, 2):
            y = bottom + row * third
            self.lines([np.array([[left, y], [left + TITLE_MM[0], y]])], width_mm=THIN_MM)
        cells = [
            (0, 2, "part", title.name),
            (110, 2, "rig", title.rig),
            (0, 1, "material", title.material),
            (110, 1, "scale", title.scale),
            (145, 1, "size", "A3, mm"),
            (0, 0, "note", title.note),
            (110, 0, "rig sha-256", title.rig_hash),
        ]
        for x, row, label, words in cells:
            corner = np.array([left + x, bottom + row * third])
            if x:
                self.lines([np.array([corner, corner + at(0, third)])], width_mm=THIN_MM)
            self.text(corner + at(1.2, third - 2.2), label, size_mm=1.7, color="#555555")
            size_mm = 4.0 if row == 2 else SMALL_TEXT_MM
            self.text(corner + at(1.2, 3.6), words, size_mm=size_mm)
        self._first_angle_symbol(np.array([left + 145, bottom]), third)

    def _first_angle_symbol(self, corner: FloatArray, height_mm: float) -> None:
        """The sign of first-angle projection (ISO 128): a cone's side view, with its end view to the right of it."""
        self.lines([np.array([corner, corner + at(0, height_mm)])], width_mm=THIN_MM)
        middle = corner + at(0, height_mm / 2)
        small, large = 1.6, 3.2
        cone = np.array([[8, -small], [16, -large], [16, large], [8, small], [8, -small]]) + middle
        self.lines([cone], width_mm=THIN_MM)
        for radius in (small, large):
            self.ring(middle + at(24, 0), radius)
        self.axis_line(middle + at(6, 0), middle + at(29, 0))
