"""The window of a camera in a hull from a file: an opening for the light from pinhole to water, cut out of the hull.

Meshes of robots are closed where the robot has a port, a dome or a clear nose. With `window = "cut"` in `[hull]` what
lies in the light's way there is taken away: from the pinhole through the port, and up to `WINDOW_REACH_MM` in front of
it. What is further in front stays, and is in the way: then the camera does not stand at the skin.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import manifold3d
import numpy as np
import trimesh

from optics.kernels.arrays import FloatArray
from optics.layout import camera_pose
from optics.train import OpticalTrain, Rays, pixel_grid
from rigs import FlatPortSpec, Rig, Water

if TYPE_CHECKING:
    # The modelling kernel takes seconds to import, and the mesh of a hull needs none of it.
    from build123d import Solid

WINDOW_REACH_MM = 50.0
"""A nose or dome that the port stands behind is a window; a skin further in front is a hull that the camera is in."""

RIM_MM = 6.0
"""Added all around, for what holds the window: as the boss of our own hulls."""

COLUMNS, ROWS = 33, 25
"""Rays of the image; those of its edges and corners bound the light."""

RIM_POINTS = 32
TOLERANCE_MM = 0.2


def with_window(shape: Solid | trimesh.Trimesh, rig: Rig) -> Solid | trimesh.Trimesh:
    """Hull of a rig (body frame, millimetres), its window cut out where the rig file says so; else the hull as it is.

    Raises
    ------
    ValueError
        When the hull is not closed, or nothing is left of it.
    """
    hull = rig.file_hull
    if hull is None or hull.window != "cut":
        return shape
    if not isinstance(shape, trimesh.Trimesh):
        points, corners = shape.tessellate(TOLERANCE_MM)
        shape = trimesh.Trimesh([tuple(point) for point in points], corners)
    faces = np.ascontiguousarray(shape.faces, dtype=np.uint64)
    body = manifold3d.Manifold(manifold3d.Mesh64(np.ascontiguousarray(shape.vertices, dtype=np.float64), faces))
    cut = (body - window_body(rig)).to_mesh64()
    if not len(cut.tri_verts):
        state = "a closed surface" if body.status() != manifold3d.Error.NoError else "a hull that the window leaves"
        raise ValueError(f'hull.window = "cut": expected {state}; look at {hull.file.name} and at camera.position_mm')
    return trimesh.Trimesh(cut.vert_properties[:, :3], np.asarray(cut.tri_verts, dtype=np.int64), process=False)


def window_body(rig: Rig) -> manifold3d.Manifold:
    """Convex body that the light of the image fills from the pinhole to in front of the port; body frame, millimetres.

    `RIM_MM` wider all around, for what holds the window. In nominal water: what is cut shall not move with its salt.
    """
    rays = window_rays(rig)
    ends = rays.origin_m + WINDOW_REACH_MM / 1000 * rays.direction
    points = np.vstack([np.zeros((1, 3)), rays.origin_m, ends, *_in_front_of_aperture(rig)])
    steps = RIM_MM / 1000 * np.vstack([np.eye(3), -np.eye(3)])
    wider = (points[:, np.newaxis] + steps).reshape(-1, 3)
    return manifold3d.Manifold.hull_points(np.ascontiguousarray(1000 * camera_pose(rig.camera).apply(wider)))


def window_rays(rig: Rig) -> Rays:
    """Rays of the image's pixels that leave the port, in nominal water, camera frame.

    Raises
    ------
    ValueError
        When none does.
    """
    train = OpticalTrain.bare(rig.model_copy(update={"water": Water()}))
    rays = train.trace(pixel_grid(train.camera, COLUMNS, ROWS))
    if not rays.passed.any():
        raise ValueError("expected a port that lets some of the image through; look at port.aperture_diameter_mm")
    return rays[rays.passed]


def _in_front_of_aperture(rig: Rig) -> list[FloatArray]:
    """Rims of a flat port's outer face and of the water straight in front of it, camera frame, metres."""
    port = rig.port
    if not isinstance(port, FlatPortSpec):
        return []
    normal = np.array(port.normal) / np.linalg.norm(port.normal)
    across = np.linalg.svd(normal[np.newaxis])[2][1:]
    angles = np.linspace(0, 2 * np.pi, RIM_POINTS, endpoint=False)
    rim = port.aperture_diameter_mm / 2 * np.column_stack([np.cos(angles), np.sin(angles)]) @ across
    face = port.distance_mm + port.thickness_mm
    return [(rim + height * normal) / 1000 for height in (face, face + WINDOW_REACH_MM)]
