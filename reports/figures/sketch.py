"""A rig beside its hull in four views: shaded surfaces, lines over them, and what is hidden dotted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import matplotlib as mpl
import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cad.checks.standing import Standing
from cad.export.sketch import ANCHOR, LIGHT, MIRROR, WRONG, Colour, Line, Sketch, rig_sketch
from cad.export.sketch import INK as INK_RGB
from optics.kernels.arrays import FloatArray
from optics.kernels.ray_scene import first_faces, mesh_scene
from optics.mesh import double_area_vectors, joined_triangles
from reports.figures.plotting import INK, STYLE

PANEL_PX = (560, 400)
OVERSAMPLING = 2
DPI = 110
Floats = NDArray[np.float32]
Placed = Callable[[FloatArray], FloatArray]
"""From places in a view, -1 to 1, to the coordinates of its axes."""
MARGIN = 0.12
SAMPLE_PX = 1.5
"""Between the points at which a line is asked whether it is hidden."""
DOT, GAP = 2, 3
"""Samples of a hidden line that are drawn, and that are left out."""
BEHIND = 0.004
"""A line this far behind a surface, as a share of the view's size, still lies on it."""
AMBIENT, EDGE, CREASE = 0.45, 0.5, 0.8
"""Light on a face that is turned away; what is left of it at an edge; cosine below which two pixels' faces make one."""
LETTER_PX = (6.5, 12.0)
STEP = 0.03
"""Of the depth between two pixels that makes an edge, as a share of the view's size."""
EYE = np.array([1.6, -1.0, 0.75])
"""Where the perspective view is seen from: in front, on the right, above."""
FOCAL = 2.4
"""Of the perspective view, in halves of its width."""


KEY = (
    (LIGHT, "the camera's view through the port, to M1"),
    (MIRROR, "mirrors; faint: M2 over the range of its joints"),
    (ANCHOR, "anchors and their normals"),
    (INK_RGB, "shortest way to the hull; body axes"),
    (WRONG, "in the hull, stopped by it, or off it"),
    ((120, 120, 120), "dotted: behind a surface"),
)


