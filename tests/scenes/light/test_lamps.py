"""Lamps: their light by inverse square and flux, their backscatter by adaptive quadrature along the line of sight."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from optics.kernels.backend import Array3f32, Float32, dr
from optics.kernels.packing import on_device, opaque_numbers
from rigs.lamps import Lamp
from scenes.light.lamps import (
    VISIBLE_NM,
    LampUniforms,
    beam_exponent,
    colour_temperature,
    lamp_backscatter,
    lamp_irradiance,
    lamp_spectrum,
    towards_lamps,
)

SINGLE_PRECISION = 2e-5
WAVELENGTH = np.array([450.0, 550.0, 650.0])
ATTENUATION = np.array([0.12, 0.2, 0.5])
SCATTERING = np.array([0.1, 0.12, 0.1])


def make_lamp(position_m=(0.0, 0.0, 0.0), direction=(1.0, 0.0, 0.0), angle_deg=135.0, **others):
    flux = {} if {"radiant_flux_w", "luminous_flux_lm"} & set(others) else {"luminous_flux_lm": 1500.0}
    position_mm = tuple(1000.0 * value for value in position_m)
    return Lamp(position_mm=position_mm, direction=direction, angle_deg=angle_deg, **flux, **others)


def inputs(lamps):
    return on_device(LampUniforms.of(lamps, WAVELENGTH))


def vectors(array):
    return Array3f32(*(Float32(column.astype(np.float32)) for column in np.transpose(np.atleast_2d(array))))


def numbers32(values):
    return [Float32(float(value)) for value in values]


def fournier_forand_like(angle):
    """Two Henyey-Greenstein lobes, g = 0.924 and -0.3: a forward peak and a back half, as of sea water."""
    cosine = np.cos(angle) if isinstance(angle, float) else dr.cos(angle)
    root = np.sqrt if isinstance(angle, float) else dr.sqrt

    def lobe(g):
        square = 1 + g * g - 2 * g * cosine
        return (1 - g * g) / (4 * np.pi * square * root(square))

    return 0.96 * lobe(0.924) + 0.04 * lobe(-0.3)


def volume_scattering(angle):
    phase = fournier_forand_like(angle)
    return [float(b) * phase for b in SCATTERING]


def backscatter_by_quadrature(lamp, origin, direction, length, band):
    """Single scattering by adaptive quadrature over the distance along the line of sight, in float64."""
    position = np.array(lamp.position_mm) / 1000
    axis = np.array(lamp.direction) / np.linalg.norm(lamp.direction)
    intensity, m = LampUniforms.of([lamp], WAVELENGTH).intensity[0, band], beam_exponent(lamp.angle_deg)

    def integrand(s):
        offset = origin + s * direction - position
        distance = np.linalg.norm(offset)
        cosine = offset @ axis / distance
        if cosine <= 0:
            return 0.0
        angle = float(np.arccos(np.clip(-direction @ offset / distance, -1, 1)))
        scattered = SCATTERING[band] * fournier_forand_like(angle)
        return intensity * cosine**m * scattered * np.exp(-ATTENUATION[band] * (s + distance)) / distance**2

    nearest = float(np.clip((position - origin) @ direction, 0, length))
    ends = np.unique([0.0, *np.clip(nearest + np.array([-0.3, -0.05, 0, 0.05, 0.3, 1, 3]), 0, length), length])
    return sum(quad(integrand, a, b, limit=200, epsrel=1e-8)[0] for a, b in pairwise(ends))


def test_light_falls_with_the_square_the_cosine_and_the_water():
    lamp = make_lamp(position_m=(0.3, 0.1, 0.0))
    point, normal = np.array([2.3, 0.1, 0.0]), np.array([-0.6, 0.0, 0.8])
    seen = lamp_irradiance(inputs([lamp]), vectors(point), vectors(normal), numbers32(ATTENUATION))
    intensity = LampUniforms.of([lamp], WAVELENGTH).intensity[0]
    expected = intensity * 0.6 / 2.0**2 * np.exp(-ATTENUATION * 2.0)
    np.testing.assert_allclose([s[0] for s in seen], expected, rtol=SINGLE_PRECISION)
    (direction, distance), *_ = towards_lamps(inputs([lamp]), vectors(point))
    assert [float(v[0]) for v in direction] == pytest.approx([-1, 0, 0], abs=1e-6)
    assert distance[0] == pytest.approx(2.0, rel=1e-6)


@pytest.mark.parametrize("angle", [20.0, 60.0, 135.0])
def test_half_the_light_at_half_the_angle_and_none_behind(angle):
    half = np.radians(angle) / 2
    directions = np.array([[1.0, 0, 0], [np.cos(half), np.sin(half), 0], [-0.1, 0.995, 0]])
    clear = numbers32([0.0] * 3)
    ahead, beside, behind = np.array(
        lamp_irradiance(inputs([make_lamp(angle_deg=angle)]), vectors(directions), -vectors(directions), clear)[0]
    )
    assert beside == pytest.approx(ahead / 2, rel=1e-4)  # float32 of log(cos), times an exponent of up to 45
    assert behind == 0


@pytest.mark.parametrize("angle", [10.0, 60.0, 170.0])
def test_all_light_arrives_on_a_sphere(angle):
    """Flux through a sphere of 1 m in clear water is the lamp's."""
    polar = np.pi / 2 * (np.arange(20_000) + 0.5) / 20_000
    cosine, ring = np.cos(polar), 2 * np.pi * np.sin(polar) * (np.pi / 2 / 20_000)
    points = np.column_stack([cosine, np.sin(polar), 0 * cosine])
    lamp = make_lamp(angle_deg=angle, radiant_flux_w=20.0)
    seen = lamp_irradiance(inputs([lamp]), vectors(points), -vectors(points), numbers32([0.0] * 3))
    flux = [ring @ s.numpy().astype(np.float64) for s in seen]
    np.testing.assert_allclose(flux, lamp_spectrum(lamp, WAVELENGTH), rtol=1e-4)  # as above


