"""Streams: the directions in which discrete ordinates follow light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import assoc_legendre_p_all, gammaln

from optics.kernels.arrays import FloatArray
from optics.water.radiative_transfer.surface import cosine_in_water, critical_cosine


@dataclass(frozen=True, kw_only=True)
class Streams:
    """Directions of one hemisphere, ascending; the other hemisphere has the same with the sign turned.

    Attributes
    ----------
    cosine, weight : arrays, shape (n,)
        Quadrature over the cosine from 0 to 1.
    cosine_air : array, shape (n_window,)
        Cosines above the surface of the last `n_window` streams, which are those in Snell's window.
    """

    cosine: FloatArray
    weight: FloatArray
    cosine_air: FloatArray


def streams(n_water: float, *, outside: int, window: int) -> Streams:
    """Gauss-Legendre nodes outside Snell's window and, in it, nodes in the cosine of the *air*.

    At the edge of the window the surface's transmittance starts like a square root of the cosine in water, but is
    smooth in the cosine in air, ``mu dmu = mu_air dmu_air / n^2``: nodes there bring back the fast convergence and lie
    dense at the edge.
    """
    nodes, weights = np.polynomial.legendre.leggauss(outside)
    edge = float(critical_cosine(n_water))
    outer, outer_weight = edge * (1 + nodes) / 2, edge * weights / 2
    air, weights = window_cosines_air(window), np.polynomial.legendre.leggauss(window)[1]
    inner = cosine_in_water(air, n_water)
    return Streams(
        cosine=np.concatenate([outer, inner]),
        weight=np.concatenate([outer_weight, weights / 2 * air / (n_water**2 * inner)]),
        cosine_air=air,
    )


def window_cosines_air(count: int) -> FloatArray:
    """Cosines above the surface of the streams in Snell's window, whatever the water's index."""
    return np.asarray((1 + np.polynomial.legendre.leggauss(count)[0]) / 2)


def harmonics(degrees: int, cosine: FloatArray) -> FloatArray:
    """Associated Legendre functions, normalised to ``int_-1^1 Y^2 = 1``.

    Returns
    -------
    array, shape (m, l, k)
        Orders 0 to `degrees` - 1, degrees 0 to `degrees` - 1 (zero where l < m), at the k cosines.
    """
    # SciPy 1.17's own norm=True forgets the norm at cosines of exactly 1 and -1.
    table = assoc_legendre_p_all(degrees - 1, degrees - 1, cosine)[0][:, :degrees]
    degree, order = np.arange(degrees)[:, None], np.arange(degrees)
    ratio = gammaln(np.maximum(degree - order, 0) + 1) - gammaln(degree + order + 1)
    normalised = table * np.sqrt((2 * degree + 1) / 2 * np.exp(ratio))[..., None]
    return np.ascontiguousarray(np.moveaxis(normalised, 1, 0))
