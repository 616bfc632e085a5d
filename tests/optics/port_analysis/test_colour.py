"""Dispersion against the data files, lateral colour against its differential."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import optics.water.materials
from optics.port_analysis.colour import FRAUNHOFER_NM, abbe_number, lateral_colour, water_abbe_number
from optics.water.materials import PORT_MATERIALS
from optics.water.water import water_index
from rigs import Rig

AQUA2 = Rig.load("aqua2")

RECORDS = json.loads((Path(optics.water.materials.__file__).parent / "data" / "port_materials.json").read_text("utf-8"))

ROUNDED_DISPERSION = 1e-5
"""The files' Abbe numbers were made from nF and nC of five decimals."""


@pytest.mark.parametrize("material", PORT_MATERIALS)
def test_abbe_numbers_are_those_of_the_data_files(material):
    record = RECORDS["materials"][PORT_MATERIALS[material]]
    dispersion = record["nF_486.13"] - record["nC_656.27"]
    assert abbe_number(material) == pytest.approx(record["abbe"], rel=ROUNDED_DISPERSION / dispersion)


def test_waters_abbe_number_agrees_with_another_source():
    """Daimon & Masumura 2007, distilled water at 20.0 degrees Celsius (refractiveindex.info, CC0), absolute index.

    Their values every 10 nm are interpolated linearly, good to 4e-6, and divided by the index of air (Ciddor 1996).
    Quan & Fry's uncertainty is 3e-5 for each of two indices that differ by 6e-3.
    """
    table = [
        (480, 1.337818, 1.0002795),
        (490, 1.337292, 1.0002792),
        (580, 1.333644, 1.0002773),
        (590, 1.333327, 1.0002771),
        (650, 1.331667, 1.0002763),
        (660, 1.331423, 1.0002762),
    ]
    nanometres, absolute, air = np.array(table).T
    n_c, n_d, n_f = np.interp(list(FRAUNHOFER_NM.values()), nanometres, absolute / air)
    expected = (n_d - 1) / (n_f - n_c)
    assert water_abbe_number(0.0, 20.0) == pytest.approx(expected, rel=2 * 3e-5 / 6e-3)


def test_lateral_colour_is_what_the_differential_says():
    """Far away behind a flat port, r = f tan a with sin a = n sin w: dr = f tan a (1 + tan^2 a) dn / n.

    Second order in dn / n = 0.003: the relative error is of that size times (1 + 3 tan^2 a).
    """
    camera = AQUA2.camera
    radii = np.array([50.0, 150.0, 300.0])
    pixels = np.stack([camera.cx_px + radii, np.full(3, camera.cy_px)], axis=1)
    shift = lateral_colour(AQUA2, pixels, object_distance_m=1e6)
    assert shift.shape == (3, 3, 2)
    n_c, _, n_f = water_index(list(FRAUNHOFER_NM.values()), AQUA2.water.salinity_ppt, AQUA2.water.temperature_celsius)
    n = float(water_index(550.0, AQUA2.water.salinity_ppt, AQUA2.water.temperature_celsius))
    slope = radii / camera.fx_px
    expected = camera.fx_px * slope * (1 + slope**2) * (n_f - n_c) / n
    np.testing.assert_allclose(shift[2, :, 0] - shift[0, :, 0], expected, rtol=0.003 * 3)
    # Blue is refracted more, so that the same point appears further out; in line with the principal point.
    assert (shift[2, :, 0] > shift[1, :, 0]).all()
    np.testing.assert_allclose(shift[:, :, 1], 0, atol=1e-9)


def test_a_centred_dome_has_no_lateral_colour():
    rig = Rig.load("bluerov2")
    shift = lateral_colour(rig, [[0.0, 0.0], [1500.0, 900.0]], object_distance_m=1.0)
    np.testing.assert_allclose(shift, 0, atol=1e-9)


def test_the_reference_wavelength_does_not_shift():
    shift = lateral_colour(AQUA2, [[0.0, 0.0], [600.0, 400.0]], object_distance_m=0.5, wavelengths_nm=[550.0])
    np.testing.assert_allclose(shift, 0, atol=1e-9)


def test_pixels_that_see_the_housing_have_no_colour():
    narrow = AQUA2.model_copy(update={"port": AQUA2.port.model_copy(update={"aperture_diameter_mm": 10.0})})
    shift = lateral_colour(narrow, [[0.0, 0.0], [320.0, 240.0]], object_distance_m=1.0)
    assert np.isnan(shift[:, 0]).all()
    assert np.isfinite(shift[:, 1]).all()


@pytest.mark.parametrize("distance", [0.0, float("inf"), float("nan")])
def test_points_are_somewhere(distance):
    with pytest.raises(ValueError, match="expected object_distance_m > 0, got"):
        lateral_colour(AQUA2, [[0.0, 0.0]], object_distance_m=distance)