def test_shadowed_lamps_do_not_count_and_others_add_up():
    lamps = [make_lamp(position_m=(0, 0.2, 0)), make_lamp(position_m=(0, -0.2, 0), radiant_flux_w=3.0)]
    point, normal, c = vectors([1.0, 0, 0]), vectors([-1.0, 0, 0]), numbers32(ATTENUATION)
    one, other = (np.ravel(lamp_irradiance(inputs([lamp]), point, normal, c)) for lamp in lamps)
    both = np.ravel(lamp_irradiance(inputs(lamps), point, normal, c))
    np.testing.assert_allclose(both, one + other, rtol=SINGLE_PRECISION)
    lit = [Float32(1) > 0, Float32(0) > 1]
    np.testing.assert_allclose(np.ravel(lamp_irradiance(inputs(lamps), point, normal, c, lit)), one)
    assert np.ravel(lamp_irradiance(inputs([]), point, normal, c)).tolist() == [0, 0, 0]


def test_flux_in_lumens_and_watts():
    """683 lm/W at 555 nm; a white LED of this kind gives some 300 to 350 lm per radiated watt (Ohno 2005)."""
    lamp = make_lamp(luminous_flux_lm=1500.0)
    watts = lamp_spectrum(lamp, VISIBLE_NM).sum()
    assert 300 < 1500 / watts < 360
    same = make_lamp(radiant_flux_w=watts)
    np.testing.assert_allclose(lamp_spectrum(same, WAVELENGTH), lamp_spectrum(lamp, WAVELENGTH), rtol=1e-12)


@pytest.mark.parametrize(("spectrum", "temperature"), [("led", 4600), ("led", 6200), ("led", 8500), ("planck", 2856)])
def test_lamps_have_the_colour_they_are_said_to_have(spectrum, temperature):
    """McCamy's formula is good to 2 K for a glowing body of 2856 to 6500 K (McCamy 1992); illuminant A is 2856 K."""
    lamp = make_lamp(spectrum=spectrum, colour_temperature_k=float(temperature))
    assert colour_temperature(lamp_spectrum(lamp, VISIBLE_NM)) == pytest.approx(temperature, abs=3)


