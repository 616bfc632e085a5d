"""Things as they would be seen with nothing before them, exactly: every pixel's ray against the unfolded thing."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import FloatArray
from optics.kernels.ray_scene import first_faces
from optics.status import Region
from optics.train import OpticalTrain, Rays, pixel_grid, regions
from rigs import Rig
from scenes.truth.virtual_view import exit_rays

BoolImage = NDArray[np.bool_]


def ball_silhouette(
    rig: Rig, train: OpticalTrain, *, centre_m: FloatArray, radius_m: float, region: Region, shape: tuple[int, int]
) -> BoolImage:
    """Pixels whose rays hit a ball over the mirrors of a region, were these mirrors unbounded and nothing in the way.

    Parameters
    ----------
    rig : Rig
    train : OpticalTrain
        The rig's, at the joint values at hand.
    centre_m : array, shape (3,)
        Camera frame.
    radius_m : float
    region : Region
        Whose mirrors count.
    shape : (rows, columns)
    """
    image = np.asarray(centre_m, dtype=np.float64)
    for mirror in reversed(train.mirrors[: region - Region.DIRECT]):
        image = mirror.reflection.apply(image)
    return meets_ball(exit_rays(rig, *shape), image, radius_m).reshape(shape)


def meets_ball(rays: Rays, centre_m: FloatArray, radius_m: float) -> NDArray[np.bool_]:
    """Which rays that passed hit a ball whose centre is given in their frame, shape (n,)."""
    offset = centre_m - rays.origin_m
    along = np.einsum("ij,ij->i", offset, rays.direction)
    closest = offset - along[:, np.newaxis] * rays.direction
    hit = np.einsum("ij,ij->i", closest, closest) < radius_m**2
    return np.asarray(hit & (along > 0) & rays.passed)


def meets_mesh(rays: Rays, scene: Any, frame_from_mesh: RigidTransform) -> NDArray[np.bool_]:
    """Which rays that passed hit the mesh of `optics.kernels.ray_scene.mesh_scene` at a pose in their frame."""
    own = rays.moved(frame_from_mesh.inv())
    distance_m, _ = first_faces(scene, own.origin_m, own.direction)
    return np.asarray(np.isfinite(distance_m) & rays.passed)


def train_regions(rig: Rig, train: OpticalTrain, shape: tuple[int, int]) -> NDArray[np.uint8]:
    """`Region` of every pixel with the mirrors alone in the water, from the float64 train."""
    rows, columns = shape
    if train.mirrors:
        found = regions(train.trace(pixel_grid(train.camera, columns, rows)).status)
    else:
        found = np.where(exit_rays(rig, rows, columns).passed, Region.DIRECT, Region.HOUSING)
    return found.astype(np.uint8).reshape(shape)
