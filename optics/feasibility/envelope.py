"""What a rig's port, hull and mirrors take up, as signed distances: negative inside, metres, points of shape (..., 3).

The distances to box, cylinder and sphere are exact (Quilez, "Distance functions", iquilezles.org/articles).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from optics.feasibility.torpedo import torpedo_distance
from optics.kernels.arrays import FloatArray
from optics.mirror_outline import mirror_outline
from rigs import BoxHull, DomePortSpec, FlatPortSpec, ParametricHull, Rig, TorpedoHull
from rigs.gaze import FlatMirror

HullDistance = Callable[[FloatArray], FloatArray]
"""Signed distance of points (..., 3) of the body frame from a hull, metres, shape (...)."""

BODY_SHARE = 0.58
"""Share of the width that the body takes when there are flippers; nominal, judged from photographs of AQUA."""

PLATE_SAMPLES = 31
"""Points along each side of a plate; 4 mm apart on a plate of 120 mm."""


def box_distance(points_m: FloatArray, half_size_m: FloatArray, edge_radius_m: float = 0.0) -> FloatArray:
    """Distance to a box around the origin, along the axes, with rounded edges."""
    beyond = np.abs(points_m) - half_size_m + edge_radius_m
    outside = np.linalg.norm(np.maximum(beyond, 0), axis=-1)
    return np.asarray(outside + np.minimum(beyond.max(axis=-1), 0) - edge_radius_m)


def cylinder_distance(points_m: FloatArray, radius_m: float, half_length_m: float) -> FloatArray:
    """Distance to a cylinder around the z axis between plus and minus `half_length_m`."""
    sideways = np.linalg.norm(points_m[..., :2], axis=-1) - radius_m
    beyond = np.stack([sideways, np.abs(points_m[..., 2]) - half_length_m], axis=-1)
    return np.asarray(np.linalg.norm(np.maximum(beyond, 0), axis=-1) + np.minimum(beyond.max(axis=-1), 0))


def sphere_distance(points_m: FloatArray, centre_m: FloatArray, radius_m: float) -> FloatArray:
    """Distance to a sphere."""
    return np.asarray(np.linalg.norm(points_m - centre_m, axis=-1) - radius_m)


def plate_points(plate: FlatMirror, samples: int = PLATE_SAMPLES) -> FloatArray:
    """Points on both faces of a plate, `samples` along each side, its reflecting face in z = 0, metres."""
    steps = np.linspace(-0.5, 0.5, samples)
    x, y, z = np.meshgrid(steps * plate.width_mm, steps * plate.height_mm, [0.0, -plate.thickness_mm])
    x, y = mirror_outline(plate).drawn_in(x / 1000, y / 1000)
    return np.stack([x, y, z / 1000], axis=-1).reshape(-1, 3)


def port_distance(rig: Rig, points_m: FloatArray) -> FloatArray:
    """Distance of points in the camera frame from what lies within the port's outer face."""
    port = rig.port
    if isinstance(port, FlatPortSpec):
        # The space between the pinhole and the outer face, as wide as the aperture.
        half_length = (port.distance_mm + port.thickness_mm) / 2000
        across = np.linalg.svd(np.array([port.normal]))[2][1:]
        normal = np.array(port.normal) / np.linalg.norm(port.normal)
        local = points_m @ np.vstack([across, normal]).T - [0, 0, half_length]
        return cylinder_distance(local, port.aperture_diameter_mm / 2000, half_length)
    if isinstance(port, DomePortSpec):
        radius = (port.inner_radius_mm + port.thickness_mm) / 1000
        return sphere_distance(points_m, np.array(port.centre_mm) / 1000, radius)
    return sphere_distance(points_m, np.zeros(3), 0.0)


def window_centre(rig: Rig) -> FloatArray:
    """Middle of the port's outer face in the camera frame, metres; the pinhole where there is no port."""
    port = rig.port
    if isinstance(port, FlatPortSpec):
        normal = np.array(port.normal) / np.linalg.norm(port.normal)
        return np.asarray(normal * (port.distance_mm + port.thickness_mm) / 1000)
    if isinstance(port, DomePortSpec):
        apex = np.array([0.0, 0.0, port.inner_radius_mm + port.thickness_mm])
        return np.asarray((np.array(port.centre_mm) + apex) / 1000)
    return np.zeros(3)


def hull_half_size(hull: ParametricHull) -> FloatArray:
    """Half the length, width and height of a hull, metres."""
    if isinstance(hull, TorpedoHull):
        return np.array([hull.length_mm, hull.diameter_mm, hull.diameter_mm], dtype=np.float64) / 2000
    return np.array([hull.length_mm, hull.width_mm, hull.height_mm], dtype=np.float64) / 2000


def body_width_mm(hull: BoxHull) -> float:
    """Width of a box without its flippers."""
    return hull.width_mm * (BODY_SHARE if hull.flippers_per_side else 1.0)


def own_hull_distance(rig: Rig) -> HullDistance | None:
    """Distance from a rig's hull as `hull_distance` gives it; None for a hull from a file."""
    if rig.file_hull is not None:
        return None
    return lambda points_m: hull_distance(rig, points_m)


def hull_distance(rig: Rig, points_m: FloatArray) -> FloatArray:
    """Distance of points in the body frame from the hull.

    That is a box, the side panels and the tube of an open frame, or a body of revolution without its fins.
    """
    hull = rig.require_gaze().hull
    assert isinstance(hull, ParametricHull)
    if isinstance(hull, TorpedoHull):
        return torpedo_distance(hull, points_m)
    if isinstance(hull, BoxHull):
        return box_distance(points_m, hull_half_size(hull), hull.edge_radius_mm / 1000)
    panel = hull.panel_thickness_mm / 2000
    half_size = hull_half_size(hull) * [1, 0, 1] + [0, panel, 0]
    offset = np.array([0.0, hull.width_mm / 2000 - panel, 0.0])
    # The tube ends at the pinhole: what is in front of it is the port's business.
    pinhole = np.array(rig.camera.position_mm) / 1000
    rear = -hull.length_mm / 2000
    along_tube = RigidTransform.from_components(
        [(pinhole[0] + rear) / 2, pinhole[1], pinhole[2]], Rotation.from_euler("y", 90, degrees=True)
    )
    local = along_tube.inv().apply(points_m.reshape(-1, 3)).reshape(points_m.shape)
    tube = cylinder_distance(local, hull.tube_diameter_mm / 2000, max((pinhole[0] - rear) / 2, 0.0))
    panels = np.minimum(box_distance(points_m - offset, half_size), box_distance(points_m + offset, half_size))
    return np.asarray(np.minimum(panels, tube))
