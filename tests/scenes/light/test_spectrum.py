"""Camera bands: Gauss rules of a response, what three wavelengths are worth, and colours that become spectra."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from optics.water.water import absorption, scattering
from scenes.light.spectrum import (
    CHANNEL_PEAKS_NM,
    CHANNEL_WIDTH_NM,
    CameraResponse,
    camera_bands,
    gauss_rule,
    read_camera_response,
    reflectance,
    sun_irradiance,
    water_bands,
)
from scenes.light.water_quadrature import DIMMEST, transmissions, water_rule

ROUNDING = 1e-12

PATCHES = [
    "red", "orange", "moderate red", "yellow", "white 9.5 (.05 D)", "dark skin", "light skin", "blue sky", "foliage",
    "blue flower", "bluish green", "purplish blue", "purple", "yellow green", "orange yellow", "blue", "green",
    "magenta", "cyan",
]  # fmt: skip


def test_the_default_response_has_the_rule_of_gauss_and_hermite():
    """Abramowitz & Stegun 25.4.46 for three nodes: 0 and +- sqrt(3) standard deviations, shares 2/3 and 1/6."""
    bands = camera_bands()
    steps = CHANNEL_WIDTH_NM * np.sqrt(3) * np.array([-1, 0, 1])
    expected = np.concatenate([peak + steps for peak in CHANNEL_PEAKS_NM])
    np.testing.assert_allclose(bands.wavelength_nm, expected, rtol=ROUNDING)
    np.testing.assert_allclose(bands.weight, np.kron(np.eye(3), [1 / 6, 2 / 3, 1 / 6]), atol=ROUNDING)


def test_a_gaussian_given_point_by_point_has_the_same_rule():
    """The special case of the general way; the trapezoidal rule of a Gaussian converges faster than any power."""
    points = np.arange(250.0, 851.0)
    nodes, weights = gauss_rule(points, np.exp(-0.5 * ((points - 550) / 30) ** 2), 3)
    np.testing.assert_allclose(nodes, 550 + 30 * np.sqrt(3) * np.array([-1, 0, 1]), rtol=1e-10)
    np.testing.assert_allclose(weights, [1 / 6, 2 / 3, 1 / 6], rtol=1e-9)


def test_a_flat_response_has_the_rule_of_gauss_and_legendre():
    """Three nodes on [-1, 1]: 0 and +- sqrt(3/5), weights 8/18 and 5/18. Tolerance: 601 points for a continuum."""
    points = np.linspace(-1, 1, 601)
    weights = np.ones(601)
    weights[[0, -1]] = 0.5
    nodes, shares = gauss_rule(points, weights, 3)
    np.testing.assert_allclose(nodes, [-np.sqrt(0.6), 0, np.sqrt(0.6)], atol=1e-5)
    np.testing.assert_allclose(shares, [5 / 18, 8 / 18, 5 / 18], atol=1e-5)


@given(
    heights=st.lists(st.floats(0.05, 1), min_size=5, max_size=40),
    coefficients=st.lists(st.floats(-1, 1), min_size=6, max_size=6),
)
def test_three_nodes_integrate_quintics_against_any_response(heights, coefficients):
    points = np.linspace(-1, 1, len(heights))
    weights = np.array(heights)
    nodes, shares = gauss_rule(points, weights, 3)
    assert (shares > 0).all()
    assert shares.sum() == pytest.approx(1, rel=ROUNDING)
    polynomial = np.polynomial.Polynomial(coefficients)
    assert shares @ polynomial(nodes) == pytest.approx(weights @ polynomial(points) / weights.sum(), abs=1e-11)


def transmission_error(channel, jerlov_type, range_m):
    """Transmission through the water by the band's three wavelengths over that by 1-nm steps, less 1."""
    wavelength = np.arange(250.0, 851.0)
    share = np.exp(-0.5 * ((wavelength - CHANNEL_PEAKS_NM[channel]) / CHANNEL_WIDTH_NM) ** 2)

    def transmission(at):
        held = np.clip(at, 400, 700)
        return np.exp(-(absorption(jerlov_type, held) + scattering(jerlov_type, held)) * range_m)

    bands = camera_bands()
    return (
        bands.weight[channel] @ transmission(bands.wavelength_nm) * share.sum() / (share @ transmission(wavelength)) - 1
    )


