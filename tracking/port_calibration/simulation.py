"""Simulated sessions: boards before cameras behind ports, to ask what a session would tell and whether it is true."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from optics.kernels.arrays import FloatArray
from optics.perturbation.port_camera import PortCamera
from tracking.port_calibration.bundle import in_medium
from tracking.port_calibration.observations import MEDIA, BoardObservations


def simulated_observations(
    cameras: Sequence[PortCamera],
    camera_from_rig: Sequence[RigidTransform],
    board_m: FloatArray,
    *,
    images: dict[str, int],
    distance_m: tuple[float, float],
    tilt_deg: float = 45.0,
    noise_px: float = 0.2,
    seed: int = 0,
) -> BoardObservations:
    """What cameras see of a board at random places before them.

    Parameters
    ----------
    cameras, camera_from_rig : sequences
        The truth; the rig's frame is that of the first camera.
    board_m : array, shape (k, 2) or (k, 3)
    images : dict of str to int
        How many in each medium.
    distance_m : (float, float)
        Along the first camera's axis.
    tilt_deg : float
        Largest angle between the board's normal and the first camera's axis.
    noise_px : float
        Standard deviation in u and in v.
    seed : int
    """
    rng, parts = np.random.default_rng(seed), []
    places_m = np.pad(board_m, ((0, 0), (0, 3 - board_m.shape[1])))
    centred = places_m - places_m.mean(axis=0)
    index = 0
    for medium, count in images.items():
        for _ in range(count):
            in_rig = _pose(rng, cameras[0], distance_m, tilt_deg).apply(centred)
            for camera, (of, pose) in enumerate(zip(cameras, camera_from_rig, strict=True)):
                fixed = np.tile([camera, index, MEDIA.index(medium)], (len(board_m), 1))
                parts.append(np.column_stack([fixed, places_m, in_medium(of, medium).project(pose.apply(in_rig))]))
            index += 1
    table = np.concatenate(parts)
    table[:, 6:] += rng.normal(scale=noise_px, size=(len(table), 2))
    sizes = tuple((of.camera.width_px, of.camera.height_px) for of in cameras)
    inside = ((table[:, 6:] >= 0) & (table[:, 6:] <= np.array(sizes)[table[:, 0].astype(int)] - 1)).all(axis=1)
    whole = _enough(table, inside)
    camera, image, medium_index = table[whole, :3].astype(np.intp).T
    every = BoardObservations(
        cameras=tuple(f"camera{number}" for number in range(1, len(cameras) + 1)),
        sizes_px=sizes,
        images=tuple(f"image{number:03d}" for number in range(index)),
        camera=camera,
        image=image,
        medium=medium_index,
        board_m=table[whole, 3:6],
        pixels=table[whole, 6:],
    )
    return every.rows(np.ones(len(camera), dtype=bool))


def _pose(
    rng: np.random.Generator, camera: PortCamera, distance_m: tuple[float, float], tilt_deg: float
) -> RigidTransform:
    far = rng.uniform(*distance_m)
    lens = camera.camera
    reach = far * 0.25 * np.array([lens.width_px / lens.fx_px, lens.height_px / lens.fy_px])
    shift = np.append(rng.uniform(-reach, reach), far)
    about, roll, tilt = rng.uniform(0, 2 * np.pi), rng.normal(scale=0.3), np.radians(rng.uniform(0, tilt_deg))
    tilted = Rotation.from_rotvec(tilt * np.array([np.cos(about), np.sin(about), 0]))
    return RigidTransform.from_components(shift, tilted * Rotation.from_rotvec([0, 0, roll]))


def _enough(table: FloatArray, inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Points of views of which most of the board is inside the image."""
    view = table[:, 0] * 1e6 + table[:, 1]
    _, of_view = np.unique(view, return_inverse=True)
    share = np.bincount(of_view, weights=inside) / np.bincount(of_view)
    return np.asarray(inside & (share[of_view] > 0.7))
