"""Flicker: waves focus the sun on what lies below; a factor on its light, with the variation that was measured at sea.

How strongly the light varies is a table (Darecki, Stramski & Sokolski 2011); how the pattern looks is a model: a
random field across the refracted beam whose size grows with depth as the focal length of waves does.
`docs/explanation/light.md` derives it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import i0e

from optics.kernels.arrays import FloatArray, aligned
from optics.kernels.backend import Array3f32, Float32, UInt32, dr
from optics.kernels.packing import row_of
from optics.kernels.powers import power_of_two
from optics.kernels.tables import read_table
from scenes.light.spectrum import DATA
from scenes.light.waves import GRAVITY, LIGHTEST_WIND_M_PER_S, Wind, cosine_of_turns, variance_per_octave

LARGEST_VARIATION = 1.5
"""Cap of the direct sun's coefficient of variation: a sun that is a small part of the light cannot explain more."""

WAVES_PER_SET = 6

MEAN_INDEPENDENT_WAVES = 9
"""Waves that count: six where a set stands alone, twelve half way between two sizes, 6 / <w1^4 + w2^4> on average."""

SHALLOWEST_M = 0.05
DEEPEST_M = 30.0
TABLE_SIZE = 2048
"""Cells of the tables over depth, even in its logarithm: 0.3 % of depth and of the variation. Below them too
little is left of the direct sun to tell."""

MODE_COUNT = 4
"""Modes over depth that the spreads at all wavelengths are made of."""


@dataclass(frozen=True, kw_only=True)
class FlickerPattern:
    """A moving pattern of light; two sets of waves, for pattern sizes of even and of odd powers of two.

    Attributes
    ----------
    wave_number : array, shape (2, n, 2)
        Turns per pattern size across the beam.
    phase : array, shape (2, n)
        Turns at time zero.
    turns_per_s : array, shape (2, n)
        Of a pattern of size one metre; waves on deep water are slower by the root of their size.
    across : array, shape (2, 3)
        Unit vectors across the refracted beam, world frame.
    size_per_depth : float
        Size of the pattern over depth.
    """

    wave_number: FloatArray
    phase: FloatArray
    turns_per_s: FloatArray
    across: FloatArray
    size_per_depth: float


def irradiance_variation(depth_m: ArrayLike, wavelength_nm: ArrayLike, wind: Wind) -> FloatArray:
    """Coefficient of variation of the total downwelling irradiance under a clear sky, shape (w, z).

    Darecki, Stramski & Sokolski 2011, J. Geophys. Res. 116, C00H09 (0.86 to 9.58 m; 443, 532 and 670 nm; sun high,
    winds of 2 to 7 m/s), interpolated in its logarithm over the logarithm of depth, then over wavelength.
    Extrapolated: above the shallowest depth in proportion to depth, as thin lenses focus; below the deepest by the
    last power of depth; beyond the wavelengths constant. Winds below 1 m/s weaken it in proportion.
    """
    table = read_table(DATA / "darecki2011_irradiance_cv.csv")
    nodes = np.unique(table["wavelength_nm"])
    columns = [_variation_at(table, node, np.asarray(depth_m, dtype=np.float64)) for node in nodes]
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    by_depth = np.array([np.interp(wavelength, nodes, column) for column in np.transpose(columns)])
    return np.asarray(min(wind.speed_m_per_s / LIGHTEST_WIND_M_PER_S, 1.0) * np.exp(by_depth.T))


def _variation_at(table: dict[str, FloatArray], wavelength_nm: float, depth_m: FloatArray) -> FloatArray:
    """Logarithm of the variation over depth at a wavelength of the table."""
    rows = table["wavelength_nm"] == wavelength_nm
    order = np.argsort(table["depth_m"][rows])
    depth, variation = np.log(table["depth_m"][rows][order]), np.log(table["cv"][rows][order])
    log_depth = np.log(depth_m)
    above = np.minimum(log_depth - depth[0], 0)
    below = np.maximum(log_depth - depth[-1], 0) * (variation[-1] - variation[-2]) / (depth[-1] - depth[-2])
    return np.asarray(np.interp(log_depth, depth, variation) + above + below)


