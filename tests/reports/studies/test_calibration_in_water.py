"""Table 1's counterpart: exact where it must be, closed form against quadrature and against the exact train."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from optics.camera import PinholeCamera, camera_from_spec
from optics.ports.port import DomePort, NoPort
from optics.status import Status
from optics.train import OpticalTrain
from optics.water.water import water_index
from reports.studies.calibration_board import BOARDS
from reports.studies.calibration_in_water import (
    PAPER_TABLE_1,
    Medium,
    Model,
    View,
    calibrate,
    calibration_study,
    checkerboard_views,
    even_disc_ratio,
    pinhole_ratio_on_disc,
    port_in,
)
from rigs import Rig
from rigs.port import NoPortSpec

BENCH = Rig.load("bench")

CAMERA = camera_from_spec(BENCH.camera)

FLOAT32_PX = 1e-3
"""OpenCV is given float32 corners (6e-5 px at 1000 px), with thousands of them: focal lengths are better than this."""


def views_of(port, *, radius_px=870.0, noise_px=0.0, seed=0, board="large", camera=CAMERA):
    train = OpticalTrain(camera=camera, port=port)
    rng = np.random.default_rng(seed)
    return checkerboard_views(train, BOARDS[board], radius_px=radius_px, noise_px=noise_px, rng=rng)


def fit(views, model, camera=CAMERA):
    return calibrate(views, camera, model, medium=Medium.AIR, radius_px=870.0)


@pytest.fixture(scope="module")
def study():
    return {(found.medium, found.model): found for found in calibration_study(BENCH)}


@pytest.mark.parametrize("model", Model)
@pytest.mark.parametrize("port", [NoPort(), DomePort(radius_m=0.05, thickness_m=0.005)], ids=["none", "centred dome"])
def test_without_refraction_every_model_finds_the_camera(model, port):
    """A centred dome refracts nothing, so there too the camera is the one in air."""
    found = fit(views_of(port), model)
    numbers = (found.fx_px, found.fy_px, found.cx_px, found.cy_px)
    np.testing.assert_allclose(numbers, PAPER_TABLE_1[Medium.AIR], rtol=0, atol=FLOAT32_PX)
    np.testing.assert_allclose(found.distortion, 0, atol=1e-5)
    assert found.rms_px < FLOAT32_PX


def test_the_lens_own_distortion_is_found():
    distortion = (-0.05, 0.01, 1e-3, -5e-4, -1e-3)
    numbers = {name: getattr(CAMERA, name) for name in ("width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px")}
    camera = PinholeCamera(**numbers, distortion=distortion)
    found = fit(views_of(NoPort(), camera=camera), Model.FIVE_TERMS, camera)
    np.testing.assert_allclose(found.distortion, distortion, rtol=0, atol=1e-5)
    assert found.ratio == pytest.approx(1, abs=1e-5)


def test_the_ratio_on_a_disc_is_the_integral():
    """The definition by quadrature, with the ray in water from Snell's sines."""

    def slope_in_water(x, n):
        sine = np.sin(np.arctan(x)) / n
        return sine / np.sqrt(1 - sine**2)

    for n in (1.2, 1.334, 1.5):
        for radius in (0.3, 1.0, 1.83, 3.0):
            products, _ = quad(lambda x, n=n: x * x * slope_in_water(x, n), 0, radius, epsabs=1e-13)
            squares, _ = quad(lambda x, n=n: x * slope_in_water(x, n) ** 2, 0, radius, epsabs=1e-13)
            # The closed form loses digits as the inverse fourth power of the radius: 1e-14 at 0.3.
            assert pinhole_ratio_on_disc(n, radius) == pytest.approx(products / squares, rel=1e-11)


@given(n=st.floats(1.05, 1.6))
def test_the_ratio_tends_to_n_on_the_axis(n):
    """F / f = n + O(R^2): four times less with every halving."""
    excess = [pinhole_ratio_on_disc(n, radius) - n for radius in (0.1, 0.05)]
    assert excess[0] / excess[1] == pytest.approx(4, rel=0.02)


def test_the_paper_s_ratio_is_that_of_a_disc_of_870_px():
    """Table 1: 876.80 / 476.42 and 879.63 / 476.42, at 870 px to half a percent; the index itself is 1.334, 1.340."""
    air = PAPER_TABLE_1[Medium.AIR][0]
    for medium in (Medium.DISTILLED, Medium.SALT):
        ratio = even_disc_ratio(BENCH, medium, 870.0)
        assert ratio == pytest.approx(PAPER_TABLE_1[medium][0] / air, rel=5e-3)
        assert ratio > 1.35 * port_in(BENCH, medium).n_water


def test_the_ratio_on_a_disc_is_what_exact_rays_give():
    """Distant points that fill the disc evenly, through the whole train, fitted with known places.

    The board's image is replaced by 4000 evenly spread pixels traced 1 km far: the viewpoint's shift is 1e-5 of it.
    A sunflower's points weigh the disc evenly to 1 / count.
    """
    index = np.arange(4000) + 0.5
    radius, turn = 870.0 * np.sqrt(index / 4000), np.pi * (1 + 5**0.5) * index
    camera = PinholeCamera(width_px=1920, height_px=1920, fx_px=476.42, fy_px=476.42, cx_px=959.5, cy_px=959.5)
    train = OpticalTrain(camera=camera, port=port_in(BENCH, Medium.DISTILLED))
    pixels = 959.5 + np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)
    rays = train.trace(pixels)
    assert (rays.status == Status.OK).all()
    points = rays.origin_m + 1000.0 * rays.direction
    found = fit([View(on_board_m=points, in_camera_m=points, pixels=pixels)], Model.KNOWN_POSES, camera)
    assert found.ratio == pytest.approx(even_disc_ratio(BENCH, Medium.DISTILLED, 870.0), rel=1e-3)