@dataclass(frozen=True, kw_only=True)
class View:
    """A way to look at the body: `axes`, rows right, up and forwards; along parallel rays, or from an `eye`.

    `centre_mm` is in the middle; `half_mm` are half the width and height there.
    """

    title: str
    axes: FloatArray
    centre_mm: FloatArray
    half_mm: FloatArray
    eye_mm: FloatArray | None = None

    def project(self, points_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Places in the picture, (n, 2), -1 to 1, and depths along the rays, (n,), millimetres."""
        if self.eye_mm is None:
            seen = (points_mm - self.centre_mm) @ self.axes.T
            return seen[:, :2] / self.half_mm, seen[:, 2] + self._far_mm
        seen = (points_mm - self.eye_mm) @ self.axes.T
        distance = float(np.linalg.norm(self.centre_mm - self.eye_mm))
        return seen[:, :2] / np.maximum(seen[:, 2:], 1e-6) * distance / self.half_mm, np.linalg.norm(seen, axis=1)

    def rays(self, columns: int, rows: int) -> tuple[Floats, Floats]:
        """Origins and directions of a ray for each pixel, row by row from the top, millimetres, single precision."""
        x = ((np.arange(columns) + 0.5) / columns * 2 - 1) * self.half_mm[0]
        y = (1 - (np.arange(rows) + 0.5) / rows * 2) * self.half_mm[1]
        across, along = (_single(each[:, np.newaxis] * axis) for each, axis in zip((x, y), self.axes, strict=False))
        plane = (across + (along + _single(self.centre_mm))[:, np.newaxis]).reshape(-1, 3)
        if self.eye_mm is None:
            forwards = _single(self.axes[2])
            return plane - np.float32(self._far_mm) * forwards, np.broadcast_to(forwards, plane.shape)
        ahead = plane - _single(self.eye_mm)
        ahead /= np.sqrt(np.einsum("ij,ij->i", ahead, ahead))[:, np.newaxis]
        return np.broadcast_to(_single(self.eye_mm), ahead.shape), ahead

    @property
    def _far_mm(self) -> float:
        """From where parallel rays start: in front of everything that is near the picture's middle."""
        return 20 * float(self.half_mm.max()) + float(np.linalg.norm(self.centre_mm))


def standing_figure(standing: Standing) -> Figure:
    """Front, side, top and perspective view of a rig beside its hull, with a table of distances."""
    sketch = rig_sketch(standing)
    with mpl.rc_context(STYLE):
        rows = len(standing.places)
        figure = Figure(figsize=(11.2, 8.6 + 0.2 * rows), dpi=DPI, layout="constrained")
        panels = figure.subplots(3, 2, height_ratios=[4, 4, 0.23 * rows + 0.15])
        grid = panels[2, 0].get_gridspec()
        for axes in panels[2]:
            axes.remove()
        _table(figure.add_subplot(grid[2, :]), standing)
        for axes, view in zip(panels[:2].ravel(), _views(standing, sketch), strict=True):
            _draw(axes, view, sketch, standing)
    return figure


def _single(array: FloatArray) -> Floats:
    return np.asarray(array, dtype=np.float32)


def _views(standing: Standing, sketch: Sketch) -> list[View]:
    """Front, side and top of what the mount needs, and all of the hull from in front."""
    low, high = _region(standing)
    centre, half = (low + high) / 2, (high - low) / 2
    x, y, z = np.eye(3)
    flat = {
        "Front": np.array([y, z, -x]),
        "Right side": np.array([x, z, y]),
        "Top": np.array([x, y, -z]),
    }
    aspect = PANEL_PX[0] / PANEL_PX[1]
    views = []
    for title, axes in flat.items():
        needed = np.abs(axes[:2]) @ half
        width = max(needed[0], needed[1] * aspect)
        views.append(View(title=title, axes=axes, centre_mm=centre, half_mm=np.array([width, width / aspect])))
    return [*views, _perspective(sketch, aspect)]


def _region(standing: Standing) -> tuple[FloatArray, FloatArray]:
    """Box around camera, mirrors, anchors, and the hull next to each."""
    light = standing.light
    points = [
        *(place.point_mm for place in standing.places),
        *(place.nearest_mm for place in standing.places),
        *(anchor.point_mm for anchor in standing.anchors.values()),
        *standing.fold_mirror.face_mm,
        *(corner for plate in standing.gaze_poses for corner in plate.face_mm),
        *light.end_mm[light.folded],
    ]
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    margin = MARGIN * float((high - low).max())
    return low - margin, high + margin


def _perspective(sketch: Sketch, aspect: float) -> View:
    """The whole hull and all that is drawn around it, as large as the picture holds it."""
    surfaces = [np.asarray(surface.mesh.vertices) for surface in sketch.surfaces]
    corners = np.concatenate([*surfaces, *(line.points_mm for line in sketch.lines)])
    low, high = corners.min(axis=0), corners.max(axis=0)
    centre, size = (low + high) / 2, float(np.linalg.norm(high - low))
    backwards = EYE / np.linalg.norm(EYE)
    right = np.cross([0, 0, 1], backwards)
    right = right / np.linalg.norm(right)
    axes = np.array([right, np.cross(backwards, right), -backwards])
    eye = centre + FOCAL / 2 * size * backwards
    probe = View(title="Whole hull", axes=axes, centre_mm=centre, half_mm=np.ones(2), eye_mm=eye)
    seen, _ = probe.project(corners)
    low_px, high_px = seen.min(axis=0), seen.max(axis=0)
    half = 1.06 * (high_px - low_px) / 2
    width = max(half[0], half[1] * aspect)
    middle = centre + ((low_px + high_px) / 2) @ axes[:2]
    # The eye moves with the picture's middle, so that this stays on the axis.
    return View(
        title="Whole hull",
        axes=axes,
        centre_mm=middle,
        half_mm=np.array([width, width / aspect]),
        eye_mm=eye + middle - centre,
    )


def _draw(axes: Axes, view: View, sketch: Sketch, standing: Standing) -> None:
    image, depth = _shaded(view, sketch)
    if view.eye_mm is None:
        centre = view.axes[:2] @ view.centre_mm
        left, right = centre[0] - view.half_mm[0], centre[0] + view.half_mm[0]
        bottom, top = centre[1] - view.half_mm[1], centre[1] + view.half_mm[1]
        names = ["xyz"[int(np.argmax(np.abs(axis)))] for axis in view.axes[:2]]
        axes.set_xlabel(f"{names[0]} (mm)")
        axes.set_ylabel(f"{names[1]} (mm)")
    else:
        left, right, bottom, top = -1.0, 1.0, -1.0, 1.0
        axes.set_xticks([])
        axes.set_yticks([])
    axes.imshow(image, extent=(left, right, bottom, top), aspect="auto", interpolation="antialiased")
    axes.set_box_aspect(PANEL_PX[1] / PANEL_PX[0])
    axes.set_title(view.title)

    def placed(seen: FloatArray) -> FloatArray:
        return np.asarray([left, bottom] + (seen + 1) / 2 * np.array([right - left, top - bottom]))

    slack_mm = BEHIND * float(view.half_mm.max())
    pieces = [piece for line in sketch.lines for piece in _pieces(view, line, depth, slack_mm)]
    for hidden, weight in ((True, 0.8), (False, 1.0)):
        chosen = [piece for piece in pieces if piece.hidden == hidden]
        shown = LineCollection(
            [placed(corner) for piece in chosen for corner in piece.corners],
            colors=np.repeat([piece.colour for piece in chosen], [len(piece.corners) for piece in chosen], axis=0),
            linewidths=np.repeat([weight * piece.width for piece in chosen], [len(p.corners) for p in chosen]),
        )
        axes.add_collection(shown, autolim=False)
    taken: list[FloatArray] = []
    for name, point, colour in _labels(standing, sketch, whole=view.eye_mm is not None):
        seen, _ = view.project(np.array([point]))
        if np.abs(seen).max() < 1:
            where = _free_place(seen[0] * PANEL_PX / 2, name, taken)
            axes.annotate(
                name,
                tuple(placed(2 * where / PANEL_PX)),
                fontsize=8,
                color=_as_rgb(colour),
                path_effects=[patheffects.withStroke(linewidth=2.2, foreground="white")],
                zorder=5,
            )
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)


