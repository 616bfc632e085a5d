"""The opening for the window: hull meshes are solid where the housing of `scenes.reference.housing` must stand."""

from __future__ import annotations

from dataclasses import replace

import manifold3d
import numpy as np
import trimesh
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import check_vector, unit
from optics.mesh import PartMesh
from optics.ports.port import DomePort, FlatPort, Port
from scenes.reference.clipping import outside_of
from scenes.reference.housing import ROOM_BEHIND_M

ALLOWANCE = 1.002
"""The opening over the housing: surfaces must not lie in each other."""

AHEAD_M = 0.001
"""How far a flat port's opening reaches beyond its outer face."""

SECTIONS, SUBDIVISIONS = 256, 5


def with_opening(hull: PartMesh, port: Port, body_from_camera: RigidTransform) -> PartMesh:
    """Hull without what is inside the housing of a port."""
    room = _room(port)
    if room is None:
        return hull
    room.apply_transform(body_from_camera.as_matrix())
    surface = trimesh.Trimesh(hull.vertices_m, hull.faces)
    if surface.is_volume:
        cut = trimesh.boolean.difference([surface, room], engine="manifold")
    else:
        cut = outside_of(surface, manifold3d.Manifold.hull_points(np.ascontiguousarray(room.vertices)))
    return replace(hull, vertices_m=np.asarray(cut.vertices), faces=np.asarray(cut.faces, dtype=np.int32))


def _room(port: Port) -> trimesh.Trimesh | None:
    """What the housing takes, in the camera's frame; nothing without a port."""
    if isinstance(port, FlatPort) and port.aperture_radius_m is not None:
        normal = unit("normal", port.normal)
        ends = [-(ROOM_BEHIND_M + AHEAD_M) * normal, (port.distance_m + port.thickness_m + AHEAD_M) * normal]
        return trimesh.creation.cylinder(radius=ALLOWANCE * port.aperture_radius_m, segment=ends, sections=SECTIONS)
    if isinstance(port, DomePort):
        room = trimesh.creation.icosphere(SUBDIVISIONS, radius=ALLOWANCE * (port.radius_m + port.thickness_m))
        return room.apply_translation(check_vector("centre_m", port.centre_m))
    return None
