"""The window of a camera in a hull from a file: an opening for the light from pinhole to water, cut out of the hull.

Meshes of robots are closed where the robot has a port, a dome or a clear nose. With `window = "cut"` in `[hull]` what
lies in the light's way there is taken away: from the pinhole through the port, and up to `WINDOW_REACH_MM` in front of
it. With `window = "clear"` light passes there, but parts still have to keep clear of it, as of a nose of acrylic. What
is further in front stays, and is in the way: then the camera does not stand at the skin.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import manifold3d
import numpy as np
import trimesh

from optics.kernels.arrays import FloatArray
from optics.layout import camera_pose
from optics.mesh import joined_triangles
from optics.train import OpticalTrain, Rays
from rigs import FlatPortSpec, Rig, Water

if TYPE_CHECKING:
    # The modelling kernel takes seconds to import, and the mesh of a hull needs none of it.
    from build123d import Solid

WINDOW_REACH_MM = 50.0
"""A nose or dome that the port stands behind is a window; a skin further in front is a hull that the camera is in."""

RIM_MM = 6.0
"""Added all around, for what holds the window: as the boss of our own hulls."""

COLUMNS, ROWS = 17, 13
"""Rays that bound the image's light, its edges and corners among them; what passes between the last one that the port
lets through and the next is within the rim."""

RIM_POINTS = 16
TOLERANCE_MM = 0.2


def with_window(shape: Solid | trimesh.Trimesh, rig: Rig) -> Solid | trimesh.Trimesh:
    """What light hits of a rig's hull (body frame, millimetres): without its window, where the rig says it has one.

    What is closed stays closed; of open surfaces, which only light hits, the triangles in the window are taken away.

    Raises
    ------
    ValueError
        When the window takes all of it.
    """
    hull = rig.file_hull
    if hull is None or hull.window == "as-drawn":
        return shape
    if not isinstance(shape, trimesh.Trimesh):
        points, corners = shape.tessellate(TOLERANCE_MM)
        shape = trimesh.Trimesh([tuple(point) for point in points], corners)
    window = window_body(rig)
    faces = np.ascontiguousarray(shape.faces, dtype=np.uint64)
    body = manifold3d.Manifold(manifold3d.Mesh64(np.ascontiguousarray(shape.vertices, dtype=np.float64), faces))
    cut = _meshed(body - window) if body.status() == manifold3d.Error.NoError else _outside(shape, window)
    if not len(cut.faces):
        raise ValueError(
            f'hull.window = "{hull.window}": expected a hull larger than its window; look at {hull.file.name} and '
            "camera.position_mm"
        )
    return cut


def solid_with_window(solid: Solid | trimesh.Trimesh, rig: Rig) -> Solid | trimesh.Trimesh:
    """What parts of the mount touch of a rig's hull: without its window where that is cut; raises as `with_window`."""
    hull = rig.file_hull
    return solid if hull is not None and hull.window == "clear" else with_window(solid, rig)


def _meshed(body: manifold3d.Manifold) -> trimesh.Trimesh:
    mesh = body.to_mesh64()
    return trimesh.Trimesh(mesh.vert_properties[:, :3], np.asarray(mesh.tri_verts, dtype=np.int64), process=False)


def _outside(surface: trimesh.Trimesh, window: manifold3d.Manifold) -> trimesh.Trimesh:
    """Triangles of any surface outside a convex body, those on its border cut along it."""
    convex = _meshed(window)
    corners = surface.triangles
    low, high = convex.bounds
    near = (corners.min(axis=1) <= high).all(axis=1) & (corners.max(axis=1) >= low).all(axis=1)
    pieces = [(np.asarray(surface.vertices), np.asarray(surface.faces)[~near])]
    rest = (np.asarray(surface.vertices), np.asarray(surface.faces)[near])
    for normal, corner in zip(convex.face_normals, convex.triangles[:, 0], strict=True):
        if not len(rest[1]):
            break
        pieces.append(trimesh.intersections.slice_faces_plane(*rest, normal, corner)[:2])
        rest = trimesh.intersections.slice_faces_plane(*rest, -normal, corner)[:2]
    vertices, faces = joined_triangles(pieces)
    return trimesh.Trimesh(vertices, faces, process=False)


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
    """Rays over the image that leave the port, in nominal water, camera frame.

    Raises
    ------
    ValueError
        When none does.
    """
    train = OpticalTrain.bare(rig.model_copy(update={"water": Water()}))
    u, v = np.linspace(-0.5, rig.camera.width_px - 0.5, COLUMNS), np.linspace(-0.5, rig.camera.height_px - 0.5, ROWS)
    rays = train.trace(np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2))
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
