"""Discrete ordinates: the modes of light in homogeneous, infinitely deep water under a flat surface.

Stamnes, Tsay, Wiscombe & Jayaweera 1988, Applied Optics 27, 2502, with the half-size symmetric eigenproblem of
Nakajima & Tanaka 1986, J. Quant. Spectrosc. Radiat. Transfer 35, 13. `docs/explanation/radiative_transfer.md` writes
the equations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.water.radiative_transfer.quadrature import Streams, harmonics, streams
from optics.water.radiative_transfer.surface import cosine_in_water, internal_reflectance, transmittance

RESONANCE = 1e-7
"""A beam that decays like a mode, to this share, is moved off it by as much: the error it makes, and the one that
rounding would make, are both far below the model's."""


@dataclass(frozen=True, kw_only=True)
class Modes:
    """Solution at one wavelength: light as a sum of terms that decay with optical depth ``tau = c* z``.

    For Fourier order m, stream i and sign s (0 from above, 1 from below) the radiance is ``sum_k radiance[m, s, i, k]
    exp(-rate[m, k] tau)``. The last term k follows the sun's beam; what is of it only scattered once is in it.

    Attributes
    ----------
    rate : array, shape (m, k)
    radiance : array, shape (m, 2, n, k)
    moments : array, shape (m, l, k)
        Of the radiance: ``int Y_lm L_m dmu``.
    """

    streams: Streams
    n_water: float
    albedo: float
    phase_moments: FloatArray
    rate: FloatArray
    radiance: FloatArray
    moments: FloatArray
    sun_cosine: float
    sun_irradiance: float


def solve(
    *,
    albedo: float,
    phase_moments: FloatArray,
    n_water: float,
    sun_cosine_air: float,
    sun_irradiance: float,
    sky_radiance: FloatArray,
    outside: int,
) -> Modes:
    """Solve the radiative-transfer equation for one wavelength.

    Parameters
    ----------
    albedo : float
        Share of the attenuation that is scattering, below 1.
    phase_moments : array, shape (l,)
        Legendre moments of the phase function; the first is 1. As many Fourier orders are solved for.
    sun_irradiance : float
        On a plane normal to the beam, above the surface.
    sky_radiance : array, shape (window,)
        Above the surface, at the cosines `Streams.cosine_air` of as many streams in Snell's window.
    outside : int
        Number of streams per hemisphere outside it.
    """
    nodes = streams(n_water, outside=outside, window=len(sky_radiance))
    transport = _transport(albedo, phase_moments, nodes)
    sun_cosine = float(cosine_in_water(sun_cosine_air, n_water))
    beam = sun_irradiance * float(transmittance(sun_cosine_air, n_water)) * sun_cosine_air / sun_cosine
    both = np.concatenate([transport.harmonics, parity(len(phase_moments))[..., None] * transport.harmonics], axis=-1)
    source = beam_source(albedo * phase_moments, both, sun_cosine) * beam
    beam_rate, particular = _beam_response(transport, nodes, source, 1 / sun_cosine)
    modes = _radiance(transport, transport.eigenvectors, transport.rate[:, None, :])
    amplitude = _amplitudes(nodes, n_water, modes, particular, sky_radiance)
    radiance = np.concatenate([modes * amplitude[:, None, None, :], particular], axis=-1)
    return Modes(
        streams=nodes,
        n_water=n_water,
        albedo=albedo,
        phase_moments=phase_moments,
        rate=np.concatenate([transport.rate, beam_rate[:, None]], axis=-1),
        radiance=radiance,
        moments=radiance_moments(nodes, transport.harmonics, radiance),
        sun_cosine=sun_cosine,
        sun_irradiance=beam,
    )


def beam_source(scattering_moments: FloatArray, legendre: FloatArray, sun_cosine: float) -> FloatArray:
    """Fourier components of a beam's light scattered into a direction, per unit of irradiance normal to it.

    `legendre` has shape (m, l, k), at k cosines; the result has shape (m, k).
    """
    count = len(scattering_moments)
    at_sun = harmonics(count, np.array([sun_cosine]))[..., 0]
    share = np.where(np.arange(count) == 0, 1.0, 2.0) / (2 * np.pi)
    return np.asarray(np.einsum("m,ml,mlk->mk", share, scattering_moments * at_sun, legendre))


def parity(orders: int) -> FloatArray:
    """Sign that a harmonic of order m and degree l takes when the cosine is turned: shape (m, l)."""
    return (-1.0) ** np.add.outer(np.arange(orders), np.arange(orders))


