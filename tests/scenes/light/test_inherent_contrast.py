"""How red a ball is beside the water behind it."""

import numpy as np
import pytest

from optics.water.radiative_transfer.column import multiple_radiance, once_radiance, solve_columns
from optics.water.radiative_transfer.field import WINDOW_STREAMS
from optics.water.radiative_transfer.quadrature import window_cosines_air
from rigs import Water
from scenes.light.inherent_contrast import AZIMUTHS_RAD, level_radiance, red_over_water
from scenes.light.light import underwater_light
from scenes.light.materials import Material
from scenes.light.spectrum import reflectance

DEPTH_M = 5.0


@pytest.fixture(scope="module")
def light():
    return underwater_light(Water(jerlov_type="IB"))


def test_open_water_looked_at_level_is_as_bright_as_the_solution_says(light):
    """Rationale: by streams and modes of each wavelength, with the sun's light scattered once along each level line.

    Expected: 1 %, what the tables interpolate.
    """
    columns = solve_columns(
        light.optics,
        sun_cosine_air=light.daylight.sun.cosine,
        sun_irradiance=light.daylight.sun_irradiance,
        sky_radiance=light.daylight.sky_radiance(window_cosines_air(WINDOW_STREAMS)),
    )
    where = np.array([DEPTH_M]), np.array([1e-6]), AZIMUTHS_RAD
    expected = [(multiple_radiance(c, *where) + once_radiance(c, *where)).mean() for c in columns]
    np.testing.assert_allclose(level_radiance(light, DEPTH_M), expected, rtol=0.01)


def test_two_bodies_differ_by_their_reflectance_alone(light):
    """Of a grey one the reflectance hardly depends on the wavelength, and is the same factor for every light."""
    grey, white = Material.PRINT_GREY, Material.PRINT_WHITE
    found = [red_over_water(light, DEPTH_M, each) for each in (grey, white)]
    red = light.bands.weight[0]
    shares = [red @ reflectance(name, light.bands.wavelength_nm) for name in ("neutral 5 (.70 D)", "white 9.5 (.05 D)")]
    assert found[0] - found[1] == pytest.approx(np.log(shares[0] / shares[1]), abs=0.05)


def test_red_fades_with_depth(light):
    """At 5 m in clear water a red ball is more than twice as bright as the water in red, at 20 m it is darker."""
    found = [red_over_water(light, depth, Material.TARGET) for depth in (2.0, 5.0, 10.0, 20.0)]
    assert np.all(np.diff(found) < 0)
    assert found[1] > np.log(2)
    assert found[-1] < 0
