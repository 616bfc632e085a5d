"""Irradiance on planes of any orientation, and of the sea's layers: downwelling, upwelling, scalar."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import eval_legendre

from optics.kernels.arrays import FloatArray
from optics.water.radiative_transfer.discrete_ordinates import Modes
from optics.water.radiative_transfer.quadrature import harmonics


@dataclass(frozen=True, kw_only=True)
class Irradiances:
    """Irradiances by depth, sun and sky and all scattered light together; arrays of shape (z,).

    Attributes
    ----------
    downwelling, upwelling : arrays
        On a horizontal plane, from above and from below.
    scalar_down, scalar_up : arrays
        Through a sphere, from above and from below.
    diffuse_attenuation : array
        ``-d ln(downwelling) / d tau``, per optical depth.
    """

    downwelling: FloatArray
    upwelling: FloatArray
    scalar_down: FloatArray
    scalar_up: FloatArray
    diffuse_attenuation: FloatArray


def irradiances(modes: Modes, optical_depth: FloatArray) -> Irradiances:
    """Irradiances at optical depths, shape (z,)."""
    decay = np.exp(-np.outer(optical_depth, modes.rate[0]))
    weight, cosine = modes.streams.weight, modes.streams.cosine
    down, up = modes.radiance[0, 0], modes.radiance[0, 1]
    flux, flux_up = 2 * np.pi * (weight * cosine) @ down, 2 * np.pi * (weight * cosine) @ up
    beam = modes.sun_irradiance * np.exp(-optical_depth / modes.sun_cosine)
    downwelling = decay @ flux + beam * modes.sun_cosine
    return Irradiances(
        downwelling=downwelling,
        upwelling=decay @ flux_up,
        scalar_down=2 * np.pi * decay @ (weight @ down) + beam,
        scalar_up=2 * np.pi * decay @ (weight @ up),
        diffuse_attenuation=(decay @ (modes.rate[0] * flux) + beam) / downwelling,
    )


def irradiance_on_planes(modes: Modes, optical_depth: FloatArray, cosine: FloatArray) -> FloatArray:
    """Fourier components of the irradiance of all light but the direct sun on planes by their outward normal.

    Funk-Hecke: every spherical harmonic of the radiance is multiplied by that of the clamped cosine (Ramamoorthi &
    Hanrahan 2001, J. Opt. Soc. Am. A 18, 2448).

    Returns
    -------
    array, shape (m, z, p)
    """
    degrees = len(modes.phase_moments)
    decay = np.exp(-modes.rate[:, None, :] * optical_depth[:, None])
    received = clamped_cosine_moments(degrees)[:, None] * harmonics(degrees, cosine)
    return decay @ np.swapaxes(modes.moments, -1, -2) @ received


def clamped_cosine_moments(degrees: int) -> FloatArray:
    """Legendre moments ``2 pi int_0^1 x P_l(x) dx`` of what a plane receives by the cosine to its normal."""
    nodes, weights = np.polynomial.legendre.leggauss(degrees)
    x = (1 + nodes) / 2
    return np.asarray(np.pi * (weights * x) @ np.stack([eval_legendre(d, x) for d in range(degrees)], axis=-1))