def radiance_moments(nodes: Streams, legendre: FloatArray, radiance: FloatArray) -> FloatArray:
    """Integrals ``int Y_lm L_m dmu`` over both hemispheres: shape (m, l, k) of a radiance (m, 2, n, k)."""
    weighted = legendre * nodes.weight
    return np.asarray(weighted @ radiance[:, 0] + parity(len(legendre))[..., None] * (weighted @ radiance[:, 1]))


@dataclass(frozen=True, kw_only=True)
class _Transport:
    """The equations for sum and difference of both hemispheres, ``S' = -O D`` and ``D' = -E S``, made symmetric.

    Unknowns are multiplied by `scale` = sqrt(weight * cosine). With ``E = C C^T`` and ``C^T O C = V k^2 V^T`` the modes
    are ``S = C^-T V`` and ``D = C V / k``.
    """

    scale: FloatArray
    harmonics: FloatArray
    odd: FloatArray
    factor: FloatArray
    eigenvectors: FloatArray
    rate: FloatArray


def _transport(albedo: float, phase_moments: FloatArray, nodes: Streams) -> _Transport:
    legendre = harmonics(len(phase_moments), nodes.cosine)
    reduced = legendre * np.sqrt(nodes.weight / nodes.cosine)
    scattered = 2 * albedo * phase_moments[:, None] * reduced
    even = parity(len(legendre))[..., None] > 0
    loss = np.diag(1 / nodes.cosine)
    turned = np.swapaxes(reduced, -1, -2)
    sum_operator = loss - turned @ np.where(even, scattered, 0)
    odd = loss - turned @ np.where(even, 0, scattered)
    factor = np.asarray(np.linalg.cholesky(sum_operator), dtype=np.float64)
    squared, vectors = np.linalg.eigh(np.swapaxes(factor, -1, -2) @ odd @ factor)
    return _Transport(
        scale=np.sqrt(nodes.weight * nodes.cosine),
        harmonics=legendre,
        odd=odd,
        factor=factor,
        eigenvectors=vectors,
        rate=np.sqrt(squared),
    )


def _radiance(
    transport: _Transport, mode: FloatArray, rate: FloatArray, source: FloatArray | float = 0.0
) -> FloatArray:
    """Radiance (m, 2, n, k) of columns `mode` (m, n, k) in the basis C^-T that decay at `rate` (m, 1, k)."""
    factor = transport.factor
    total = np.linalg.solve(np.swapaxes(factor, -1, -2), mode)
    difference = (factor @ mode - source) / rate
    both = np.stack([total + difference, total - difference], axis=1) / 2
    return both / transport.scale[:, None]


def _beam_response(
    transport: _Transport, nodes: Streams, source: FloatArray, beam_rate: float
) -> tuple[FloatArray, FloatArray]:
    """Decay rates (m,) and radiance (m, 2, n, 1) that follow the beam, whose source (m, 2 n) is upper, then lower."""
    count = len(nodes.cosine)
    rate = _off_resonance(beam_rate, transport.rate)[:, None, None]
    weighted = transport.scale / nodes.cosine
    down, up = source[:, :count] * weighted, source[:, count:] * weighted
    total, difference = (down + up)[..., None], (down - up)[..., None]
    vectors, factor = transport.eigenvectors, transport.factor
    driven = np.swapaxes(factor @ vectors, -1, -2) @ (rate * difference + transport.odd @ total)
    mode = vectors @ (driven / (transport.rate[..., None] ** 2 - rate**2))
    return rate[:, 0, 0], _radiance(transport, mode, rate, total)


def _off_resonance(beam_rate: float, rate: FloatArray) -> FloatArray:
    """Rate of the beam for each order, moved where a mode decays alike: shape (m,)."""
    near = (np.abs(rate / beam_rate - 1) < RESONANCE).any(axis=-1)
    return np.where(near, beam_rate * (1 + 2 * RESONANCE), beam_rate)


def _amplitudes(
    nodes: Streams, n_water: float, modes: FloatArray, particular: FloatArray, sky_radiance: FloatArray
) -> FloatArray:
    """Amplitudes (m, k) with which light from above is refracted sky and light from below reflected."""
    reflected = internal_reflectance(nodes.cosine, n_water)[:, None]
    arriving = -(particular[:, 0] - reflected * particular[:, 1])
    sky = transmittance(nodes.cosine_air, n_water) * n_water**2 * sky_radiance
    arriving[0, -len(sky) :, 0] += sky
    return np.asarray(np.linalg.solve(modes[:, 0] - reflected * modes[:, 1], arriving)[..., 0], dtype=np.float64)
