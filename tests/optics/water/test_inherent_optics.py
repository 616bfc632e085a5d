"""Inherent optics of a rig's water: types and sources, pure water, the user's own file, and how molecules mix in."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optics.water.inherent_optics import inherent_optics, particle_phase
from optics.water.pure_water import molecular_phase, pure_absorption, pure_scattering
from optics.water.water import absorption, molecular_scattering_of_types, scattering, water_index
from rigs import Water

WAVELENGTH = np.array([420.0, 500.0, 600.0, 650.0])

WATERS = [
    Water(),
    Water(jerlov_type="5C", phase_function="petzold"),
    Water(source="solonenko-mobley", jerlov_type="I", phase_function="henyey-greenstein", mean_cosine=0.9),
    Water(source="solonenko-mobley", jerlov_type="9C", backscattered_fraction=0.01),
    Water(source="pure", salinity_ppt=0.0, temperature_celsius=10.0),
]


def test_a_type_is_its_source():
    for source in ("williamson-hollins", "solonenko-mobley"):
        optics = inherent_optics(Water(source=source, jerlov_type="III", salinity_ppt=30.0), WAVELENGTH)
        np.testing.assert_array_equal(optics.absorption, absorption("III", WAVELENGTH, source))
        np.testing.assert_array_equal(optics.scattering, scattering("III", WAVELENGTH, source))
        np.testing.assert_array_equal(optics.n_water, water_index(WAVELENGTH, 30.0, 20.0))
        molecules = optics.molecular_fraction * optics.scattering
        np.testing.assert_allclose(molecules, molecular_scattering_of_types(WAVELENGTH), rtol=1e-14)


def test_pure_water_is_all_molecules():
    optics = inherent_optics(Water(source="pure", salinity_ppt=20.0, temperature_celsius=5.0), WAVELENGTH)
    np.testing.assert_array_equal(optics.absorption, pure_absorption(WAVELENGTH, 20.0, 5.0))
    np.testing.assert_array_equal(optics.scattering, pure_scattering(WAVELENGTH, 20.0, 5.0))
    assert (optics.molecular_fraction == 1).all()
    np.testing.assert_array_equal(optics.backscattered_fraction, 0.5)
    np.testing.assert_allclose(optics.mean_cosine, 0, atol=1e-15)


@pytest.mark.parametrize("water", WATERS, ids=lambda water: water.label)
def test_the_mixture_is_a_phase_function(water):
    """Normalised; its first moment is the mean cosine; its value is the mixture of molecules and particles."""
    optics = inherent_optics(water, WAVELENGTH)
    moments = optics.moments(16)
    np.testing.assert_allclose(moments[:, 0], 1, rtol=1e-12)
    np.testing.assert_allclose(moments[:, 1], optics.mean_cosine, rtol=1e-12, atol=1e-15)
    assert (np.abs(moments) <= 1 + 1e-12).all()
    angle = np.radians([0.5, 90.0, 180.0])
    share = optics.molecular_fraction[:, np.newaxis]
    expected = share * molecular_phase(angle) + (1 - share) * optics.phase(angle)
    np.testing.assert_allclose(optics.phase_function(angle), expected, rtol=1e-14)
    assert (optics.molecular_fraction <= 1).all()
    assert ((optics.albedo > 0) & (optics.albedo < 1)).all()


@given(
    jerlov_type=st.sampled_from(["I", "IA", "IB", "II", "III", "1C", "3C", "5C", "7C", "9C"]),
    wavelength=st.floats(400, 700),
)
def test_every_type_absorbs_and_scatters_at_every_wavelength(jerlov_type, wavelength):
    optics = inherent_optics(Water(source="solonenko-mobley", jerlov_type=jerlov_type), wavelength)
    assert optics.absorption > 0
    assert optics.scattering > 0
    assert 0 < optics.molecular_fraction <= 1
    assert optics.beam_attenuation == optics.absorption + optics.scattering


def test_phase_functions_by_name():
    assert particle_phase(Water()).backscattered_fraction == pytest.approx(0.0183127, abs=1e-6)
    assert particle_phase(Water(backscattered_fraction=0.01)).backscattered_fraction == pytest.approx(0.01, abs=1e-6)
    # Petzold's mean cosine, of its table and as the default of Henyey-Greenstein: Mobley, Ocean Optics Web Book.
    assert particle_phase(Water(phase_function="petzold")).mean_cosine == pytest.approx(0.924, abs=5e-4)
    assert particle_phase(Water(phase_function="henyey-greenstein")).mean_cosine == pytest.approx(0.924, abs=1e-6)
    own = Water(phase_function="henyey-greenstein", mean_cosine=0.8)
    assert particle_phase(own).mean_cosine == pytest.approx(0.8, abs=1e-6)


def own_water(tmp_path, text):
    file = tmp_path / "lake.csv"
    file.write_text(text, encoding="utf-8")
    return Water(iop_file=file)


def test_ones_own_water_is_read_between_its_rows(tmp_path):
    text = "# a lake\nwavelength_nm,a_per_m,b_per_m,b_molecular_per_m\n400,0.1,0.5,0.01\n700,0.4,0.2,0.002\n"
    optics = inherent_optics(own_water(tmp_path, text), [400.0, 550.0, 700.0])
    np.testing.assert_allclose(optics.absorption, [0.1, 0.25, 0.4], rtol=1e-14)
    np.testing.assert_allclose(optics.scattering, [0.5, 0.35, 0.2], rtol=1e-14)
    np.testing.assert_allclose(optics.molecular_fraction, [0.02, 0.006 / 0.35, 0.01], rtol=1e-12)


def test_without_a_column_the_molecules_are_those_of_pure_water(tmp_path):
    """At most all of b: water that is said to scatter nothing has no molecules either."""
    water = own_water(tmp_path, "wavelength_nm,a_per_m,b_per_m\n400,0.1,0.5\n550,0.1,0.001\n700,0.1,0\n")
    optics = inherent_optics(water, [400.0, 550.0, 700.0])
    np.testing.assert_allclose(optics.molecular_fraction, [pure_scattering(400, 35, 20) / 0.5, 1, 0], rtol=1e-12)
    assert optics.albedo[2] == 0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("wavelength_nm,a,b\n400,1,1\n", "expected a column a_per_m; the file has wavelength_nm, a, b"),
        ("wavelength_nm,a_per_m,b_per_m,c\n400,1,1,1\n", "column 'c': expected one of wavelength_nm, a_per_m, b_per_m"),
        ("wavelength_nm,a_per_m,b_per_m\n500,1,1\n600,1,1\n", "from 420 to 650 at least, got 500 to 600"),
        ("wavelength_nm,a_per_m,b_per_m\n400,1,-1\n700,nan,1\n", "2 problems"),
        (
            "wavelength_nm,a_per_m,b_per_m,b_molecular_per_m\n400,1,1,2\n700,1,1,0\n",
            "expected b_molecular_per_m of at most b_per_m",
        ),
        ("", "expected a line of column names, got nothing"),
    ],
)
def test_a_bad_file_is_a_sentence(tmp_path, text, words):
    with pytest.raises(ValueError, match=f"(?s)lake.csv: .*{words}"):
        inherent_optics(own_water(tmp_path, text), WAVELENGTH)


@pytest.mark.parametrize("wavelength", [[399.0], [550.0, 701.0]])
def test_nothing_is_extrapolated(wavelength):
    with pytest.raises(ValueError, match="expected wavelength_nm between 400 and 700"):
        inherent_optics(Water(), wavelength)