LARGEST_ERROR = {
    # Metres: red, green, blue; as measured over the six types of Williamson & Hollins, rounded up
    # (docs/explanation/water.md).
    1: (0.019, 0.004, 0.002),
    2: (0.039, 0.009, 0.003),
    5: (0.110, 0.024, 0.005),
    10: (0.234, 0.058, 0.011),
}


@pytest.mark.parametrize("range_m", LARGEST_ERROR)
@pytest.mark.parametrize("jerlov_type", ["IB", "II", "III", "1C", "3C", "5C"])
def test_three_wavelengths_are_worth_what_the_manual_says(jerlov_type, range_m):
    """Rationale: a wide band does not die exponentially; three wavelengths know it only so well.

    Expected: percents in green and blue. In red they make the water up to 11 % too dark behind 5 m: absorption rises
    fourfold between 570 and 605 nm, and a polynomial of degree five does not follow a step.
    """
    for channel, largest in enumerate(LARGEST_ERROR[range_m]):
        assert abs(transmission_error(channel, jerlov_type, range_m)) < largest


ROOT_MEAN_SQUARE = {
    # Metres: red, green, blue of water_bands and of camera_bands; as measured, rounded up (docs/explanation/water.md).
    1: ((0.021, 0.018, 0.011), (0.063, 0.044, 0.023)),
    5: ((0.024, 0.019, 0.013), (0.122, 0.063, 0.029)),
    10: ((0.032, 0.026, 0.020), (0.195, 0.091, 0.040)),
}


@pytest.mark.parametrize("range_m", ROOT_MEAN_SQUARE)
def test_wavelengths_chosen_for_water_are_good_in_waters_they_were_not_chosen_for(range_m):
    """Rationale: a rule that is fitted may know nothing but what it was fitted to.

    Expected: in Solonenko & Mobley's waters (it was fitted in Williamson & Hollins'), 19 colours 3 m deep, the channels
    are right to 1 to 3 %; Gauss' rule of as many wavelengths leaves up to 19 % in red.
    """
    found = [colour_error(bands, range_m) for bands in (water_bands(), camera_bands())]
    for errors, largest in zip(found, ROOT_MEAN_SQUARE[range_m], strict=True):
        assert (errors < largest).all()
    assert (found[0] < found[1]).all()


def colour_error(bands, range_m):
    """Root mean square of the relative error of each channel over six waters and the chart's colours, 3 m deep."""
    wavelength = np.arange(400.0, 701.0)
    peaks = np.array(CHANNEL_PEAKS_NM)[:, np.newaxis]
    share = np.exp(-0.5 * ((wavelength - peaks) / CHANNEL_WIDTH_NM) ** 2)
    share /= share.sum(axis=1, keepdims=True)

    def seen(at, weight, jerlov_type):
        a, b = (f(jerlov_type, at, "solonenko-mobley") for f in (absorption, scattering))
        left = np.exp(-(a + b) * range_m - a * 3.0) * sun_irradiance(at)[0]
        return np.stack([weight @ (reflectance(patch, at) * left) for patch in PATCHES])

    errors = [
        seen(bands.wavelength_nm, bands.weight, jerlov_type) / seen(wavelength, share, jerlov_type) - 1
        for jerlov_type in ("I", "IA", "IB", "II", "III", "1C")
    ]
    return np.sqrt(np.mean(np.square(errors), axis=(0, 1)))