def sun_variation(variation: FloatArray, total_irradiance: FloatArray, sun_irradiance: FloatArray) -> FloatArray:
    """Coefficient of variation of the direct sun alone, from that of the total downwelling irradiance.

    Parameters
    ----------
    variation : array
        Of the total, from `irradiance_variation`.
    total_irradiance, sun_irradiance : array, same shape
        Mean downwelling irradiance of all light and of the direct sun, on a clear day.

    Notes
    -----
    Scattered light has lost its memory of the waves, so the sun's part varies alone: ``CV E / E_sun``. Where this
    passes the cap the fourth powers of both are added harmonically, which leaves values below half the cap alone to
    2 %. Without sun there is no variation.
    """
    ratio = np.divide(total_irradiance, sun_irradiance, out=np.zeros_like(variation), where=sun_irradiance > 0)
    own = variation * ratio
    return np.asarray(own / (1 + (own / LARGEST_VARIATION) ** 4) ** 0.25)


def spread_of(variation: FloatArray) -> FloatArray:
    """Spread s of ``exp(s g)`` whose coefficient of variation is `variation`, for the g of the kernel.

    For a Gaussian g it is ``sqrt(log(1 + CV^2))``; for a sum of N cosines of independent phases the moments are
    Bessel functions: ``1 + CV^2 = I0(2 y)^N / I0(y)^(2 N)`` with ``y = s sqrt(2 / N)``.
    """
    spread = np.linspace(0, 2.0, 4001)
    y = spread * np.sqrt(2 / MEAN_INDEPENDENT_WAVES)
    moment = MEAN_INDEPENDENT_WAVES * (np.log(i0e(2 * y)) - 2 * np.log(i0e(y)))
    return np.asarray(np.interp(variation, np.sqrt(np.expm1(moment)), spread))


def pattern_size_per_depth(wind: Wind, n_water: float) -> float:
    """Size of the pattern over depth: the length of the waves whose focus lies there.

    A wave of number k and slope s bends the sun's rays by ``s (1 - 1/n)`` and gathers them at the depth where
    ``z k s (1 - 1/n) = 1``. In the equilibrium range s is the same in every octave, so size is in proportion to depth.
    """
    slope = np.sqrt(variance_per_octave(Wind(speed_m_per_s=max(wind.speed_m_per_s, LIGHTEST_WIND_M_PER_S))))
    return float(2 * np.pi * slope * (1 - 1 / n_water))


def flicker_pattern(wind: Wind, towards_sun: FloatArray, n_water: float, seed: int = 0) -> FlickerPattern:
    """Draw a pattern: the same numbers and seed give the same one. `towards_sun` is the refracted sun, world frame."""
    rng = np.random.default_rng(seed)
    shape = (2, WAVES_PER_SET)
    # Stratified over an octave and a half of sizes and over all orientations, the two in orders of their own.
    size = (np.array([rng.permutation(WAVES_PER_SET) for _ in range(2)]) + rng.random(shape)) / WAVES_PER_SET
    angle = np.pi * ((np.arange(WAVES_PER_SET) + rng.random(shape)) / WAVES_PER_SET + rng.integers(0, 2, shape))
    number = 2 ** (1.5 * size - 0.75)
    level = np.cross([0.0, 0.0, 1.0], towards_sun)
    length = np.linalg.norm(level)
    level = level / length if length > 1e-9 else np.array([0.0, 1.0, 0.0])
    return FlickerPattern(
        wave_number=number[..., np.newaxis] * np.stack([np.cos(angle), np.sin(angle)], axis=-1),
        phase=rng.random(shape),
        turns_per_s=np.sqrt(GRAVITY * number / (2 * np.pi)),
        across=np.array([level, np.cross(towards_sun, level)]),
        size_per_depth=pattern_size_per_depth(wind, n_water),
    )


def depth_nodes() -> FloatArray:
    """Depths at which `flicker_parameters` wants the sun's variation, shape (TABLE_SIZE,)."""
    return np.geomspace(SHALLOWEST_M, DEEPEST_M, TABLE_SIZE)


@dataclass(frozen=True, kw_only=True)
class FlickerUniforms:
    """A pattern of light as `flicker` takes it.

    Attributes
    ----------
    mix : shape (w, MODE_COUNT)
        Of the table's columns at each wavelength (`flicker_modes`).
    waves : shape (2, WAVES_PER_SET, 4)
        Turns along both axes, phase, and turns per second; in single precision phases are good to a hundredth of a
        turn for an hour.
    across : shape (2, 3)
        Unit vectors across the refracted beam, world frame.
    octave
        Logarithm of the pattern's size over depth, to the base two.
    """

    mix: Any
    waves: Any
    across: Any
    octave: Any

    @classmethod
    def of(cls, pattern: FlickerPattern, mix: FloatArray) -> FlickerUniforms:
        """What of a pattern stays as it is."""
        columns = [pattern.wave_number, pattern.phase[..., np.newaxis], pattern.turns_per_s[..., np.newaxis]]
        waves = np.concatenate(columns, axis=-1)
        return cls(mix=mix, waves=waves, across=pattern.across, octave=np.log2(pattern.size_per_depth))


