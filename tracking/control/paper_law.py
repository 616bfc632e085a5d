"""The paper's law, eqs. 11 to 15, as printed and as it must be meant.

As printed, eq. 14 turns the tilt by the error of x, one image late, and eq. 15 adds the prediction while the target
*is* found: `paper-literal`. Text and figure 12 say otherwise: the tilt follows the error of y of the same image (1/2,
because the gaze turns by twice the mirror's turn) and the prediction stands in while the target is *not* found:
`paper`. The text calls it a PD law; no equation has a derivative.

q(k-1) is the last joint values commanded: the servos report nothing. The paper gives no gains. Here kp is what turns
the gaze by the error, radians to a pixel of the crop at a level gaze (`crop_scale`), times `GAIN`. Its sign is the
joint's: a target right of the middle wants less pan, one below it less tilt. The crop is upside down over the zenith,
where `paper` turns the sign of pan and `paper-literal` does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optics.kernels.arrays import FloatArray

GAIN = 0.25
"""Share of the error that one image takes away. From exposure to the joint's answer two images pass, so that
``e_(k+1) = e_k - GAIN e_(k-1)``: both roots of ``z^2 - z + GAIN`` are 1/2, the fastest return without overshoot.
A target at a steady rate is followed 1 / GAIN images late."""


@dataclass(frozen=True, kw_only=True)
class CropErrors:
    """Errors of one image, crop pixels, shape (2,) each, zero for what there is not.

    Attributes
    ----------
    found : bool
    centroid : array
        e, eq. 11: of the detected centroid.
    prediction : array
        e_p, eq. 12: of the filter's prediction.
    """

    found: bool
    centroid: FloatArray
    prediction: FloatArray


NO_ERRORS = CropErrors(found=False, centroid=np.zeros(2), prediction=np.zeros(2))


def error(point_px: tuple[float, float] | FloatArray, width_px: int, height_px: int) -> FloatArray:
    """Eqs. 11 and 12: of a point of the crop from its middle, shape (2,).

    The paper subtracts half the size; with the first pixel's centre at zero the middle is half a pixel before it.
    """
    return np.asarray(point_px, dtype=np.float64) - [(width_px - 1) / 2, (height_px - 1) / 2]


def printed_turn(now: CropErrors, before: CropErrors, gains: FloatArray) -> FloatArray:
    """Eqs. 13 to 15 as printed: turn of both joints, shape (2,), radians.

    Parameters
    ----------
    now, before : CropErrors
        Of this image and of the one before.
    gains : array, shape (2,)
        kp1, kp2, radians to a pixel.
    """
    psi = 1.0 if now.found else 0.0
    e = now.centroid[0] + psi * now.prediction[0]
    e_before = before.centroid[0] + psi * before.prediction[0]
    return np.asarray(gains * [e, e_before / 2])


def meant_turn(now: CropErrors, gains: FloatArray) -> FloatArray:
    """Eqs. 13 to 15 as meant: turn of both joints, shape (2,), radians, after the target or else its prediction."""
    e = now.centroid if now.found else now.prediction
    return np.asarray(gains * [e[0], e[1] / 2])
