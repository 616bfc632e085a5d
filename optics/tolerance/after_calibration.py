"""What calibrating the two joint offsets takes away: the offsets under which the nominal rig looks like a built one.

The built rig is shown where its gaze goes in some poses; two numbers, an angle added to pan and one added to tilt, are
fitted by least squares of the directions. The signs and scales of the joints are known.
"""

from __future__ import annotations

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.perturbation.derivatives import gaze_jacobian
from optics.perturbation.parameters import JOINT_OFFSETS
from optics.perturbation.train import PerturbedTrain

ITERATIONS = 4
"""Gauss-Newton steps, all with the Jacobian at zero: each shrinks the error by the offset in radians, some 0.02."""


def calibrated_offsets(train: PerturbedTrain, q: FloatArray, directions: FloatArray) -> FloatArray:
    """Fit pan and tilt offsets to gaze directions.

    Parameters
    ----------
    train : PerturbedTrain
    q : array, shape (k, 2)
        Joint values (q1, q2) of the poses, radians.
    directions : array, shape (n, k, 3)
        Where each of n built rigs looks in each pose: unit vectors of the principal ray, body frame.

    Returns
    -------
    array, shape (n, 2)
        Radians to add to the optical angles of pan and tilt.

    Raises
    ------
    ValueError
        When the poses say nothing about one of the offsets, as a single pose at the zenith says nothing about pan.
    """
    jacobian = gaze_jacobian(train, q, parameters=JOINT_OFFSETS).values
    normal = np.einsum("kci,kcj->ij", jacobian, jacobian)
    if np.linalg.cond(normal) > 1 / np.sqrt(np.finfo(np.float64).eps):
        raise ValueError(f"expected poses that determine both joint offsets, got q = {np.degrees(q).tolist()} degrees")
    offsets = np.zeros((len(directions), 2))
    for _ in range(ITERATIONS):
        missing = directions - train.gaze(q, in_all_poses(offsets))
        offsets = offsets + np.linalg.solve(normal, np.einsum("kci,nkc->in", jacobian, missing)).T
    return offsets


def in_all_poses(offsets: FloatArray) -> dict[str, FloatArray]:
    """Offsets of pan and tilt, shape (n, 2), as perturbations that are the same in all poses."""
    return {name: offsets[:, column, np.newaxis] for column, name in enumerate(JOINT_OFFSETS)}
