"""Natural frequencies of the gimbal on its base."""

import numpy as np
import pytest

from cad.loads.frequency import _lowest_two, _mass_matrix, arm_frequencies
from cad.loads.masses import Body
from rigs import Rig


def test_a_mass_on_a_massless_cantilever_swings_at_its_closed_form():
    """A point mass m at the end: f = sqrt(3 E I / (m L^3)) / (2 pi); the beam's tip stiffness is 12, 6, 4 E I."""
    stiffness_ei, length, mass = 30.0, 0.2, 0.5
    bending = stiffness_ei * np.array([[12 / length**3, -6 / length**2], [-6 / length**2, 4 / length]])
    stiffness = np.diag([1e9] * 6)
    stiffness[np.ix_([0, 4], [0, 4])] = bending
    tip = Body(
        name="tip",
        mass_kg=mass,
        volume_m3=1e-4,
        centre_of_mass_m=np.zeros(3),
        centre_of_volume_m=np.zeros(3),
        inertia_kg_m2=1e-9 * np.eye(3),
    )
    expected = np.sqrt(3 * stiffness_ei / (mass * length**3)) / (2 * np.pi)
    assert _lowest_two(stiffness, _mass_matrix(tip, np.zeros(3)))[0] == pytest.approx(expected, rel=1e-6)


def test_the_mass_matrix_gives_the_kinetic_energy_of_any_motion():
    """Kinetic energy is v m v / 2 + w I w / 2, v the velocity of the centre; for a random motion about a far point."""
    rng = np.random.default_rng(5)
    root = rng.normal(size=(3, 3))
    body = Body(
        name="any",
        mass_kg=2.5,
        volume_m3=1.0,
        centre_of_mass_m=rng.normal(size=3),
        centre_of_volume_m=np.zeros(3),
        inertia_kg_m2=root @ root.T,
    )
    pivot, velocity, turn = rng.normal(size=(3, 3))
    motion = np.concatenate([velocity, turn])
    centre = velocity + np.cross(turn, body.centre_of_mass_m - pivot)
    expected = 2.5 * centre @ centre / 2 + turn @ body.inertia_kg_m2 @ turn / 2
    assert motion @ _mass_matrix(body, pivot) @ motion / 2 == pytest.approx(expected, rel=1e-12)


@pytest.mark.slow
def test_water_slows_the_gimbal_and_finer_cubes_change_little(aqua2, aqua2_meshes):
    """The water's mass lowers the lowest frequency; cubes of 2.5 mm instead of 3 mm change it by less than 10 %."""
    coarse = arm_frequencies(aqua2, aqua2_meshes)
    fine = arm_frequencies(aqua2, aqua2_meshes, cube_mm=2.5)
    assert coarse.in_water_hz[0] < coarse.in_air_hz[0]
    assert coarse.in_air_hz[0] == pytest.approx(fine.in_air_hz[0], rel=0.1)


def test_a_stiffer_plastic_swings_faster_by_the_root_of_its_modulus(aqua2, aqua2_meshes):
    """The same mesh in PLA (3 GPa, denser) instead of ABS (2 GPa): between 1 and sqrt(1.5) times the frequency."""
    data = aqua2.model_dump()
    data["mount"]["material"] = "pla"
    abs_hz = arm_frequencies(aqua2, aqua2_meshes, cube_mm=4.0).in_water_hz[0]
    pla_hz = arm_frequencies(Rig.model_validate(data), aqua2_meshes, cube_mm=4.0).in_water_hz[0]
    assert abs_hz < pla_hz < np.sqrt(1.5) * abs_hz
