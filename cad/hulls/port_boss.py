"""The boss around the camera's port: what of the hull carries the window.

It ends 0.5 mm behind the port's outer face: rays begin on that face and must not hit the boss that holds it.
"""

from __future__ import annotations

import numpy as np
from build123d import Part, Pos, Sphere

from cad.shapes import cylinder, location_mm
from optics.layout import Layout
from rigs import DomePortSpec, FlatPortSpec, Port

PROUD_MM = 0.5
RIM_MM = 6.0
DEPTH_MM = 30.0
"""How far the boss goes back from the pinhole or the dome's centre, into the hull."""


def port_boss(port: Port, layout: Layout) -> Part | None:
    """Boss of a port in the body frame, millimetres; None when there is no port."""
    if isinstance(port, FlatPortSpec):
        boss = _flat_boss(port)
    elif isinstance(port, DomePortSpec):
        boss = _dome_boss(port)
    else:
        return None
    return location_mm(layout.body_from_camera) * boss


def front_mm(port: Port) -> float:
    """How far a hull's straight tube around the camera's axis may reach, from the pinhole, millimetres."""
    if isinstance(port, FlatPortSpec):
        return port.distance_mm + port.thickness_mm - PROUD_MM
    if isinstance(port, DomePortSpec):
        return port.centre_mm[2]
    return 0.0


def _flat_boss(port: FlatPortSpec) -> Part:
    normal = np.array(port.normal) / np.linalg.norm(port.normal)
    end = (port.distance_mm + port.thickness_mm - PROUD_MM) * normal
    return cylinder(-DEPTH_MM * normal, end, port.aperture_diameter_mm / 2 + RIM_MM)


def _dome_boss(port: DomePortSpec) -> Part:
    radius = port.inner_radius_mm + port.thickness_mm - PROUD_MM
    centre = np.array(port.centre_mm)
    return Pos(*centre) * Sphere(radius) + cylinder(centre - [0, 0, radius + DEPTH_MM], centre, radius)
