"""Weight, buoyancy, trim and ballast."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cad.loads.hydrostatics import ballast, hydrostatics
from cad.loads.masses import GRAVITY_M_PER_S2
from rigs import Rig
from rigs.catalogue import MATERIALS

WATER = 1025.0
HULL = {
    "least_m": np.array([-0.5, -0.2, -0.1]),
    "greatest_m": np.array([0.5, 0.2, 0.1]),
    "density_kg_per_m3": WATER,
}


def force_of(weight):
    """Weight less buoyancy of a piece of ballast, N."""
    return GRAVITY_M_PER_S2 * (weight.mass_kg - WATER * weight.volume_m3)


@given(
    weight_n=st.floats(-20, 20).filter(lambda value: abs(value) > 1e-3),
    x=st.floats(-2, 2),
    y=st.floats(-0.1, 0.1),
    shift=st.floats(-0.05, 0.05),
)
def test_ballast_takes_away_weight_and_moments(weight_n, x, y, shift):
    centre = np.array([shift, -shift, 0.0])
    moment = np.array([-weight_n * y, weight_n * x])
    pieces = ballast(weight_n, moment, centre_m=centre, **HULL)
    forces = np.array([force_of(piece) for piece in pieces])
    arms = np.array([piece.position_m - centre for piece in pieces])
    assert forces.sum() == pytest.approx(-weight_n, rel=1e-9)
    assert forces @ arms[:, 0] == pytest.approx(-weight_n * x, rel=1e-9, abs=1e-9)
    assert forces @ arms[:, 1] == pytest.approx(-weight_n * y, rel=1e-9, abs=1e-9)
    assert all(piece.mass_kg >= 0 and piece.volume_m3 >= 0 for piece in pieces)
    for piece in pieces:
        assert piece.mass_kg == pytest.approx(piece.volume_m3 * MATERIALS[piece.material].density_kg_per_m3)


def test_a_pure_moment_is_met_with_foam_at_one_end_and_lead_at_the_other():
    """1 N m bow down over a hull of 1 m: 1 N of lift at the bow, 1 N of weight at the stern."""
    bow, stern = ballast(0.0, np.array([0.0, 1.0]), centre_m=np.zeros(3), **HULL)
    assert (bow.material, stern.material) == ("foam", "lead")
    assert force_of(bow) == pytest.approx(-1.0)
    assert force_of(stern) == pytest.approx(1.0)


def test_the_mount_weighs_what_its_parts_weigh(aqua2, aqua2_meshes):
    result = hydrostatics(aqua2, aqua2_meshes)
    mass, volume = sum(p.mass_kg for p in result.parts), sum(p.volume_m3 for p in result.parts)
    assert result.weight_in_air_n == pytest.approx(GRAVITY_M_PER_S2 * mass)
    expected = GRAVITY_M_PER_S2 * (mass - result.water_density_kg_per_m3 * volume)
    assert result.weight_in_water_n == pytest.approx(expected)


def test_trim_balances_moments(aqua2, aqua2_meshes):
    """Turned by the trim, the vehicle's righting moment equals that of the mount's weight in water, to rounding."""
    result = hydrostatics(aqua2, aqua2_meshes)
    bow_down = -result.trim.pitch_rad
    whole, density = result.whole, result.water_density_kg_per_m3
    first = GRAVITY_M_PER_S2 * (
        whole.mass_kg * whole.centre_of_mass_m - density * whole.volume_m3 * whole.centre_of_volume_m
    )
    righting = GRAVITY_M_PER_S2 * aqua2.vehicle.mass_kg * aqua2.vehicle.righting_arm_mm / 1000 * np.sin(bow_down)
    turning = first[0] * np.cos(bow_down) + first[2] * np.sin(bow_down)
    assert righting == pytest.approx(turning, rel=1e-12)
    # The mount is ahead of the vehicle's middle and sinks: the bow goes down.
    assert result.trim.pitch_rad < 0


def test_a_rig_without_a_vehicle_has_no_trim(aqua2, aqua2_meshes):
    assert hydrostatics(Rig.model_validate({**aqua2.model_dump(), "vehicle": None}), aqua2_meshes).trim is None
