"""A hull from a STEP file of one solid: the solid, and the flat faces that have names in the file."""

from __future__ import annotations

import numpy as np
from build123d import Solid

from cad.hulls.files.step import named_planes, step_shape
from cad.hulls.files.units import check_size
from cad.hulls.hull_mesh import body_from_file
from cad.shapes import location_mm
from optics.kernels.arrays import FloatArray
from rigs import FileHull

Plane = tuple[FloatArray, FloatArray]
"""Point in millimetres and outward normal."""


def step_solid(hull: FileHull) -> Solid:
    """Solid of a STEP file in the body frame, millimetres; raises `ValueError` when it is no hull."""
    try:
        solid = step_shape(hull.file)
        check_size(np.array(tuple(solid.bounding_box().size)), None)
    except ValueError as error:
        raise ValueError(f"hull.file = {hull.file.name!r}: {error}") from None
    return location_mm(body_from_file(hull)) * solid


def step_planes(hull: FileHull) -> dict[str, Plane]:
    """Flat faces with a name: the middle of each and its outward normal, body frame."""
    place = body_from_file(hull)
    return {
        name: (1000 * place.apply(point / 1000), place.rotation.apply(normal))
        for name, (point, normal) in named_planes(hull.file).items()
    }