def _shaded(view: View, sketch: Sketch) -> tuple[Floats, FloatArray]:
    """Picture, (rows, columns, 3), and depth of the first surface, (rows, columns), millimetres."""
    columns, rows = (OVERSAMPLING * count for count in PANEL_PX)
    pieces = [(np.asarray(surface.mesh.vertices), np.asarray(surface.mesh.faces)) for surface in sketch.surfaces]
    vertices, faces = joined_triangles(pieces)
    counts = [len(piece[1]) for piece in pieces]
    paint = np.repeat(np.array([surface.colour for surface in sketch.surfaces]) / 255, counts, axis=0)
    origins, directions = view.rays(columns, rows)
    distance, face = first_faces(mesh_scene(vertices / 1000, faces), origins / 1000, directions)
    corners = vertices[faces]
    normals = double_area_vectors(corners)
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    seen = _single(normals)[face]
    facing = np.einsum("ij,ij->i", seen, directions)
    lamp = _single(np.array([-0.45, 0.65, -0.9]) @ view.axes)
    # Whatever way a triangle is turned, it is lit from the viewer's side.
    light = np.maximum(-np.sign(facing) * (seen @ (lamp / np.linalg.norm(lamp))), 0)
    colour = _single(paint)[face] * (AMBIENT + (1 - AMBIENT) * light)[:, np.newaxis]
    depth = 1000 * distance.reshape(rows, columns)
    edges = _edges(seen.reshape(rows, columns, 3), depth, float(view.half_mm.max()))
    image = np.where((face >= 0)[:, np.newaxis], colour, 1.0).reshape(rows, columns, 3)
    return image * np.where(edges, EDGE, 1.0)[..., np.newaxis], depth


def _edges(normals: Floats, depth: FloatArray, size_mm: float) -> NDArray[np.bool_]:
    """Pixels beside another face or another depth."""
    edges, hit = np.zeros(depth.shape, dtype=bool), np.isfinite(depth)
    filled = np.where(hit, depth, 0.0)
    for axis in (0, 1):
        here, there = ((slice(None),) * axis + (part,) for part in (slice(None, -1), slice(1, None)))
        crease = np.abs(np.einsum("ijk,ijk->ij", normals[here], normals[there])) < CREASE
        step = np.abs(filled[here] - filled[there]) > STEP * size_mm
        edges[here] |= np.where(hit[here] & hit[there], crease | step, hit[here] != hit[there])
    return edges


@dataclass(frozen=True, kw_only=True)
class _Pieces:
    """Pieces of a line: `corners` (n, 2, 2) in the view, all hidden or none, with a colour and a width."""

    corners: FloatArray
    hidden: bool
    colour: tuple[float, float, float, float]
    width: float


