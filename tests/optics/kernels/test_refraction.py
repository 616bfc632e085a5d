"""Reflection, Snell and Fresnel against closed forms, and against their complex and amplitude forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optics.kernels.backend import Array3f64, Float64
from optics.kernels.refraction import (
    conductor_reflectance,
    dielectric_transmittance,
    reflect,
    refract,
    window_transmittance,
)

ROUNDING = 4e-15
"""About twenty operations in float64 on numbers of order one."""

DIVIDED = 1e-13
"""As ROUNDING, for quotients whose denominators fall to a tenth near grazing incidence."""

CANCELLED = 1e-10
"""The real-number form of a metal's reflectance subtracts numbers that agree to 1e-5 where n k is smallest."""

angles = st.floats(0.0, 1.5)
azimuths = st.floats(-np.pi, np.pi)
indices = st.floats(1.0, 2.0)


def direction(angle, azimuth=0.0):
    """Unit vector at an angle to z."""
    return np.array([np.sin(angle) * np.cos(azimuth), np.sin(angle) * np.sin(azimuth), np.cos(angle)])


def kernel_vector(vector):
    return Array3f64(*(float(component) for component in vector))


def one(values):
    return np.array([np.array(component)[0] for component in values])


Z = Array3f64(0, 0, 1)


@given(angle=angles, azimuth=azimuths, n1=indices, n2=indices)
def test_snell_conserves_n_times_the_tangential_part(angle, azimuth, n1, n2):
    """Born & Wolf, 1.5.1: n sin(theta) and the plane of incidence are conserved; the result is a unit vector."""
    incoming = direction(angle, azimuth)
    outgoing, transmitted = refract(kernel_vector(incoming), Z, n1 / n2)
    if not np.array(transmitted)[0]:
        assert n1 / n2 * np.sin(angle) >= 1 - ROUNDING
        return
    outgoing = one(outgoing)
    np.testing.assert_allclose(n2 * outgoing[:2], n1 * incoming[:2], rtol=0, atol=ROUNDING)
    assert np.linalg.norm(outgoing) == pytest.approx(1, abs=ROUNDING)
    assert outgoing[2] > 0


@pytest.mark.parametrize(("n_dense", "n_thin"), [(1.333, 1.0), (1.49, 1.333), (1.52, 1.0)])
def test_total_reflection_begins_at_the_critical_angle(n_dense, n_thin):
    """Arcsin of the ratio: 48.6 degrees from water to air. 1e-9 rad below it light passes, above it does not."""
    critical = np.arcsin(n_thin / n_dense)
    below, above = (kernel_vector(direction(critical + sign * 1e-9)) for sign in (-1, 1))
    assert np.array(refract(below, Z, n_dense / n_thin)[1]).all()
    assert not np.array(refract(above, Z, n_dense / n_thin)[1]).any()
    cosine = Float64([np.cos(critical + 1e-9), np.cos(critical + 0.1)])
    assert np.array(dielectric_transmittance(cosine, n_dense, n_thin)).tolist() == [0, 0]


@given(angle=angles, azimuth=azimuths, tilt=angles, turn=azimuths)
def test_reflection_is_its_own_inverse_and_keeps_lengths(angle, azimuth, tilt, turn):
    incoming, normal = kernel_vector(direction(angle, azimuth)), kernel_vector(direction(tilt, turn))
    once = reflect(incoming, normal)
    np.testing.assert_allclose(one(reflect(once, normal)), one(incoming), rtol=0, atol=ROUNDING)
    assert np.linalg.norm(one(once)) == pytest.approx(1, abs=ROUNDING)


@pytest.mark.parametrize(("n1", "n2"), [(1.0, 1.49), (1.49, 1.333), (1.333, 1.0)])
def test_transmittance_at_normal_incidence(n1, n2):
    """Born & Wolf, 1.5.3: T = 4 n1 n2 / (n1 + n2)^2."""
    found = np.array(dielectric_transmittance(Float64(1), n1, n2))
    np.testing.assert_allclose(found, 4 * n1 * n2 / (n1 + n2) ** 2, rtol=ROUNDING)


