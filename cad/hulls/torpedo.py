"""The hull of a torpedo-shaped AUV: a body of revolution with fins on its tail."""

from __future__ import annotations

import numpy as np
from build123d import Axis, Face, Line, Part, Rot, Spline, Wire, revolve

from cad.shapes import along_y
from optics.feasibility.torpedo import nose_stations, tail_stations, torpedo_radius
from optics.kernels.arrays import FloatArray
from rigs import TorpedoHull

FIN_THICKNESS_MM = 8.0
FIN_TAPER = 0.7
"""Chord of a fin's tip in that of its root."""
FIN_PLACE = 0.25
"""Where the fins' trailing edge is, as a share of the tail's length from its tip."""


def torpedo(hull: TorpedoHull) -> Part:
    """Body and fins in the body frame, millimetres, without the port's boss."""
    shape = _body(hull)
    for turn in 360 * (np.arange(hull.fins) + 0.5) / max(hull.fins, 1):
        shape += Rot(float(turn), 0, 0) * _fin(hull)
    return shape


def _body(hull: TorpedoHull) -> Part:
    tail, nose = _outline(hull, tail_stations(hull)), _outline(hull, nose_stations(hull))
    edges = [Spline(*tail), Spline(*nose), Line(nose[-1], tail[0])]
    if nose[0][0] > tail[-1][0]:
        edges.append(Line(tail[-1], nose[0]))
    return revolve(Face(Wire(edges)), Axis.X)


def _outline(hull: TorpedoHull, stations_m: FloatArray) -> list[tuple[float, float, float]]:
    """Points (x, 0, r) of the outline, millimetres."""
    # Rounded: the tip must lie on the axis, not a nanometre beside it, to close the body.
    radii = np.round(1000 * torpedo_radius(hull, stations_m), 5)
    return [(1000 * float(x), 0.0, float(radius)) for x, radius in zip(stations_m, radii, strict=True)]


def _fin(hull: TorpedoHull) -> Part:
    """Trapezoid that stands up from inside the tail, its trailing edge straight."""
    back = -hull.length_mm / 2 + FIN_PLACE * hull.tail_length_mm
    root = 1000 * float(torpedo_radius(hull, np.array(back / 1000))) / 2
    tip = back + FIN_TAPER * hull.fin_chord_mm
    corners = [(back, root), (back + hull.fin_chord_mm, root), (tip, hull.fin_span_mm), (back, hull.fin_span_mm)]
    return along_y(corners, (-FIN_THICKNESS_MM / 2, FIN_THICKNESS_MM / 2))