def flicker_modes(variation: FloatArray) -> tuple[Any, FloatArray]:
    """Table of `flicker` and the mix of its columns at each wavelength, shape (w, MODE_COUNT).

    Parameters
    ----------
    variation : array, shape (w, TABLE_SIZE)
        Coefficient of variation of the direct sun at `depth_nodes`, from `sun_variation`.

    Notes
    -----
    Spreads of neighbouring wavelengths are alike: a few modes over depth (singular vectors) hold them all, and the
    kernel looks up four numbers instead of one for each wavelength.
    """
    left, size, right = np.linalg.svd(spread_of(variation).T, full_matrices=False)
    count = min(MODE_COUNT, len(size))
    modes, mix = np.zeros((TABLE_SIZE, MODE_COUNT)), np.zeros((len(variation), MODE_COUNT))
    modes[:, :count], mix[:, :count] = left[:, :count] * size[:count], right[:count].T
    return Float32(aligned(modes, np.float32)), mix


def flicker(pattern: FlickerUniforms, time_s: Any, table: Any, point_world: Any, depth: Any) -> list[Any]:
    """Kernel: factor on the direct sun's light at points, at each wavelength; its mean is one.

    Twelve cosines, and an exponential for each wavelength.
    """
    depth = dr.clip(depth, SHALLOWEST_M, DEEPEST_M)
    octave = dr.log2(depth)
    field, fourth_powers = _field(pattern, time_s, point_world, octave + pattern.octave)
    steps = (TABLE_SIZE - 1) / np.log2(DEEPEST_M / SHALLOWEST_M)
    cell = UInt32(dr.fma(octave, steps, 0.5 - steps * np.log2(SHALLOWEST_M)))
    modes = row_of(table, dr.minimum(cell, TABLE_SIZE - 1), MODE_COUNT)
    factors = []
    for mix in pattern.mix:
        spread = mix[0] * modes[0]
        for weight, mode in zip(mix[1:], modes[1:], strict=True):
            spread = dr.fma(weight, mode, spread)
        square = dr.square(spread)
        # Logarithm of the mean of exp(s g): s^2 / 2 of a Gaussian, and the next term of the Bessel functions.
        mean = square * dr.fma(fourth_powers / (-16 * WAVES_PER_SET), square, 0.5)
        factors.append(power_of_two((spread * field - mean) * np.log2(np.e)))
    return factors


def _field(pattern: FlickerUniforms, time_s: Any, point: Any, octave: Any) -> tuple[Any, Any]:
    """Random field of unit variance, and the sum of the fourth powers of its two sets' weights.

    The octave is the logarithm of the pattern's size in metres. Sizes are powers of two, and a depth between two of
    them mixes both. One of them is even and one is odd, so two sets of waves serve all depths, and the pattern does
    not shear with depth as one that is stretched would.
    """
    first, second = (dr.dot(Array3f32(*axis), point) for axis in pattern.across)
    even, odd = 2 * dr.round(octave / 2), dr.fma(2, dr.floor(octave / 2), 1)
    odd_share = dr.abs(octave - even)
    even_root = power_of_two(even / -2)
    odd_root = even_root * dr.select(odd > even, Float32(0.5**0.5), Float32(2**0.5))
    total = Float32(0)
    for waves, root, share in zip(pattern.waves, (even_root, odd_root), (1 - odd_share, odd_share), strict=True):
        scale, pace = dr.square(root), root * time_s
        u, v = first * scale, second * scale
        set_sum = Float32(0)
        for along_u, along_v, phase, turns_per_s in waves:
            turns = dr.fma(along_u, u, dr.fma(along_v, v, dr.fma(-turns_per_s, pace, phase)))
            set_sum = set_sum + cosine_of_turns(turns)
        total = dr.fma(dr.safe_sqrt(share * (2 / WAVES_PER_SET)), set_sum, total)
    return total, dr.square(odd_share) + dr.square(1 - odd_share)
