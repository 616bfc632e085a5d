"""Phase functions of particles: how they scatter light by angle, 1/sr, normalised over the sphere."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import eval_legendre

from optics.kernels.arrays import FloatArray
from optics.kernels.tables import read_table

DATA = Path(__file__).parent / "data"

PETZOLD_INDEX = 1.10
PETZOLD_SLOPE = 3.5835
"""Particle index and Junge slope at which Fournier-Forand fits Petzold's average phase function (backscattered
fraction 0.0183; Mobley, Sundman & Boss 2002, Applied Optics 41, 1035)."""

PETZOLD_HEAD_SLOPE = 1.346
"""Below 0.1 degrees Petzold's average goes on as angle^-1.346 (Mobley et al. 2002)."""

SMALLEST_ANGLE = 1e-8
ANGLES = 8001
"""Tables run from here to pi in logarithmic steps of 0.24 %: log-log interpolation is then good to 3e-6 and the
trapezoidal rule to 1e-6; what lies nearer to the forward direction is a power law, integrated in closed form."""

NEAR_ONE = 1e-3
"""Fournier-Forand is 0 / 0 at delta = 1; this near, its numerator is summed as a series."""


@dataclass(frozen=True, eq=False)
class PhaseFunction:
    """Phase function of particles, tabulated; log-log between its angles, a power law below the first.

    Made by `fournier_forand_phase`, `petzold_phase` or `henyey_greenstein_phase`, normalised to 1 over the sphere.

    Attributes
    ----------
    angle_rad : array, shape (k,)
        Ascending, from `SMALLEST_ANGLE` to pi.
    value : array, shape (k,)
        1/sr.
    """

    angle_rad: FloatArray
    value: FloatArray

    def __call__(self, angle_rad: ArrayLike) -> FloatArray:
        """Phase function at scattering angles in (0, pi], 1/sr, of the angles' shape; 0 counts as 1e-12 rad."""
        logarithm = np.log(np.maximum(np.asarray(angle_rad, dtype=np.float64), 1e-12))
        inside = np.interp(logarithm, np.log(self.angle_rad), np.log(self.value))
        below = np.minimum(logarithm - np.log(self.angle_rad[0]), 0) * self._head_slope
        return np.asarray(np.exp(inside + below))

    def moments(self, count: int) -> FloatArray:
        """First `count` Legendre moments, ``chi_l = 2 pi int p(cos) P_l(cos) d cos``; shape (count,), chi_0 = 1."""
        order = np.arange(count)[:, np.newaxis]
        return np.asarray(eval_legendre(order, np.cos(self.angle_rad)) @ self._shares() + self._head_share)

    def fraction_within(self, angle_rad: ArrayLike) -> FloatArray:
        """Fraction scattered by less than an angle."""
        angle = np.maximum(np.asarray(angle_rad, dtype=np.float64), 0.0)
        first = self.angle_rad[0]
        inside = np.interp(np.log(np.maximum(angle, first)), np.log(self.angle_rad), self._fractions())
        return np.asarray(inside * np.minimum(angle / first, 1) ** (2 + self._head_slope))

    @property
    def mean_cosine(self) -> float:
        """Mean cosine of the scattering angle, g."""
        return float(self.moments(2)[1])

    @property
    def backscattered_fraction(self) -> float:
        """Fraction scattered by more than 90 degrees, B."""
        return float(1 - self.fraction_within(np.pi / 2))

    @property
    def _head_slope(self) -> float:
        """Logarithmic slope at the first angles."""
        return float(np.log(self.value[1] / self.value[0]) / np.log(self.angle_rad[1] / self.angle_rad[0]))

    @property
    def _head_share(self) -> float:
        """Fraction scattered by less than the first angle."""
        return float(2 * np.pi * self.value[0] * self.angle_rad[0] ** 2 / (2 + self._head_slope))

    def _density(self) -> FloatArray:
        """Fraction per unit of the logarithm of the angle."""
        return np.asarray(2 * np.pi * self.value * np.sin(self.angle_rad) * self.angle_rad)

    def _shares(self) -> FloatArray:
        """Fraction that each angle stands for: trapezoidal rule in the logarithm of the angle."""
        step = np.diff(np.log(self.angle_rad))
        return np.asarray(self._density() * (np.append(step, 0) + np.append(0, step)) / 2)

    def _fractions(self) -> FloatArray:
        """Fraction scattered by less than each angle."""
        density = self._density()
        rings = (density[1:] + density[:-1]) / 2 * np.diff(np.log(self.angle_rad))
        return np.asarray(self._head_share + np.append(0, np.cumsum(rings)))


@cache
def fournier_forand_phase(backscattered_fraction: float | None = None) -> PhaseFunction:
    """Fournier-Forand's function by its backscattered fraction; without one, that of Petzold's average.

    One fraction belongs to many pairs of index and slope; Mobley, Sundman & Boss 2002, eq. 8, tie them together (see
    `coupled_index`).
    """
    if backscattered_fraction is None:
        return tabulated(fournier_forand)
    slope = slope_of_backscattered_fraction(backscattered_fraction)
    return tabulated(lambda angle: fournier_forand(angle, coupled_index(slope), slope))


