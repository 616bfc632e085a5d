"""What a camera takes up behind its port at least: of a robot's own file nothing says where the housing is."""

from __future__ import annotations

import manifold3d
from scipy.spatial.transform import RigidTransform

from optics.feasibility.envelope import window_centre
from optics.layout import camera_pose
from rigs import FlatPortSpec, Rig

HOUSING_MM = 60.0
"""Nominal: how far a camera goes back from its port's face."""
SEGMENTS = 64


def port_ahead_mm(rig: Rig) -> float:
    """From a rig's pinhole to the middle of its port's outer face, along the view."""
    return float(1000 * window_centre(rig)[2])


def housing_radius_mm(rig: Rig) -> float:
    """Radius of what is behind a port: of the port without its rim; 0 without a port."""
    port = rig.port
    if port.shape == "none":
        return 0.0
    if isinstance(port, FlatPortSpec):
        return float(port.aperture_diameter_mm / 2)
    return float(port.inner_radius_mm + port.thickness_mm)


def housing_body(rig: Rig) -> manifold3d.Manifold:
    """Cylinder about a camera's view from the port's outer face back, body frame, millimetres; empty without a port."""
    radius = housing_radius_mm(rig)
    if not radius:
        return manifold3d.Manifold()
    back = RigidTransform.from_translation([0.0, 0.0, (port_ahead_mm(rig) - HOUSING_MM) / 1000])
    matrix = (camera_pose(rig.camera) * back).as_matrix()[:3].copy()
    matrix[:, 3] *= 1000
    return manifold3d.Manifold.cylinder(HOUSING_MM, radius, circular_segments=SEGMENTS).transform(matrix)