BESIDE = [(0.0, 0.1, 0.0), (0.0, -0.3, 0.2), (0.05, 0.0, 0.5), (-0.1, 0.3, 0.0)]


@pytest.mark.parametrize("angle", [20.0, 40.0, 135.0])
@pytest.mark.parametrize("position", BESIDE)
def test_backscatter_is_its_integral(position, angle):
    """Rationale: over the lamp's angle the integrand is smooth, so eight nodes do what adaptive quadrature does.

    Expected: within 0.5 % of the light of the brightest whole line of sight, for lamps 0.1 to 0.5 m beside the camera
    and segments from 0.1 m to infinity (measured 0.4 %, of it 0.1 % by what is left out beyond the beam's edge).
    """
    lamp, origin, far = make_lamp(position_m=position, angle_deg=angle), np.zeros(3), 200.0
    directions = [np.array([np.cos(a), np.sin(a), 0.0]) for a in (-0.6, -0.2, 0.0, 0.3, 0.6)]
    for band in (0, 2):
        expected = np.array(
            [
                [backscatter_by_quadrature(lamp, origin, d, length, band) for d in directions]
                for length in (0.1, 0.5, 2.0, 10.0, far)
            ]
        )
        for length, row in zip((0.1, 0.5, 2.0, 10.0, np.inf), expected, strict=True):
            seen = lamp_backscatter(
                inputs([lamp]),
                vectors(np.zeros((5, 3))),
                vectors(directions),
                *opaque_numbers(length),
                attenuation=opaque_numbers(ATTENUATION),
                volume_scattering=volume_scattering,
            )
            np.testing.assert_allclose(seen[band], row, atol=0.005 * expected.max())


def test_two_segments_are_one():
    lamp, c = make_lamp(position_m=(0.0, 0.25, 0.1)), numbers32(ATTENUATION)
    direction = np.array([0.8, 0.0, -0.6])
    arguments = {"attenuation": c, "volume_scattering": volume_scattering}
    whole = np.ravel(
        lamp_backscatter(inputs([lamp]), vectors([0, 0, 0]), vectors(direction), Float32(3.0), **arguments)
    )
    near = np.ravel(lamp_backscatter(inputs([lamp]), vectors([0, 0, 0]), vectors(direction), Float32(0.7), **arguments))
    far = lamp_backscatter(inputs([lamp]), vectors(0.7 * direction), vectors(direction), Float32(2.3), **arguments)
    np.testing.assert_allclose(near + np.ravel(far) * np.exp(-ATTENUATION * 0.7), whole, rtol=0.01)  # eight nodes


def test_backscatter_of_an_isotropic_lamp_abreast_in_clear_water():
    """Closed form: along a line that passes an isotropic source at h, the integral of 1 / d^2 is pi / (2 h).

    Half of it lies ahead of a lamp abreast; cos^m with m near zero is the half space, and p = 1 / (4 pi).
    """
    h, lamp = 0.2, make_lamp(position_m=(0.0, 0.2, 0.0), angle_deg=170.0)
    seen = lamp_backscatter(
        replace(inputs([lamp]), exponent=[Float32(0)], edge=[Float32(0)]),
        vectors([0, 0, 0]),
        vectors([1.0, 0, 0]),
        Float32(np.inf),
        attenuation=numbers32([0.0] * 3),
        volume_scattering=lambda angle: [0.1 / (4 * np.pi) + 0 * angle] * 3,
    )
    intensity = LampUniforms.of([lamp], WAVELENGTH).intensity[0]
    np.testing.assert_allclose(np.ravel(seen), intensity * 0.1 / (4 * np.pi) * np.pi / (2 * h), rtol=SINGLE_PRECISION)


def test_a_lamp_behind_the_line_of_sight_adds_nothing():
    lamp = make_lamp(position_m=(0.0, 0.3, 0.0), direction=(0.0, 1.0, 0.0))
    seen = lamp_backscatter(
        inputs([lamp]),
        vectors([0, 0, 0]),
        vectors([1.0, 0, 0]),
        Float32(np.inf),
        attenuation=numbers32(ATTENUATION),
        volume_scattering=volume_scattering,
    )
    assert np.ravel(seen).tolist() == [0, 0, 0]
