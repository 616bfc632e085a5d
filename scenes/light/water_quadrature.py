"""Quadrature of a wide band under water: few wavelengths, chosen for light that water has been at.

A Gauss rule is exact for polynomials, and under water nothing is one: absorption rises fourfold within the red band,
and what is left of it behind some metres is its short end. So wavelengths and weights are chosen here for what a
camera sees under water: colours, lit from some depth, through some metres.
"""

from __future__ import annotations

from itertools import combinations
from typing import cast

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from optics.water.water import absorption, scattering
from rigs import JerlovType
from rigs.water import TYPES_OF_SOURCE

CANDIDATE_STEP_NM = 5.0
SMALLEST_RESPONSE = 0.005
"""Candidates are the wavelengths at which the response is at least this share of its largest."""

RANGES_M = (0.0, 1.0, 2.0, 3.0, 5.0, 8.0, 10.0)
DEPTHS_M = (0.0, 5.0, 10.0)
"""Light comes down to each depth, as exp(-a depth) (scattering hardly dims it), and to the eye, as exp(-c range)."""

DIMMEST = 1e-3
"""Colours of which less is left in the band are not fitted: nobody sees them."""


def water_rule(
    points: FloatArray, weights: FloatArray, colours: FloatArray, count: int
) -> tuple[FloatArray, FloatArray]:
    """Wavelengths (count,) and weights (count,) that integrate a band under water with the least relative error.

    Parameters
    ----------
    points, weights : array, shape (k,)
        Wavelengths in nanometres, ascending within 400 to 700, and the response that each stands for.
    colours : array, shape (c, k)
        Reflectance or radiance spectra of what is to be seen; white is one of them.
    count : int
        Number of wavelengths of the rule. All sets of `count` candidates are tried.
    """
    wavelength = _candidates(points, weights)
    truth = np.ravel((colours * (weights / weights.sum())) @ transmissions(points).T)
    seen = truth > DIMMEST * truth.max()
    reflected = np.stack([np.interp(wavelength, points, colour) for colour in colours])
    spectra = (reflected[:, np.newaxis] * transmissions(wavelength)).reshape(-1, len(wavelength))
    relative = spectra[seen] / truth[seen, np.newaxis]
    chosen = np.array(list(combinations(range(len(wavelength)), count)))
    found, error = _fit(relative, chosen)
    best = int(np.argmin(np.where((found > 0).all(axis=1), error, np.inf)))
    return wavelength[chosen[best]], found[best]


def transmissions(wavelength_nm: FloatArray) -> FloatArray:
    """Of daylight to each depth and from there to the eye, for every Jerlov type; shape (t, k)."""
    rows = []
    for jerlov_type in TYPES_OF_SOURCE["williamson-hollins"]:
        a = absorption(cast("JerlovType", jerlov_type), wavelength_nm)
        c = a + scattering(cast("JerlovType", jerlov_type), wavelength_nm)
        rows += [np.exp(-a * depth - c * distance) for depth in DEPTHS_M for distance in RANGES_M]
    return np.stack(rows)


def _candidates(points: FloatArray, weights: FloatArray) -> FloatArray:
    within = points[weights >= SMALLEST_RESPONSE * weights.max()]
    steps = np.floor((within[-1] - within[0]) / CANDIDATE_STEP_NM)
    return np.asarray(within[0] + CANDIDATE_STEP_NM * np.arange(steps + 1))


def _fit(relative: FloatArray, chosen: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
    """Least squares of ``relative[:, chosen] @ w = 1`` with the weights' sum at 1, for all sets at once.

    Lagrange's conditions: ``G w + l = g, sum w = 1`` with the normal matrix G and right-hand side g.
    """
    normal, right = relative.T @ relative, relative.sum(axis=0)
    sets, count = chosen.shape
    matrix = np.ones((sets, count + 1, count + 1))
    matrix[:, :count, :count] = normal[chosen[:, :, np.newaxis], chosen[:, np.newaxis, :]]
    matrix[:, count, count] = 0
    target = np.ones((sets, count + 1, 1))
    target[:, :count, 0] = right[chosen]
    weights = np.linalg.solve(matrix, target)[:, :count, 0]
    quadratic = np.einsum("si,sij,sj->s", weights, matrix[:, :count, :count], weights)
    return weights, quadratic - 2 * np.einsum("si,si->s", weights, right[chosen])
