"""What a flange lies on: a plane, a cylinder, or a smooth surface through heights sampled on the user's own hull.

Everything is in the seat's frame: origin at the anchor, z along the hull's outward normal, millimetres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from build123d import Face, Part, Solid
from scipy.special import comb

from cad.shapes import box, cylinder
from optics.kernels.arrays import FloatArray

DEPTH_MM = 80.0
"""How far into the hull the room is cut that a flange must leave to it."""
BEYOND_MM = 3.0
"""A surface is sampled this far beyond the flange's outline, so that its cut goes all the way through."""
SAMPLES = 21
"""Heights along each side of the footprint: one every 2.5 mm or so."""
DEGREE = 3
"""Of the surface along each side: a flange's width of any hull is nearly a paraboloid."""
REACH_MM = 30.0
"""Surfaces further than this from the anchor's tangent plane are other parts of the hull."""
FLAT_MM = 0.05
"""What a printer's first layer levels out: a surface as flat as this is a plane."""
SHEET_MM = 1.0
"""What a neoprene sheet between hull and flange takes up."""
ROUGH_MM = 3.0
"""More than this between hull and flange is no fit; what a sheet does not take up is a bed of epoxy putty, cast against
foil. The facets of a coarse mesh count as steps: a tube of 260 mm drawn with
24 sides has some of 2.2 mm."""


@dataclass(frozen=True, kw_only=True)
class PlaneContact:
    """A flat hull."""

    @property
    def range_mm(self) -> tuple[float, float]:
        """Lowest and highest point of the contact."""
        return 0.0, 0.0

    def hull_side(self, length_mm: float, width_mm: float) -> Part:
        """What the hull takes up under a footprint."""
        half_length, half_width = length_mm / 2 + BEYOND_MM, width_mm / 2 + BEYOND_MM
        return box((-half_length, half_length), (-half_width, half_width), (-DEPTH_MM, 0))


@dataclass(frozen=True, kw_only=True)
class CylinderContact:
    """A cylindrical hull along the seat's x; `width_mm` is that of the footprint across it."""

    radius_mm: float
    width_mm: float

    @property
    def range_mm(self) -> tuple[float, float]:
        """Lowest and highest point of the contact."""
        return (self.radius_mm**2 - self.width_mm**2 / 4) ** 0.5 - self.radius_mm, 0.0

    def hull_side(self, length_mm: float, width_mm: float) -> Part:
        """What the hull takes up under a footprint."""
        low, half_length = -self.radius_mm, length_mm / 2 + BEYOND_MM
        return cylinder((-half_length, 0, low), (half_length, 0, low), self.radius_mm)


@dataclass(frozen=True, kw_only=True)
class SurfaceContact:
    """A smooth surface that touches a sampled hull from outside.

    Attributes
    ----------
    half_size_mm : tuple of two floats
        Of the patch along x and y.
    poles_mm : array, shape (4, 4)
        Heights of the Bézier patch's poles, whose x and y are evenly spread.
    error_mm : float
        Largest gap between hull and patch; the patch nowhere enters a sample of the hull.
    range_mm : tuple of two floats
        Lowest and highest point of the contact.
    """

    half_size_mm: tuple[float, float]
    poles_mm: FloatArray
    error_mm: float
    range_mm: tuple[float, float]

    def hull_side(self, length_mm: float, width_mm: float) -> Part:
        """What the hull takes up under a footprint."""
        x, y = (np.linspace(-half, half, DEGREE + 1) for half in self.half_size_mm)
        points = [
            [(float(x[i]), float(y[j]), float(self.poles_mm[i, j])) for j in range(DEGREE + 1)]
            for i in range(DEGREE + 1)
        ]
        return Part() + Solid.extrude(Face.make_bezier_surface(points), (0, 0, -DEPTH_MM))


Contact = PlaneContact | CylinderContact | SurfaceContact


def surface_contact(surface: trimesh.Trimesh, length_mm: float, width_mm: float, place: str) -> Contact:
    """Contact under a footprint of a hull's triangles, given in the seat's frame.

    The heights are those at which lines along the normal, `SAMPLES` by `SAMPLES` of them, leave the hull. A bicubic
    Bézier patch is fitted to them by least squares, then raised until no sample stands out of it.

    Raises
    ------
    ValueError
        When part of the footprint has no hull under it, or the hull there is rougher than `ROUGH_MM`.
    """
    half = (length_mm / 2 + BEYOND_MM, width_mm / 2 + BEYOND_MM)
    grid = np.linspace(-1, 1, SAMPLES)
    x, y = (values.ravel() for values in np.meshgrid(half[0] * grid, half[1] * grid, indexing="ij"))
    heights = surface_heights(surface, np.column_stack([x, y]))
    missing = ~np.isfinite(heights)
    if missing.any():
        raise ValueError(
            f"{place}: expected hull under the whole flange of {length_mm:g} x {width_mm:g} mm, got none under "
            f"{missing.mean():.0%} of it"
        )
    if np.abs(heights).max() <= FLAT_MM:
        return PlaneContact()
    u, v = ((values / (2 * side) + 0.5) for values, side in zip((x, y), half, strict=True))
    terms = (_bernstein(u)[:, :, np.newaxis] * _bernstein(v)[:, np.newaxis, :]).reshape(len(u), -1)
    poles = np.linalg.lstsq(terms, heights, rcond=None)[0]
    residual = heights - terms @ poles
    error = float(np.ptp(residual))
    if error > ROUGH_MM:
        raise ValueError(
            f"{place}: expected a hull that is smooth under the flange of {length_mm:g} x {width_mm:g} mm, got steps "
            f"of {error:.1f} mm"
        )
    fitted = terms @ poles + residual.max()
    return SurfaceContact(
        half_size_mm=half,
        poles_mm=poles.reshape(DEGREE + 1, DEGREE + 1) + residual.max(),
        error_mm=error,
        range_mm=(float(fitted.min()), float(fitted.max())),
    )


def surface_heights(surface: trimesh.Trimesh, points_mm: FloatArray) -> FloatArray:
    """Height of the outermost crossing of a surface over points (x, y), shape (n, 2), within reach; NaN for none."""
    triangles = np.asarray(surface.triangles, dtype=np.float64)
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    near = (low[:, :2] <= points_mm.max(axis=0)).all(axis=1) & (high[:, :2] >= points_mm.min(axis=0)).all(axis=1)
    near &= (low[:, 2] <= REACH_MM) & (high[:, 2] >= -REACH_MM)
    triangles = triangles[near]
    a, ab, ac = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    upright = area == 0
    area = np.where(upright, np.nan, area)
    heights = np.full(len(points_mm), np.nan)
    for index, (x, y) in enumerate(points_mm):
        ax, ay = x - a[:, 0], y - a[:, 1]
        s, t = (ax * ac[:, 1] - ay * ac[:, 0]) / area, (ab[:, 0] * ay - ab[:, 1] * ax) / area
        # A line through an edge shared by two triangles must hit one of them.
        hit = (s >= -1e-9) & (t >= -1e-9) & (s + t <= 1 + 1e-9)
        z = a[hit, 2] + s[hit] * ab[hit, 2] + t[hit] * ac[hit, 2]
        z = z[np.abs(z) <= REACH_MM]
        if len(z):
            heights[index] = z.max()
    return heights


def _bernstein(parameter: FloatArray) -> FloatArray:
    """Bernstein polynomials of the patch's degree, shape (n, 4)."""
    steps = np.arange(DEGREE + 1)
    u = parameter[:, np.newaxis]
    return np.asarray(comb(DEGREE, steps) * u**steps * (1 - u) ** (DEGREE - steps))
