"""What calibrating the two joint offsets takes away: the offsets that make the rig as drawn look like a built one.

The built rig is shown where its gaze goes in some poses; two numbers, an angle added to pan and one added to tilt, are
fitted by least squares of the directions. The signs and scales of the joints are known.
"""

from __future__ import annotations

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.tolerance.slopes import gaze_slopes
from optics.tolerance.train import DeviantTrain

ITERATIONS = 4
"""Gauss-Newton steps, all with the slopes at zero: each shrinks the error by the offset in radians, some 0.02."""


def calibrated_offsets(train: DeviantTrain, directions: FloatArray) -> FloatArray:
    """Fit pan and tilt offsets to gaze directions.

    Parameters
    ----------
    train : DeviantTrain
        The rig as drawn, in k poses.
    directions : array, shape (n, k, 3)
        Where each of n built rigs looks in each pose: unit vectors of the principal ray, camera frame.

    Returns
    -------
    array, shape (n, 2)
        Radians to add to the optical angles of pan and tilt.

    Raises
    ------
    ValueError
        When the poses say nothing about one of the offsets, as a single pose at the zenith says nothing about pan.
    """
    slopes = gaze_slopes(train.rig, train.q, ("pan", "tilt")).transpose(1, 2, 0)
    normal = np.einsum("kci,kcj->ij", slopes, slopes)
    if np.linalg.cond(normal) > 1 / np.sqrt(np.finfo(np.float64).eps):
        raise ValueError(
            f"expected poses that determine both joint offsets, got q = {np.degrees(train.q).tolist()} degrees"
        )
    offsets = np.zeros((len(directions), 2))
    for _ in range(ITERATIONS):
        missing = directions - _directions(train, offsets)
        offsets = offsets + np.linalg.solve(normal, np.einsum("kci,nkc->in", slopes, missing)).T
    return offsets


def _directions(train: DeviantTrain, offsets: FloatArray) -> FloatArray:
    """Gaze of the rig as drawn with offsets, shape (n, k, 3)."""
    return train.view(in_all_poses(offsets), len(offsets))[1]


def in_all_poses(offsets: FloatArray) -> dict[str, FloatArray]:
    """Offsets of pan and tilt, shape (n, 2), as deviations that are the same in all poses."""
    return {name: offsets[:, column, np.newaxis] for column, name in enumerate(("pan", "tilt"))}
