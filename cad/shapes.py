"""Small helpers around build123d: boxes by their limits, cylinders between points, poses as locations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from build123d import Edge, Location, Part, Plane, Polygon, Solid, extrude
from numpy.typing import ArrayLike, NDArray
from OCP.StdFail import StdFail_NotDone
from scipy.spatial.transform import RigidTransform

Limits = tuple[float, float]

SMALLEST_FILLET_MM = 1.0


def box(x: Limits, y: Limits, z: Limits) -> Part:
    """Box between limits along each axis."""
    size = (x[1] - x[0], y[1] - y[0], z[1] - z[0])
    return Part([Solid.make_box(*size, Plane((x[0], y[0], z[0])))])


def cylinder(start: ArrayLike, end: ArrayLike, radius: float) -> Part:
    """Cylinder with its axis from `start` to `end`."""
    origin, tip = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    length = float(np.linalg.norm(tip - origin))
    plane = Plane(origin=tuple(origin), z_dir=tuple((tip - origin) / length))
    return Part([Solid.make_cylinder(radius, length, plane)])


def prism(corners: Sequence[Limits], plane: Plane, limits: Limits) -> Part:
    """Polygon in a plane's own x and y, extruded between limits along the plane's normal."""
    face = plane.offset(limits[0]) * Polygon(*corners, align=None)
    return extrude(face, amount=limits[1] - limits[0], dir=plane.z_dir)


def along_x(corners: Sequence[Limits], limits: Limits) -> Part:
    """Polygon in (y, z), extruded along x."""
    return prism(corners, Plane.YZ, limits)


def along_y(corners: Sequence[Limits], limits: Limits) -> Part:
    """Polygon in (x, z), extruded along y."""
    return prism(corners, Plane(origin=(0, 0, 0), x_dir=(1, 0, 0), z_dir=(0, -1, 0)), (-limits[1], -limits[0]))


def along_z(corners: Sequence[Limits], limits: Limits) -> Part:
    """Polygon in (x, y), extruded along z."""
    return prism(corners, Plane.XY, limits)


def filleted(shape: Part, edges: Iterable[Edge], radius_mm: float, what: str) -> Part:
    """Shape with rounded edges: with `radius_mm` or, where the kernel cannot, with 3/4 of it, and so on down to 1 mm.

    Raises
    ------
    ValueError
        When no radius of at least 1 mm can be made: a load-bearing corner is never left sharp in silence.
    """
    chosen, radius = list(edges), radius_mm
    while radius >= SMALLEST_FILLET_MM:
        try:
            rounded = shape.fillet(radius, chosen)
        except (ValueError, StdFail_NotDone):
            rounded = None
        if rounded is not None and rounded.is_valid:
            return rounded
        radius *= 0.75
    raise ValueError(
        f"{what}: expected room for a fillet of at least {SMALLEST_FILLET_MM:g} mm on {len(chosen)} edges, found none"
    )


def location_mm(pose: RigidTransform) -> Location:
    """Location in millimetres of a pose in metres."""
    matrix = pose.as_matrix()
    plane = Plane(origin=tuple(1000 * matrix[:3, 3]), x_dir=tuple(matrix[:3, 0]), z_dir=tuple(matrix[:3, 2]))
    return Location(plane)


def location_matrix(location: Location) -> NDArray[np.float64]:
    """Matrix of a location, shape (3, 4), millimetres."""
    pose = location.wrapped.Transformation()
    return np.array([[pose.Value(row, column) for column in (1, 2, 3, 4)] for row in (1, 2, 3)])


def single_solid(shapes: Iterable[Part], what: str, hint: str) -> Solid:
    """Union of shapes as the one solid they must be.

    Raises
    ------
    ValueError
        When they fall into several solids; `hint` names the keys to look at.
    """
    first, *others = shapes
    return one_solid(first.fuse(*others) if others else first, what, hint)


def carved(solid: Solid, cuts: Iterable[Part], what: str, hint: str) -> Solid:
    """Solid without what is cut out of it; raises `ValueError` with a hint when it falls apart."""
    return one_solid(Part([solid]).cut(*cuts), what, hint)


def one_solid(shape: Part, what: str, hint: str) -> Solid:
    """The only solid of a shape; raises `ValueError` with a hint when there is not exactly one."""
    solids = shape.solids()
    if len(solids) != 1:
        raise ValueError(f"{what}: expected one solid, got {len(solids)}; {hint}")
    return solids[0]
