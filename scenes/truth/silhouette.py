"""The ball as it would be seen with nothing before it, exactly: every pixel's ray against the unfolded ball."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from optics.status import Region
from optics.train import OpticalTrain, pixel_grid, regions
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
    rays = exit_rays(rig, *shape)
    offset = image - rays.origin_m
    along = np.einsum("ij,ij->i", offset, rays.direction)
    closest = offset - along[:, np.newaxis] * rays.direction
    hit = np.einsum("ij,ij->i", closest, closest) < radius_m**2
    return np.asarray((hit & (along > 0) & rays.passed).reshape(shape))


def train_regions(rig: Rig, train: OpticalTrain, shape: tuple[int, int]) -> NDArray[np.uint8]:
    """`Region` of every pixel with the mirrors alone in the water, from the float64 train."""
    rows, columns = shape
    if train.mirrors:
        found = regions(train.trace(pixel_grid(train.camera, columns, rows)).status)
    else:
        found = np.where(exit_rays(rig, rows, columns).passed, Region.DIRECT, Region.HOUSING)
    return found.astype(np.uint8).reshape(shape)
