"""Points that several cameras see through their ports: where they are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import FloatArray
from optics.perturbation.parameters import POINT
from optics.perturbation.port_camera import PortCamera

STEPS = 10
"""Gauss-Newton steps of a point at most; three to five converge."""

CLOSE_M = 1e-9
"""Step under which a point counts as found."""


def triangulate(
    cameras: Sequence[PortCamera], camera_from_rig: Sequence[RigidTransform], pixels: ArrayLike
) -> FloatArray:
    """Points that cameras see through their ports, in least squares of pixels.

    Parameters
    ----------
    cameras, camera_from_rig : sequences
    pixels : array, shape (cameras, n, 2)

    Returns
    -------
    array, shape (n, 3)
        In the rig's frame, metres; NaN where the rays do not lead to a point that all cameras see.
    """
    observed = np.asarray(pixels, dtype=np.float64)
    points = nearest_points(cameras, camera_from_rig, observed)
    for _ in range(STEPS):
        normal, side = np.zeros((len(points), 3, 3)), np.zeros((len(points), 3))
        for camera, pose, wanted in zip(cameras, camera_from_rig, observed, strict=True):
            found = camera.jacobian(pose.apply(points), POINT)
            by_point = found.values @ pose.rotation.as_matrix()
            normal += np.einsum("nic,nid->ncd", by_point, by_point)
            side += np.einsum("nic,ni->nc", by_point, found.outputs - wanted)
        step = -np.einsum("ncd,nd->nc", _inverse(normal), side)
        points = points + step
        if not np.nanmax(np.abs(step), initial=0.0) > CLOSE_M:
            break
    return points


def nearest_points(
    cameras: Sequence[PortCamera], camera_from_rig: Sequence[RigidTransform], pixels: ArrayLike
) -> FloatArray:
    """Points nearest to the rays of their pixels in the water, shape (n, 3), in the rig's frame: quick, not optimal."""
    observed = np.asarray(pixels, dtype=np.float64)
    normal, side = np.zeros((observed.shape[1], 3, 3)), np.zeros((observed.shape[1], 3))
    for camera, pose, seen in zip(cameras, camera_from_rig, observed, strict=True):
        origins, directions = camera.rays(seen)
        rig_from_camera = pose.inv()
        origins, directions = rig_from_camera.apply(origins), rig_from_camera.rotation.apply(directions)
        across = np.eye(3) - directions[:, :, np.newaxis] * directions[:, np.newaxis]
        normal += across
        side += np.einsum("ncd,nd->nc", across, origins)
    return np.asarray(np.einsum("ncd,nd->nc", _inverse(normal), side))


def reprojection_errors(
    cameras: Sequence[PortCamera], camera_from_rig: Sequence[RigidTransform], points_m: FloatArray, pixels: ArrayLike
) -> FloatArray:
    """Distance in each image between points and where they were seen, shape (cameras, n)."""
    observed = np.asarray(pixels, dtype=np.float64)
    projected = [camera.project(pose.apply(points_m)) for camera, pose in zip(cameras, camera_from_rig, strict=True)]
    return np.asarray(np.linalg.norm(np.array(projected) - observed, axis=2))


def _inverse(matrices: FloatArray) -> FloatArray:
    """Inverses of matrices, NaN where there is none."""
    usable = np.flatnonzero(np.isfinite(matrices).all(axis=(1, 2)))
    usable = usable[np.linalg.cond(matrices[usable]) < 1 / np.finfo(np.float64).eps]
    result = np.full(matrices.shape, np.nan)
    result[usable] = np.linalg.inv(matrices[usable])
    return result
