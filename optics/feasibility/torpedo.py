"""The shape of a torpedo-shaped hull: Myring's nose and tail at the ends of a cylinder.

D. F. Myring, "A theoretical study of body drag in subcritical axisymmetric flow", Aeronautical Quarterly 27(3), 1976;
the formulas as in T. Prestero, "Verification of a six-degree of freedom simulation model for the REMUS autonomous
underwater vehicle", MIT 2001, eqs. 2.1 and 2.2, with both ends drawn out to a point on the axis.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from optics.kernels.arrays import FloatArray
from rigs import TorpedoHull

NOSE_STEPS = 24
TAIL_STEPS = 24


def torpedo_radius(hull: TorpedoHull, x_m: FloatArray) -> FloatArray:
    """Radius of the hull at places along the body's x; metres, shape as `x_m`, zero beyond the ends.

    With d the diameter, a the nose's length, c the tail's, theta the half angle of its tip, and distances s from the
    nose's shoulder forward and t from the tail's shoulder backward:

        nose  r = d/2 (1 - (s/a)^2)^(1/n)
        tail  r = d/2 - (3d/(2c^2) - tan(theta)/c) t^2 + (d/c^3 - tan(theta)/c^2) t^3
    """
    x = np.asarray(x_m, dtype=np.float64)
    diameter, half_length = hull.diameter_mm / 1000, hull.length_mm / 2000
    a, c = hull.nose_length_mm / 1000, hull.tail_length_mm / 1000
    slope = np.tan(np.radians(hull.tail_angle_deg))
    s = np.clip(x - (half_length - a), 0, a)
    t = np.clip(-x - (half_length - c), 0, c)
    nose = (1 - (s / a) ** 2) ** (1 / hull.nose_exponent)
    lost = (1.5 * diameter / c**2 - slope / c) * t**2 - (diameter / c**3 - slope / c**2) * t**3
    return np.where(np.abs(x) <= half_length, diameter / 2 * nose - lost, 0.0)


def nose_stations(hull: TorpedoHull) -> FloatArray:
    """Places along x from the nose's shoulder to its tip, closer together where it is round; metres."""
    angles = np.linspace(0, np.pi / 2, NOSE_STEPS + 1)
    return np.asarray((hull.length_mm / 2 - hull.nose_length_mm * (1 - np.sin(angles))) / 1000)


def tail_stations(hull: TorpedoHull) -> FloatArray:
    """Places along x from the tail's tip to its shoulder, metres."""
    return np.asarray((np.linspace(0, hull.tail_length_mm, TAIL_STEPS + 1) - hull.length_mm / 2) / 1000)


def torpedo_distance(hull: TorpedoHull, points_m: FloatArray) -> FloatArray:
    """Distance of points in the body frame from the hull without its fins, negative inside; metres.

    The outline is followed in straight steps, which cut into the hull by less than a thousandth of its diameter.

    Parameters
    ----------
    hull : TorpedoHull
        The hull.
    points_m : array, shape (..., 3)
        Points in the body frame, metres.
    """
    points = np.asarray(points_m, dtype=np.float64)
    flat = points.reshape(-1, 3)
    place = np.column_stack([flat[:, 0], np.hypot(flat[:, 1], flat[:, 2])])
    stations = np.concatenate([tail_stations(hull), nose_stations(hull)])
    outline = np.column_stack([stations, torpedo_radius(hull, stations)])
    nearest = np.full(len(place), np.inf)
    for start, end in pairwise(outline):
        along = end - start
        length = max(float(along @ along), np.finfo(np.float64).tiny)
        share = np.clip((place - start) @ along / length, 0, 1)
        nearest = np.minimum(nearest, np.linalg.norm(place - start - share[:, np.newaxis] * along, axis=1))
    inside = place[:, 1] < np.interp(place[:, 0], outline[:, 0], outline[:, 1], left=0, right=0)
    return np.asarray(np.where(inside, -nearest, nearest).reshape(points.shape[:-1]))


def torpedo_normal(hull: TorpedoHull, point_m: FloatArray) -> FloatArray:
    """Outward normal of the hull beside a point near it, shape (3,)."""
    x, y, z = (float(value) for value in point_m)
    half = hull.length_mm / 2000
    step = 1e-6 * half
    ends = np.clip([x - step, x + step], -half, half)
    radii = torpedo_radius(hull, ends)
    radial = np.hypot(y, z)
    if ends[0] >= half or ends[1] <= -half or radial == 0:
        return np.array([np.sign(x) if x else 1.0, 0.0, 0.0])
    normal = np.array([-(radii[1] - radii[0]), (ends[1] - ends[0]) * y / radial, (ends[1] - ends[0]) * z / radial])
    return np.asarray(normal / np.linalg.norm(normal))
