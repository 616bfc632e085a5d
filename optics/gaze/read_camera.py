"""Rays of a camera behind a port and two mirrors, from a table of `mirrorgaze export-camera`; NumPy is all it needs.

    table = load("camera.npz")
    origin, direction, path, blocked = rays(table, q1=0.5, q2=-0.2)

Metres and radians in the body frame (x ahead, y left, z up); arrays of shape (height, width, ...). `path` says over
which mirrors a pixel looks: 0 housing, 1 direct, 2 the fold mirror, 3 fold and gaze mirror. `blocked` rays end at the
back of a mirror. Hull and mount are not in the table: let your simulator know their meshes (`mirrorgaze export`).
"""

import numpy as np


def load(path):
    """Table of a camera."""
    with np.load(path) as file:
        return dict(file)


def gaze_mirror_pose(table, q1, q2):
    """Pose of the gaze mirror in the body frame, shape (4, 4): columns along its width, its height, its normal."""
    for name, value, (_, _, low, high) in (("pan", q1, table["pan"]), ("tilt", q2, table["tilt"])):
        if not low - 1e-9 <= value <= high + 1e-9:
            raise ValueError(f"expected {name} from {low:.4f} to {high:.4f} rad, got {value:.4f}")
    a = table["pan"][0] * q1 + table["pan"][1]
    e = table["tilt"][0] * q2 + table["tilt"][1] + np.pi / 4
    turn = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    face = np.array([[0, -np.sin(e), np.cos(e)], [1, 0, 0], [0, np.cos(e), np.sin(e)]])
    pose = np.array(table["body_from_gimbal"])
    pose[:3, :3] = pose[:3, :3] @ turn @ face
    return pose


def rays(table, q1=0.0, q2=0.0):
    """Origin, direction, path and whether it is blocked of every pixel's ray in the water."""
    origin, direction = table["origin_m"].astype(float), table["direction"].astype(float)
    path, blocked = np.where(table["status"] == 0, 1, 0), np.zeros(table["status"].shape, dtype=bool)
    poses = (table["body_from_m1"], gaze_mirror_pose(table, q1, q2)) if "pan" in table else ()
    for number, pose in enumerate(poses, 1):
        hit, point, reflected, is_front = _met(pose, table[f"m{number}_outline"], origin, direction)
        hit &= (path == number) & ~blocked
        # A ray that reaches a mirror from behind ends there; as the toolkit has it, its path is the fold mirror's.
        path = np.where(hit & (is_front | (number == 1)), number + 1, path)
        blocked |= hit & ~is_front
        front = (hit & is_front)[..., np.newaxis]
        origin, direction = np.where(front, point, origin), np.where(front, reflected, direction)
    return origin, direction, path, blocked


def _met(pose, outline, origin, direction):
    """Whether rays meet a mirror, where, which way they go on, and whether they meet its front."""
    (x, y, normal, centre), (width, height, most, is_ellipse) = pose[:3].T, outline
    approach = direction @ normal
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (centre - origin) @ normal / approach
        point = origin + along[..., np.newaxis] * direction
        u, v = np.abs((point - centre) @ x), np.abs((point - centre) @ y)
        ellipse = (u / width) ** 2 + (v / height) ** 2 <= 1
        inside = ellipse if is_ellipse else (u <= width) & (v <= height) & (u + v <= most)
    return (along > 0) & inside, point, direction - 2 * approach[..., np.newaxis] * normal, approach < 0
