"""Density of water."""

import pytest

from cad.loads.seawater import water_density
from rigs import Water


@pytest.mark.parametrize(
    ("salinity_ppt", "temperature_celsius", "density"),
    [(0, 5, 999.96675), (0, 25, 997.04796), (35, 5, 1027.67547), (35, 25, 1023.34306)],
)
def test_density_at_the_check_values_of_the_equation_of_state(salinity_ppt, temperature_celsius, density):
    """Check values of Unesco 1983, Technical Papers in Marine Science 44, page 19, given to five decimals."""
    water = Water(salinity_ppt=salinity_ppt, temperature_celsius=temperature_celsius)
    assert water_density(water) == pytest.approx(density, abs=5.1e-6)
