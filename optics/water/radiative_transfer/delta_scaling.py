"""Delta-M: light scattered by so little that it counts as not scattered."""

from __future__ import annotations

from dataclasses import dataclass

from optics.kernels.arrays import FloatArray

DEGREES = 64
"""Legendre moments kept: what is scattered within about 180 / 64 degrees goes on as if it were not."""


@dataclass(frozen=True, kw_only=True)
class Scaled:
    """Water without its forward peak (Wiscombe 1977, J. Atmos. Sci. 34, 1408).

    Attributes
    ----------
    forward_fraction : float
        Share f of the scattered light that goes on as if it were not: the first moment that is not kept.
    attenuation : float
        ``a + b (1 - f)``, 1/m.
    albedo : float
        ``b (1 - f) / attenuation``.
    phase_moments : array, shape (DEGREES,)
        ``(chi_l - f) / (1 - f)``.
    """

    forward_fraction: float
    attenuation: float
    albedo: float
    phase_moments: FloatArray


def delta_scaled(absorption: float, scattering: float, moments: FloatArray) -> Scaled:
    """Take the forward peak from the phase function; `moments` has one more than are kept."""
    fraction = float(moments[-1] / moments[0])
    remaining = scattering * (1 - fraction)
    return Scaled(
        forward_fraction=fraction,
        attenuation=absorption + remaining,
        albedo=remaining / (absorption + remaining),
        phase_moments=(moments[:-1] / moments[0] - fraction) / (1 - fraction),
    )
