"""The sensor on the bench, judged by another code: the package emva1288, an implementation of the standard.

Rationale: `test_emva1288.py` has estimates of our own; here pairs of flat images of rising charge and a stack of 32
dark and 32 bright ones go through `emva1288`, which knows of our sensor nothing but these images. The charge stands
for the photons, so that the quantum efficiency must come out as 1.

Expected behaviour: system gain, quantum efficiency, saturation, dark noise, DSNU and PRNU are the sensor's within what
19,200 pixels and 40 points allow.
"""

from __future__ import annotations

import numpy as np
import pytest
from emva1288.process.data import Data1288
from emva1288.process.results import Results1288
from emva1288.process.routines import get_int_imgs

from scenes.sensor import expose, frame_key

HEIGHT, WIDTH = 120, 160
GAIN_E_PER_DN, READ_NOISE_E, DSNU_E, PRNU, FULL_WELL_E = 2.0, 4.0, 3.0, 0.01, 6000.0
EXPOSURE_S = 0.005
POINTS, STACK = 40, 32
FIT_POINTS = 28
"""Of the points, those below 70 % of saturation, which the standard fits the gain to."""
GAIN_ERROR = np.sqrt(2 / (FIT_POINTS * HEIGHT * WIDTH))
"""Relative standard error of a slope of variances of this many pairs of pixels, at least."""
DEVIATIONS = 5.0


@pytest.fixture(scope="module")
def numpy_one():
    """Functions of NumPy that the package, which is older than NumPy 2, asks for."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(np, "asfarray", lambda values: np.asarray(values, dtype=np.float64), raising=False)
        patch.setattr(np, "int", int, raising=False)
        yield


@pytest.fixture(scope="module")
def measured(make_sensor, make_settings, flat_field, numpy_one):
    """What emva1288 makes of our images."""
    sensor = make_sensor(
        gain_e_per_dn=GAIN_E_PER_DN,
        read_noise_e=READ_NOISE_E,
        dsnu_e=DSNU_E,
        prnu=PRNU,
        full_well_e=FULL_WELL_E,
        dark_current_e_per_s=0.0,
        bits=12,
    )
    settings = make_settings(exposure_s=EXPOSURE_S)
    frames = iter(range(10**6))

    def images(charge_e, count):
        field = flat_field(sensor, charge_e, EXPOSURE_S)
        return get_int_imgs(
            [expose(field, sensor, settings, frame_key(11, next(frames))).digital_numbers for _ in range(count)]
        )

    def summed(charge_e):
        pair = images(charge_e, 2)
        return {"sum": pair["sum"].sum(), "pvar": pair["pvar"].sum(), "dmean": pair["dmean"]}

    charges = [0.0, *np.linspace(0.01, 1.15, POINTS) * FULL_WELL_E]
    return Results1288(
        Data1288(
            {
                "width": WIDTH,
                "height": HEIGHT,
                "temporal": {EXPOSURE_S: {charge: summed(charge) for charge in charges}},
                "spatial": {EXPOSURE_S: {charge: images(charge, STACK) for charge in (0.0, FULL_WELL_E / 2)}},
            }
        ).data
    )


def test_gain_quantum_efficiency_and_saturation(measured):
    assert pytest.approx(1, abs=DEVIATIONS * GAIN_ERROR) == measured.K * GAIN_E_PER_DN
    assert pytest.approx(1, abs=DEVIATIONS * GAIN_ERROR) == measured.QE / 100
    # Saturation is the peak of the variance: a point of the series, where the well cuts at most the brightest pixels,
    # those two deviations of charge and of response above the mean.
    step_e, spread_e = 1.15 / POINTS * FULL_WELL_E, np.hypot(np.sqrt(FULL_WELL_E), PRNU * FULL_WELL_E)
    error = DEVIATIONS * GAIN_ERROR
    assert 1 - error - (step_e + 2 * spread_e) / FULL_WELL_E < measured.u_e_sat / FULL_WELL_E < 1 + error


def test_noise_in_the_dark_and_differences_between_pixels(measured, record_property):
    pixels, noise = HEIGHT * WIDTH, READ_NOISE_E
    assert measured.sigma_d == pytest.approx(noise, rel=DEVIATIONS * (GAIN_ERROR + np.sqrt(0.5 / pixels)))
    assert pytest.approx(DSNU_E, rel=DEVIATIONS * (GAIN_ERROR + np.sqrt(0.5 / pixels)) + 0.02) == measured.DSNU1288
    assert pytest.approx(PRNU, rel=DEVIATIONS * np.sqrt(0.5 / pixels) + 0.02) == measured.PRNU1288 / 100
    off = {"K": measured.K * GAIN_E_PER_DN, "QE": measured.QE / 100, "sigma_d": measured.sigma_d / noise}
    off |= {"DSNU": measured.DSNU1288 / DSNU_E, "PRNU": measured.PRNU1288 / 100 / PRNU}
    record_property("difference", ", ".join(f"{name} {abs(ratio - 1):.1%}" for name, ratio in off.items()))
