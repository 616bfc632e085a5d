"""Solids as lines on paper: parallel projection with hidden lines, and the holes that a drawing gives numbers for."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from build123d import Compound, Edge, GeomType, Solid
from numpy.typing import ArrayLike
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.GeomAbs import GeomAbs_CurveType

from optics.kernels.arrays import FloatArray

FAR_MM = 1e4
CHORD_MM = 1.0
"""A curve is drawn as chords of about this length ..."""
CHORDS = (6, 48)
"""... but at least and at most this many."""
FULL_TURN = 0.98 * 2 * np.pi
SAME_MM = 1e-3


@dataclass(frozen=True, kw_only=True)
class View:
    """A direction of sight; points project to (x along `right`, y along `up`).

    Attributes
    ----------
    name : str
    right, up : tuple of float
        Unit vectors of the frame that is drawn. The observer stands where ``right x up`` points.
    """

    name: str
    right: tuple[float, float, float]
    up: tuple[float, float, float]

    @property
    def towards_observer(self) -> FloatArray:
        """Unit vector from the object to the observer."""
        return np.cross(self.right, self.up)

    def project(self, points: ArrayLike) -> FloatArray:
        """Coordinates on paper of points, shape (..., 3) to (..., 2)."""
        return np.asarray(np.asarray(points, dtype=np.float64) @ np.array([self.right, self.up]).T)


FRONT = View(name="front", right=(1, 0, 0), up=(0, 0, 1))
"""From the right-hand side of the robot (-y): x to the right, z up."""
TOP = View(name="top", right=(1, 0, 0), up=(0, 1, 0))
LEFT = View(name="left", right=(0, -1, 0), up=(0, 0, 1))
"""From behind the robot (-x), that is from the left of the front view."""


def _isometric() -> View:
    towards = np.array([1.0, -1.0, 0.8])
    right = np.cross([0.0, 0.0, 1.0], towards)
    right = right / np.linalg.norm(right)
    up = np.cross(towards, right)
    up = up / np.linalg.norm(up)
    return View(
        name="isometric",
        right=(float(right[0]), float(right[1]), float(right[2])),
        up=(float(up[0]), float(up[1]), float(up[2])),
    )


ISOMETRIC = _isometric()
"""From the front right, above."""


@dataclass(frozen=True, kw_only=True)
class Outline:
    """Lines of a view: polylines of shape (k, 2), millimetres; `hidden` is empty where it was not asked for."""

    visible: tuple[FloatArray, ...]
    hidden: tuple[FloatArray, ...]


def outline(solids: Sequence[Solid], view: View, *, hidden: bool = False) -> Outline:
    """Visible and, when asked for, hidden edges of solids that stand in each other's way."""
    shape = solids[0] if len(solids) == 1 else Compound(children=list(solids))
    eye = tuple(FAR_MM * view.towards_observer)
    seen, covered = shape.project_to_viewport(eye, view.up, (0.0, 0.0, 0.0))
    return Outline(visible=_polylines(seen), hidden=_polylines(covered) if hidden else ())


def _polylines(edges: Iterable[Edge]) -> tuple[FloatArray, ...]:
    return tuple(_polyline(edge) for edge in edges)


def _polyline(edge: Edge) -> FloatArray:
    # Open CASCADE's own curve: build123d's positions are by length of arc, which costs most of a drawing's time.
    curve = BRepAdaptor_Curve(edge.wrapped)
    first, last = curve.FirstParameter(), curve.LastParameter()
    points = _points(curve, first, last, 1 if curve.GetType() == GeomAbs_CurveType.GeomAbs_Line else CHORDS[0])
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    if len(points) == 2 or length <= CHORDS[0] * CHORD_MM:
        return points
    return _points(curve, first, last, min(ceil(length / CHORD_MM), CHORDS[1]))


def _points(curve: BRepAdaptor_Curve, first: float, last: float, chords: int) -> FloatArray:
    points = [curve.Value(first + (last - first) * k / chords) for k in range(chords + 1)]
    return np.array([(point.X(), point.Y()) for point in points])


@dataclass(frozen=True, kw_only=True)
class Hole:
    """A round hole.

    Attributes
    ----------
    diameter_mm : float
    mouth : array, shape (3,)
        Centre of its end that lies furthest along `axis`, millimetres.
    axis : array, shape (3,)
        Unit vector along which it was drilled, out of the part; its largest component is positive.
    depth_mm : float
        Length of its wall.
    """

    diameter_mm: float
    mouth: FloatArray
    axis: FloatArray
    depth_mm: float


def holes(solid: Solid) -> list[Hole]:
    """Round holes of a solid: its hollow cylinders that go all the way around, by diameter, axis and place."""
    walls: dict[tuple[float, ...], tuple[float, FloatArray, FloatArray, list[float]]] = {}
    turns: dict[tuple[float, ...], float] = {}
    for face in solid.faces():
        if face.geom_type is not GeomType.CYLINDER or not face.is_circular_concave:
            continue
        wall = BRepAdaptor_Surface(face.wrapped)
        line = wall.Cylinder().Axis()
        axis = np.array([line.Direction().X(), line.Direction().Y(), line.Direction().Z()])
        axis = axis * np.sign(axis[np.abs(axis).argmax()])
        foot = np.array([line.Location().X(), line.Location().Y(), line.Location().Z()])
        foot = foot - (foot @ axis) * axis
        diameter = 2 * float(wall.Cylinder().Radius())
        reach = [float(np.array(tuple(vertex)) @ axis) for vertex in face.vertices()]
        key = tuple(np.round([diameter, *axis, *foot, min(reach)], 2) + 0.0)
        known = walls.setdefault(key, (diameter, axis, foot, []))
        known[3].extend(reach)
        turns[key] = turns.get(key, 0.0) + wall.LastUParameter() - wall.FirstUParameter()
    found = [
        Hole(diameter_mm=d, mouth=foot + max(reach) * axis, axis=axis, depth_mm=max(reach) - min(reach))
        for key, (d, axis, foot, reach) in walls.items()
        if turns[key] > FULL_TURN
    ]
    return sorted(found, key=_order)


def _order(hole: Hole) -> tuple[float, ...]:
    return tuple(np.round([-hole.diameter_mm, *(-hole.axis), *hole.mouth], 2) + 0.0)
