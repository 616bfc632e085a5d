"""Where a board is, roughly: the pose from which its unknown six numbers are refined.

One image tells it, the one that shows most of the board. Each of its points is a ray (o, d) behind the mirrors. With
R = (r1, r2, r3) and t the board's pose, a point (x, y, 0) of the board is on the ray when
d x (r1 x + r2 y + t - o) = 0. The rays of one image come nearly from one point c; with t counted from there this is
linear and homogeneous in r1, r2 and t, and |r1| = |r2| = 1 fixes its scale: the direct linear transform (Hartley &
Zisserman, Multiple View Geometry, 2004, section 4.1). t follows once more with R known and each ray from its own o.
Several images at once would be better determined, if the rig were nominal; degrees off, they contradict each other.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from optics.kernels.arrays import FloatArray
from optics.perturbation.train import PerturbedTrain
from tracking.calibration.observations import TargetObservations


def board_poses(train: PerturbedTrain, observations: TargetObservations) -> list[RigidTransform]:
    """`camera_from_board` of every board, as it would be if the rig were nominal.

    Raises
    ------
    ValueError
        For a board of which no pixel looks through the port.
    """
    # Whether the mirrors are large enough is not asked: a wrong guess of the joints' signs has rays, too.
    origins, directions = train.trace(observations.q, pixels=observations.pixels)
    on_board = observations.points_m[:, :2]
    # The direct view is an image, too: inf is equal to itself, as nan is not.
    named = np.nan_to_num(observations.q, nan=np.inf)
    image = np.unique(named, axis=0, return_inverse=True)[1].ravel()
    poses = []
    for index, name in enumerate(observations.boards):
        on = (observations.board == index) & np.isfinite(directions).all(axis=1)
        if not on.any():
            raise ValueError(f"board {name}: expected pixels that look through the port")
        areas = [_area(on_board[on & (image == each)]) for each in range(image.max() + 1)]
        seen = on & (image == int(np.argmax(areas)))
        poses.append(pose_on_rays(on_board[seen], origins[seen], directions[seen]))
    return poses


def _area(on_board: FloatArray) -> float:
    """Square of how far points spread over a board both ways together: nothing for points on a line."""
    if not len(on_board):
        return 0.0
    centred = on_board - on_board.mean(axis=0)
    return float(np.linalg.det(centred.T @ centred))


def pose_on_rays(on_board: FloatArray, origins: FloatArray, directions: FloatArray) -> RigidTransform:
    """`camera_from_board` of points of a board, each on a ray (n, 3) behind port and mirrors.

    Points are of shape (n, 2) on a plane, or (n, 3) of a target that is not flat.
    """
    off_ray, columns = _across(directions), on_board.T[:, :, np.newaxis, np.newaxis]
    rows = np.concatenate([*(off_ray * column for column in columns), off_ray], axis=2).reshape(2 * len(on_board), -1)
    # Columns of one size: metres on the board are not metres of the pool.
    sizes = np.maximum(np.linalg.norm(rows, axis=0), np.finfo(np.float64).tiny)
    found = np.linalg.svd(rows / sizes, full_matrices=False)[2][-1] / sizes
    axes, shift = found[:-3].reshape(-1, 3), found[-3:]
    # The board is in front of the mirror.
    sense = np.sign((directions * (on_board @ axes + shift)).sum()) or 1.0
    axes = sense * axes / np.linalg.norm(axes[0])
    if len(axes) == 2:
        axes = np.vstack([axes, np.cross(axes[0], axes[1])])
    left, _, right = np.linalg.svd(axes.T)
    turn = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    in_place = on_board @ turn[:, : on_board.shape[1]].T - origins
    offset = -(off_ray @ in_place[..., np.newaxis])[..., 0]
    translation = np.linalg.lstsq(off_ray.reshape(-1, 3), offset.ravel())[0]
    return RigidTransform.from_components(translation, Rotation.from_matrix(turn))


def _across(directions: FloatArray) -> FloatArray:
    """Two unit vectors across each direction, shape (n, 2, 3)."""
    return np.asarray(np.linalg.svd(directions[:, np.newaxis, :])[2][:, 1:])