def test_a_rule_for_water_is_a_quadrature(tmp_path):
    """White stays white: weights sum to 1 in each channel, and none is negative; a user's response has one too."""
    rows = [f"{w},{max(0, w - 500)},{max(0, 600 - w)},1" for w in range(400, 701, 50)]
    own = read_camera_response(write(tmp_path / "camera.csv", rows))
    for bands in (water_bands(), water_bands(own)):
        assert bands.weight.shape == (3, 9)
        assert (bands.weight >= 0).all()
        np.testing.assert_allclose(bands.weight.sum(axis=1), 1, rtol=1e-9)
        assert (bands.wavelength_nm >= 400).all()
        assert (bands.wavelength_nm <= 700).all()


def test_a_fitted_rule_is_the_best_of_all_sets():
    """Beside scipy's constrained least squares, set by set, for two wavelengths of a narrow band."""
    points = np.arange(580.0, 621.0)
    weights = np.exp(-0.5 * ((points - 600) / 8) ** 2)
    colours = np.stack([np.ones_like(points), points / 600])
    nodes, found = water_rule(points, weights, colours, 2)

    def error(pair, share):
        spectra = (colours[:, np.newaxis] * transmissions(points)).reshape(-1, len(points))
        truth = spectra @ weights / weights.sum()
        kept = truth > DIMMEST * truth.max()
        at = np.stack([np.interp(pair, points, row) for row in spectra])
        return np.sum((((at @ share) / truth)[kept] - 1) ** 2)

    best = error(nodes, found)
    for pair in combinations(np.arange(580.0, 621.0, 5.0), 2):
        other = minimize_scalar(lambda w, p=pair: error(np.array(p), np.array([w, 1 - w])), bounds=(0, 1))
        assert best <= other.fun * (1 + 1e-9)


def write(path, rows, header="wavelength_nm,red,green,blue"):
    path.write_text("\n".join([header, *rows]), encoding="utf-8")
    return path


def test_a_response_is_read_and_integrated(tmp_path):
    """Three triangles: a Gauss rule has their first two moments, which are the peak and h^2 / 6."""
    peaks, half = (600, 540, 460), 40
    wavelengths = range(400, 701, 20)
    rows = [",".join(str(v) for v in (w, *(max(0, half - abs(w - p)) for p in peaks))) for w in wavelengths]
    response = read_camera_response(write(tmp_path / "camera.csv", ["# made up", *rows]))
    bands = camera_bands(response)
    for row, peak in zip(bands.weight, peaks, strict=True):
        assert row.sum() == pytest.approx(1, rel=ROUNDING)
        assert row @ bands.wavelength_nm == pytest.approx(peak, rel=1e-9)
        # The trapezoidal rule at 0.25 nm adds 0.25^2 / 6 to the variance of a triangle.
        assert row @ (bands.wavelength_nm - peak) ** 2 == pytest.approx(half**2 / 6, abs=0.25**2 / 6 + 1e-6)
    assert isinstance(response, CameraResponse)


@pytest.mark.parametrize(
    ("header", "rows", "words"),
    [
        ("wavelength_nm,red,green", ["400,1,1", "700,1,1"], "expected a column blue"),
        ("wavelength_nm,red,green,blue", ["400,1,1,1", "700,1,x,-1"], "2 problems\n  line 3: expected a number"),
        ("wavelength_nm,red,green,blue", ["500,1,1,1", "400,1,1,1"], "ascending order"),
        ("wavelength_nm,red,green,blue", ["400,1,0,1", "700,1,0,1"], "expected a green response above zero"),
        ("wavelength_nm,red,green,blue", ["400,1,1,1", "900,1,1,1"], "95% of the red response .* got 60%"),
        ("wavelength_nm,red,green,blue", ["400,1,1,1"], "at least 2 wavelengths, got 1"),
        ("wavelength_nm,red,green,blue", ["400,1,1"], "line 2: expected 4 values, got 3"),
    ],
)
def test_a_bad_response_is_a_sentence(tmp_path, header, rows, words):
    with pytest.raises(ValueError, match=rf"(?s)camera\.csv: .*{words}"):
        read_camera_response(write(tmp_path / "camera.csv", rows, header))