def test_air_is_air(study):
    """In air the window only displaces rays: the camera comes out to a percent, with any model."""
    for model in Model:
        found = study[Medium.AIR, model]
        assert found.ratio == pytest.approx(1, abs=0.01)
        assert found.cx_px == pytest.approx(960.68, abs=0.1)


def test_radial_terms_bring_the_ratio_near_the_index_and_its_absence_does_not(study):
    """On the full disc: 1.39 and 1.36 with two and five terms, 1.93 and a misfit of 47 px without (measured).

    The remainder above n = 1.334 is what a polynomial cannot fit, and the viewpoint that moves with the angle.
    """
    for medium in (Medium.DISTILLED, Medium.SALT):
        n = port_in(BENCH, medium).n_water
        assert n < study[medium, Model.FIVE_TERMS].ratio < study[medium, Model.TWO_RADIAL].ratio < 1.05 * n
        assert study[medium, Model.PINHOLE].ratio > 1.4 * n
        assert study[medium, Model.PINHOLE].rms_px > 20 * study[medium, Model.TWO_RADIAL].rms_px


def test_salt_lengthens_the_focal_length_a_little_as_in_the_paper(study):
    """Table 1: 879.63 / 876.80 = 1.003; the indices' ratio is 1.004."""
    for model in Model:
        ratio = study[Medium.SALT, model].fx_px / study[Medium.DISTILLED, model].fx_px
        assert 1.002 < ratio < 1.010


def test_without_radial_terms_the_board_decides(study):
    """A small sheet carried around finds 0.67, one that fills the image 1.93; with five terms both find 1.34-1.36."""
    small = {found.model: found for found in calibration_study(BENCH, board=BOARDS["small"], media=[Medium.DISTILLED])}
    assert small[Model.PINHOLE].ratio < 0.8
    assert study[Medium.DISTILLED, Model.PINHOLE].ratio > 1.8
    five = [small[Model.FIVE_TERMS].ratio, study[Medium.DISTILLED, Model.FIVE_TERMS].ratio]
    assert five[0] == pytest.approx(five[1], rel=0.02)


def test_smaller_discs_come_closer_to_the_index():
    n = port_in(BENCH, Medium.DISTILLED).n_water
    excess = []
    for radius in (200.0, 400.0, 800.0):
        found = calibration_study(BENCH, radius_px=radius, media=[Medium.DISTILLED])
        excess.append({calibration.model: abs(calibration.ratio - n) for calibration in found})
    for model in Model:
        assert excess[0][model] < excess[1][model] < excess[2][model]
    assert excess[0][Model.FIVE_TERMS] < 2e-3


def test_media_differ_by_their_index_alone():
    assert port_in(BENCH, Medium.AIR).n_water == 1.0
    assert port_in(BENCH, Medium.DISTILLED).n_water == water_index(550.0, 0.0, 20.0)
    assert port_in(BENCH, Medium.SALT).n_water == water_index(550.0, 30.0, 20.0)


def test_noise_is_seeded_and_as_large_as_it_is_said():
    quiet = views_of(NoPort())
    views = views_of(NoPort(), noise_px=0.5, seed=3)
    np.testing.assert_array_equal(views[0].pixels, views_of(NoPort(), noise_px=0.5, seed=3)[0].pixels)
    errors = np.concatenate([noisy.pixels - exact.pixels for noisy, exact in zip(views, quiet, strict=True)])
    # Of 45,000 normal numbers the standard deviation is known to 0.33 %; four of these.
    assert errors.std() == pytest.approx(0.5, rel=0.0133)
    # The rms is of distances: sqrt(2) per coordinate.
    assert fit(views, Model.FIVE_TERMS).rms_px == pytest.approx(0.5 * np.sqrt(2), rel=0.015)


def test_the_closed_form_says_where_it_does_not_apply():
    assert even_disc_ratio(Rig.load("bluerov2"), Medium.SALT, 500.0) is None
    assert even_disc_ratio(BENCH, Medium.AIR, 500.0) is None


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"radius_px": 20.0}, "expected at least 5 views with 12 corners within radius_px, got 0 with radius_px = 20"),
        ({"radius_px": -1.0}, "expected radius_px > 0, got -1"),
        ({"radius_px": np.nan}, "expected radius_px > 0, got nan"),
        ({"noise_px": -1.0}, "expected noise_px >= 0, got -1"),
        ({"noise_px": np.inf}, "expected noise_px >= 0, got inf"),
    ],
)
def test_wrong_numbers_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        calibration_study(BENCH, **options)


def test_there_is_nothing_to_calibrate_through_without_a_port():
    bare = BENCH.model_copy(update={"port": NoPortSpec(shape="none")})
    with pytest.raises(ValueError, match="expected a rig with a port to calibrate through, got 'bench'"):
        calibration_study(bare)
    with pytest.raises(ValueError, match="expected n_water > 1 and disc_radius > 0"):
        pinhole_ratio_on_disc(1.0, 1.0)