@pytest.mark.parametrize(("n1", "n2"), [(1.0, 1.49), (1.49, 1.333), (1.333, 1.0)])
def test_only_s_light_is_reflected_at_brewsters_angle(n1, n2):
    """At tan(theta) = n2 / n1, r_p = 0 and r_s = (n1^2 - n2^2) / (n1^2 + n2^2) (Born & Wolf, 1.5.3)."""
    cosine = Float64(np.cos(np.arctan2(n2, n1)))
    r_s = (n1**2 - n2**2) / (n1**2 + n2**2)
    np.testing.assert_allclose(np.array(dielectric_transmittance(cosine, n1, n2)), 1 - r_s**2 / 2, rtol=ROUNDING)


def amplitudes(cosine_in, n1, n2):
    """Fresnel's reflection amplitudes of s and p light; complex indices are allowed (Born & Wolf, 1.5.2 and 14.2)."""
    cosine_out = np.sqrt(1 - (n1 / n2) ** 2 * (1 - cosine_in**2) + 0j)
    r_s = (n1 * cosine_in - n2 * cosine_out) / (n1 * cosine_in + n2 * cosine_out)
    r_p = (n2 * cosine_in - n1 * cosine_out) / (n2 * cosine_in + n1 * cosine_out)
    return r_s, r_p, cosine_out


@given(angle=angles, n1=indices, n2=indices)
def test_what_is_not_reflected_is_transmitted(angle, n1, n2):
    """Energy: T = 1 - (|r_s|^2 + |r_p|^2) / 2 with the amplitudes; the code has the transmitted form instead."""
    r_s, r_p, _ = amplitudes(np.cos(angle), n1, n2)
    expected = 1 - (abs(r_s) ** 2 + abs(r_p) ** 2) / 2
    found = np.array(dielectric_transmittance(Float64(np.cos(angle)), n1, n2))
    np.testing.assert_allclose(found, expected, rtol=0, atol=DIVIDED)


@given(angle=angles, n_window=indices, n_water=indices)
def test_each_polarisation_passes_a_window_on_its_own(angle, n_window, n_water):
    """The mean over s and p of the product of both faces, from the amplitudes; nothing is lost without a window."""
    cosines, passed = [np.cos(angle)], np.ones(2)
    for n1, n2 in ((1.0, n_window), (n_window, n_water)):
        r_s, r_p, cosine_out = amplitudes(cosines[-1], n1, n2)
        passed = passed * (1 - np.abs([r_s, r_p]) ** 2)
        cosines.append(cosine_out.real)
    air, window, water = (Float64(cosine) for cosine in cosines)
    found = window_transmittance((air, window, window, water), (1.0, n_window, n_water))
    np.testing.assert_allclose(np.array(found), passed.mean(), rtol=0, atol=DIVIDED)


def test_unpolarised_faces_multiply_to_less_than_a_window():
    """What keeping the polarisations apart is worth: nothing at normal incidence, 0.04 % at 60 degrees, PMMA in water.

    The light that passes the first face is mostly p, which the second face reflects least.
    """
    cosine = np.cos(np.radians([0, 60]))
    in_window, in_water = (np.sqrt(1 - (1 - cosine**2) / n**2) for n in (1.49, 1.333))
    cosines = [Float64(c) for c in (cosine, in_window, in_window, in_water)]
    window = np.array(window_transmittance(tuple(cosines), (1.0, 1.49, 1.333)))
    product = np.array(
        dielectric_transmittance(cosines[0], 1.0, 1.49) * dielectric_transmittance(cosines[1], 1.49, 1.333)
    )
    assert window[0] == pytest.approx(product[0], abs=ROUNDING)
    assert 0 < window[1] / product[1] - 1 < 1e-3


@given(angle=angles, n=st.floats(0.04, 3.0), k=st.floats(0.1, 8.0), n_medium=indices)
def test_a_metal_reflects_as_its_complex_index_says(angle, n, k, n_medium):
    """The real-number formula against Fresnel's amplitudes with the complex index n + ik."""
    r_s, r_p, _ = amplitudes(np.cos(angle), n_medium, n + 1j * k)
    expected = (abs(r_s) ** 2 + abs(r_p) ** 2) / 2
    found = np.array(conductor_reflectance(Float64(np.cos(angle)), n, k, n_medium))
    np.testing.assert_allclose(found, expected, rtol=0, atol=CANCELLED)
