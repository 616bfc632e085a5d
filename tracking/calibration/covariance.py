"""Covariance of estimated perturbations, and the combinations of them that are unobservable.

With J the Jacobian of the residuals by the perturbations, each counted in its tolerance, and the nuisance parameters
projected out, J = U S V': the combination V_i is known from the data alone to 1 / s_i of a tolerance. One that is known
no better than to `UNOBSERVABLE` tolerances counts as unobservable: it keeps its prior, or infinity when there is none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr
from scipy.stats import norm

from optics.kernels.arrays import FloatArray
from optics.perturbation.parameters import shown_per_si, shown_unit
from tracking.calibration.combinations import in_words, sparse_basis
from tracking.calibration.fit import TURNING_POINT, Fit

UNOBSERVABLE = 10.0
"""Tolerances to which a combination must be known to count as observable: beyond, the Jacobian means nothing."""

SHOWN = 0.05
"""Share of a tolerance below which a perturbation is left out of a combination's description."""

NO_PART = 1e-3
"""Part of a direction that counts as none: less than this of its length."""


@dataclass(frozen=True, kw_only=True)
class PerturbationCovariance:
    """How well perturbations are known; arrays in metres, radians and units of index.

    Attributes
    ----------
    names : tuple of str, length k
    scales : array, shape (k,)
        Tolerances in which they are counted.
    matrix : array, shape (k, k)
        With a prior, of all perturbations; without one, of the observable part, and infinite besides.
    unobservable : array, shape (j, k)
        Combinations that the data say nothing of, in scales, each with 1 at a perturbation of its own.
    data_deviations : array, shape (k,)
        Standard deviations from the data alone, all the others unknown; infinite where unobservable.
    has_prior : bool
    """

    names: tuple[str, ...]
    scales: FloatArray
    matrix: FloatArray
    unobservable: FloatArray
    data_deviations: FloatArray
    has_prior: bool

    def standard_deviations(self) -> FloatArray:
        """Of each perturbation, shape (k,)."""
        return self.standard_deviations_of(np.eye(len(self.names)))

    def standard_deviations_of(self, jacobian: FloatArray) -> FloatArray:
        """Of quantities with derivatives, shape (..., k), by the perturbations; infinite where unobservable."""
        known = np.sqrt(np.maximum(np.einsum("...i,ij,...j->...", jacobian, self.matrix, jacobian), 0.0))
        if self.has_prior or not len(self.unobservable):
            return np.asarray(known)
        counted = jacobian * self.scales
        basis = np.linalg.qr(self.unobservable.T)[0]
        unknown = np.linalg.norm(counted @ basis, axis=-1) > NO_PART * np.linalg.norm(counted, axis=-1)
        return np.where(unknown, np.inf, known)

    def combinations(self) -> tuple[str, ...]:
        """Each unobservable combination, in words and units."""
        units = [shown_unit(name) for name in self.names]
        per_unit = np.array([shown_per_si(name) for name in self.names]) * self.scales
        return tuple(in_words(row, self.names, units, per_unit, least_share=SHOWN) for row in self.unobservable)


def covariance_of(fit: Fit, scales: dict[str, float], *, prior: bool) -> PerturbationCovariance:
    """Covariance of the perturbations that a fit found.

    Notes
    -----
    The estimator is pseudo-Huber's, with psi(r) = r / sqrt(1 + (r / c)^2); its covariance is the sandwich
    ``H^-1 G H^-1`` with H from psi' and G from psi^2 (Huber, Robust Statistics, 1981, section 7.6), to which a normal
    prior adds the same. E[psi^2] / E[psi'] is that of normal noise, or larger where the residuals are wider than they
    were said to be, by more than chance: then the noise that they show takes the place of the one that was given.
    """
    inflation = spread_factor(residual_width(fit.residuals))
    singular, rows = _spectrum(fit)
    unobservable = singular * UNOBSERVABLE < 1
    count = rows.shape[1]
    if prior:
        precision = np.linalg.inv((rows.T * singular**2) @ rows + np.eye(count))
        counted = precision @ ((rows.T * inflation * singular**2) @ rows + np.eye(count)) @ precision
    else:
        observable = ~unobservable
        counted = (rows[observable].T * (inflation / singular[observable] ** 2)) @ rows[observable]
    observable_rows = rows[~unobservable]
    from_data = np.sqrt(inflation * (observable_rows**2 / singular[~unobservable, np.newaxis] ** 2).sum(axis=0))
    touched = np.linalg.norm(rows[unobservable], axis=0) > NO_PART
    sizes = np.array(list(scales.values()))
    return PerturbationCovariance(
        names=tuple(scales),
        scales=sizes,
        matrix=counted * np.outer(sizes, sizes),
        unobservable=sparse_basis(rows[unobservable]),
        data_deviations=np.where(touched, np.inf, from_data) * sizes,
        has_prior=prior,
    )


def unobservable_directions(fit: Fit) -> FloatArray:
    """Orthonormal unobservable combinations of the perturbations, in their scales, shape (j, k)."""
    singular, rows = _spectrum(fit)
    return rows[singular * UNOBSERVABLE < 1]


def _spectrum(fit: Fit) -> tuple[FloatArray, FloatArray]:
    """Singular values, shape (k,), and combinations, shape (k, k), of what the data say."""
    weights = (1 + (np.nan_to_num(fit.residuals) / TURNING_POINT) ** 2) ** -0.75
    reduced = _projected_out(weights[:, np.newaxis] * fit.jacobian, fit.nuisance, weights)
    singular, rows = np.linalg.svd(reduced)[1:]
    return np.pad(singular, (0, len(rows) - len(singular))), rows


def residual_width(residuals: FloatArray) -> float:
    """Standard deviation of residuals by their median size, 1 unless it is larger by more than chance."""
    seen = residuals[np.isfinite(residuals)]
    # Efficiency of the median absolute deviation is 0.37 (Huber 1981): its own relative deviation is 1.17 / sqrt(m).
    width = float(np.median(np.abs(seen)) / norm.ppf(0.75))
    return width if width > 1 + 5 * 1.17 / np.sqrt(len(seen)) else 1.0


def spread_factor(width: float) -> float:
    """E[psi^2] / E[psi'] of pseudo-Huber for normal residuals of a standard deviation."""
    r = np.linspace(-10, 10, 4001)
    density = norm.pdf(r)
    stretched = 1 + (width * r / TURNING_POINT) ** 2
    return float((density * (width * r) ** 2 / stretched).sum() / (density * stretched**-1.5).sum())


def _projected_out(jacobian: FloatArray, nuisance: FloatArray, weights: FloatArray) -> FloatArray:
    """Part of the Jacobian that no change of the nuisance parameters can imitate, square or smaller."""
    below = len(nuisance) - len(jacobian)
    whole = np.concatenate([jacobian, np.zeros((below, jacobian.shape[1]))])
    if nuisance.shape[1]:
        weighted = nuisance * np.concatenate([weights, np.ones(below)])[:, np.newaxis]
        basis, triangle, _ = qr(weighted, mode="economic", pivoting=True)
        size = np.abs(np.diag(triangle))
        basis = basis[:, size > size[0] * len(whole) * np.finfo(np.float64).eps]
        whole = whole - basis @ (basis.T @ whole)
    return np.asarray(np.linalg.qr(whole)[1])