def _pieces(view: View, line: Line, depth: FloatArray, slack_mm: float) -> Iterator[_Pieces]:
    """A line in pieces, with gaps where a surface hides it."""
    width, alpha = (0.7, 0.45) if line.faint else (1.3, 1.0)
    for start, end in pairwise(line.points_mm):
        ends, _ = view.project(np.array([start, end]))
        length_px = float(np.linalg.norm((ends[1] - ends[0]) / 2 * PANEL_PX))
        count = int(np.clip(length_px / SAMPLE_PX, 2, 2000))
        seen, distance = view.project(start + np.linspace(0, 1, count + 1)[:, np.newaxis] * (end - start))
        behind = _hidden(seen, distance, depth, slack_mm)
        behind = behind[:-1] | behind[1:]
        corners = np.stack([seen[:-1], seen[1:]], axis=1)
        drawn = np.arange(count) % (DOT + GAP) < DOT
        for hidden, chosen in ((False, ~behind), (True, behind & drawn)):
            if chosen.any():
                colour = (*_as_rgb(line.colour), alpha * (0.85 if hidden else 1.0))
                yield _Pieces(corners=corners[chosen], hidden=hidden, colour=colour, width=width)


def _hidden(seen: FloatArray, distance: FloatArray, depth: FloatArray, slack_mm: float) -> NDArray[np.bool_]:
    """Which points lie behind a surface; what is beside the picture is not asked."""
    rows, columns = depth.shape
    column = np.clip(((seen[:, 0] + 1) / 2 * columns).astype(int), 0, columns - 1)
    row = np.clip(((1 - seen[:, 1]) / 2 * rows).astype(int), 0, rows - 1)
    return np.asarray(distance > depth[row, column] + slack_mm)


def _labels(standing: Standing, sketch: Sketch, *, whole: bool) -> Iterator[tuple[str, FloatArray, Colour]]:
    """Words, where they stand, and their colour: the axes in the picture of the whole hull, else the things."""
    if whole:
        yield from ((line.name[-1], line.points_mm[1], INK_RGB) for line in sketch.lines if line.name[:5] == "body_")
        return
    colours = {surface.name: surface.colour for surface in sketch.surfaces}
    yield "camera", 1000 * standing.layout.body_from_camera.translation, colours["camera"]
    yield "M1", standing.fold_mirror.face_mm.mean(axis=0), colours["fold_mirror"]
    yield "M2", standing.gaze_mirror.face_mm.mean(axis=0), colours["gaze_mirror"]
    for end, anchor in standing.anchors.items():
        yield f"{end} anchor", np.array(anchor.point_mm), colours[f"{end}_anchor"]


def _free_place(point_px: FloatArray, name: str, taken: list[FloatArray]) -> FloatArray:
    """Where a word beside a point lies on none that is there already; it is then one of them."""
    size = np.array([LETTER_PX[0] * len(name), LETTER_PX[1]])
    place = point_px + np.array([6.0, 4.0])
    while any((place < other[1]).all() and (other[0] < place + size).all() for other in taken):
        place = place - np.array([0.0, LETTER_PX[1]])
    taken.append(np.array([place, place + size]))
    return np.asarray(place)


def _table(axes: Axes, standing: Standing) -> None:
    """Distances from the hull, what is wrong in red; and what the lines are."""
    axes.set_axis_off()
    axes.set_xlim(0, 1)
    axes.set_ylim(len(standing.places) + 1, 0)
    axes.text(0.02, 0.5, "Distance from the hull (mm; minus: inside)", fontsize=8.5, va="center", weight="bold")
    for row, place in enumerate(standing.places):
        colour = _as_rgb(WRONG) if place.wrong else INK
        height = row + 1.5
        axes.text(0.02, height, place.name, fontsize=8.5, va="center", color=colour)
        axes.text(
            0.27, height, f"{round(place.distance_mm, 1) + 0:.1f}", fontsize=8.5, va="center", ha="right", color=colour
        )
        axes.text(0.285, height, place.wrong, fontsize=8.5, va="center", color=colour, weight="bold")
    for row, (paint, words) in enumerate(KEY):
        column, height = 0.62, row + 0.5
        style = ":" if words.startswith("dotted") else "-"
        axes.plot([column, column + 0.03], [height, height], style, color=_as_rgb(paint), linewidth=1.8)
        axes.text(column + 0.04, height, words, fontsize=8.5, va="center")


def _as_rgb(colour: Colour) -> tuple[float, float, float]:
    red, green, blue = colour
    return red / 255, green / 255, blue / 255