@cache
def petzold_phase() -> PhaseFunction:
    """Petzold's average particle (Mobley 1994, table 3.10): log-log between its angles, a power law below 0.1 deg."""
    table = read_table(DATA / "petzold_average_phase_function.csv")
    angle, value = np.radians(table["angle_deg"]), table["phase_per_sr"]

    def phase(angle_rad: FloatArray) -> FloatArray:
        below = np.minimum(np.log(angle_rad / angle[0]), 0) * -PETZOLD_HEAD_SLOPE
        return np.asarray(np.exp(np.interp(np.log(angle_rad), np.log(angle), np.log(value)) + below))

    return tabulated(phase, extra=angle)


@cache
def henyey_greenstein_phase(mean_cosine: float) -> PhaseFunction:
    """Henyey & Greenstein 1941: one parameter, the mean cosine g; its moments are g^l."""
    return tabulated(lambda angle: henyey_greenstein(angle, mean_cosine))


def tabulated(phase: Callable[[FloatArray], FloatArray], extra: ArrayLike = ()) -> PhaseFunction:
    """Table of a phase function at logarithmic steps and at `extra` angles (where it has kinks), normalised."""
    angle = np.geomspace(SMALLEST_ANGLE, np.pi, ANGLES)
    angle[-1] = np.pi  # geomspace ends one rounding error beyond it, where the sine is negative
    angle = np.unique(np.append(angle, np.minimum(extra, np.pi)))
    raw = PhaseFunction(angle, phase(angle))
    return PhaseFunction(angle, raw.value / raw.moments(1)[0])


def henyey_greenstein(angle: ArrayLike, mean_cosine: float) -> FloatArray:
    """Henyey-Greenstein phase function, 1/sr."""
    g = mean_cosine
    # 1 + g^2 - 2 g cos, without the cancellation of its terms in the forward direction.
    square = (1 - g) ** 2 + 4 * g * np.sin(np.asarray(angle, dtype=np.float64) / 2) ** 2
    return np.asarray((1 - g**2) / (4 * np.pi * square**1.5))


def fournier_forand(angle: ArrayLike, index: float = PETZOLD_INDEX, slope: float = PETZOLD_SLOPE) -> FloatArray:
    """Fournier-Forand phase function, 1/sr (Fournier & Jonasz 1999, SPIE 3761, 62).

    Parameters
    ----------
    angle : array
        Scattering angle, radians, above zero: the function diverges in the forward direction.
    index : float
        Particle refractive index relative to water.
    slope : float
        Slope of the Junge size distribution, 3 to 5.
    """
    psi = np.asarray(angle, dtype=np.float64)
    nu = (3 - slope) / 2
    sine2 = np.sin(psi / 2) ** 2
    delta = 4 / (3 * (index - 1) ** 2) * sine2
    delta_back = 4 / (3 * (index - 1) ** 2)
    power, power_back = delta**nu, delta_back**nu
    forward = _forward_numerator(delta, nu, sine2) / (4 * np.pi * power)
    backward = (1 - power_back) / (16 * np.pi * (delta_back - 1) * power_back) * (3 * np.cos(psi) ** 2 - 1)
    return np.asarray(forward + backward)


def _forward_numerator(delta: FloatArray, nu: float, sine2: FloatArray) -> FloatArray:
    """``[nu (1 - d) - (1 - d^nu) + (d (1 - d^nu) - nu (1 - d)) / sin^2] / (1 - d)^2``, smooth at d = 1."""
    e = 1 - delta
    near = np.abs(e) < NEAR_ONE
    square = np.where(near, 1.0, e) ** 2
    power = delta**nu
    first = (nu * e - (1 - power)) / square
    second = (delta * (1 - power) - nu * e) / square
    # d^nu = 1 - nu e + c2 e^2 - c3 e^3 + c4 e^4 ...: what is left of both after the division by e^2.
    c2 = nu * (nu - 1) / 2
    c3 = c2 * (nu - 2) / 3
    c4 = c3 * (nu - 3) / 4
    first = np.where(near, c2 - c3 * e + c4 * e**2, first)
    second = np.where(near, -(nu + c2) + (c3 + c2) * e - (c4 + c3) * e**2, second)
    return np.asarray(first + second / sine2)


def fournier_forand_backscattered_fraction(index: float = PETZOLD_INDEX, slope: float = PETZOLD_SLOPE) -> float:
    """Fraction scattered by more than 90 degrees (Mobley, Sundman & Boss 2002, eq. 7)."""
    nu = (3 - slope) / 2
    delta = 2 / (3 * (index - 1) ** 2)
    return float(1 - (1 - delta ** (nu + 1) - 0.5 * (1 - delta**nu)) / ((1 - delta) * delta**nu))


def coupled_index(slope: float) -> float:
    """Particle index that goes with a Junge slope: 1.01 + 0.1542 (slope - 3) (Mobley, Sundman & Boss 2002, eq. 8)."""
    return 1.01 + 0.1542 * (slope - 3)


def slope_of_backscattered_fraction(backscattered_fraction: float) -> float:
    """Junge slope at which Fournier-Forand with `coupled_index` scatters a fraction back, 0.001 to 0.05.

    Raises
    ------
    ValueError
        Outside that range.
    """
    if not 0.001 <= backscattered_fraction <= 0.05:
        raise ValueError(f"expected backscattered_fraction from 0.001 to 0.05, got {backscattered_fraction}")
    return float(
        brentq(
            lambda slope: fournier_forand_backscattered_fraction(coupled_index(slope), slope) - backscattered_fraction,
            3.1,
            4.0,
            xtol=1e-12,
        )
    )
