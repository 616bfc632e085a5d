"""The image sensor's section of the rig file: its numbers, its defaults, and what is wrong with bad ones."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
import tomlkit

from rigs import Rig, RigError, preset_path
from rigs.image_sensor import ImageSensorSpec

AQUA2 = tomllib.loads(preset_path("aqua2").read_text(encoding="utf-8"))


def rig_with(section: dict[str, object]) -> Rig:
    return Rig.parse(tomlkit.dumps({**AQUA2, "image_sensor": section}), source="rig.toml", folder=Path())


def problems_of(section: dict[str, object]) -> list[str]:
    with pytest.raises(RigError) as caught:
        rig_with(section)
    return [str(problem) for problem in caught.value.problems]


def test_a_rig_needs_no_image_sensor():
    assert Rig.load("aqua2").image_sensor is None


def test_numbers_of_a_rig_file_are_kept():
    sensor = rig_with(
        {"pixel_pitch_um": 6.9, "row_time_us": 0, "bayer": "none", "exposure": {"mode": "manual", "time_us": 800.0}}
    ).image_sensor
    assert (sensor.pixel_pitch_um, sensor.row_time_us, sensor.bayer) == (6.9, 0, "none")
    assert (sensor.exposure.mode, sensor.exposure.time_us) == ("manual", 800.0)


def test_the_manual_shows_the_defaults():
    """The section printed in docs/explanation/sensor.md is the one that a rig without any has."""
    manual = (Path(__file__).parents[2] / "docs" / "explanation" / "sensor.md").read_text(encoding="utf-8")
    printed = manual.split("```toml\n")[1].split("```")[0]
    assert rig_with(tomllib.loads(printed)["image_sensor"]).image_sensor == ImageSensorSpec()


def test_the_default_row_time_is_that_of_the_data_sheet():
    """1125 rows (1080 and blanking) in 1/30 s, to the digits that are given."""
    assert ImageSensorSpec().row_time_us == pytest.approx(1e6 / 30 / 1125, abs=0.05)


def test_the_default_converter_saturates_before_the_well():
    """Else the full scale would be out of reach at 0 dB, and with it white."""
    spec = ImageSensorSpec()
    assert (2**spec.bits - 1 - spec.black_level_dn) * spec.gain_e_per_dn < spec.full_well_e


@pytest.mark.parametrize(
    ("section", "problem"),
    [
        ({"bits": 4}, "image_sensor.bits = 4: expected a number greater than or equal to 8"),
        ({"bayer": "rgbg"}, "image_sensor.bayer = 'rgbg': expected 'none', 'rggb'"),
        ({"full_well_e": 0.0}, "image_sensor.full_well_e = 0.0: expected a number greater than 0"),
        ({"quantum_efficiency": [0.5, 0.5]}, "expected a list of 3 numbers"),
        ({"quantum_efficiency": [0.5, 1.5, 0.5]}, "image_sensor.quantum_efficiency[1] = 1.5: expected"),
        ({"f_numbr": 2.0}, "did you mean 'f_number'?"),
        ({"exposure": {"metering": "spot"}}, "image_sensor.exposure.metering = 'spot'"),
        ({"white_balance": {"largest_gain": 0.5}}, "image_sensor.white_balance.largest_gain = 0.5"),
        ({"black_level_dn": 3000}, "black_level_dn below half of what 12 bits hold (2048), got 3000"),
        ({"frame_rate_hz": 60.0, "exposure": {"longest_us": 30000.0}}, "within a frame (16667 us at 60 Hz), got 30000"),
        ({"exposure": {"time_us": 10.0}}, "exposure.time_us from exposure.shortest_us (29.6)"),
        ({"exposure": {"gain_db": 30.0}}, "exposure.gain_db of at most largest_gain_db (21), got 30"),
    ],
)
def test_bad_numbers_are_named(section, problem):
    problems = problems_of(section)
    assert len(problems) == 1
    assert problem in problems[0]


def test_all_numbers_that_do_not_fit_are_said_at_once():
    (problem,) = problems_of({"black_level_dn": 3000, "exposure": {"gain_db": 30.0}})
    assert "black_level_dn" in problem
    assert "gain_db" in problem
