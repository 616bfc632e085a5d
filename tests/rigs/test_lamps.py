"""Lamps in a rig file: optional, as many as there are, and every mistake said with its place."""

import pytest
from pydantic import ValidationError

from rigs import Rig, RigError, load_document, preset_path
from rigs.lamps import Lamp

LAMP = """
[[lamps]]
position_mm = [300.0, 150.0, 40.0]
direction = [1.0, 0.0, -0.2]
angle_deg = 135.0
luminous_flux_lm = 1500.0
"""


def rig_with(text, folder):
    return Rig.parse(preset_path("aqua2").read_text(encoding="utf-8") + text, source="rig", folder=folder)


def test_a_rig_has_no_lamps_unless_it_says_so():
    assert Rig.load("aqua2").lamps == ()
    assert "lamps" not in load_document(preset_path("aqua2"))


def test_lamps_are_read_in_their_order(tmp_path):
    lamps = rig_with(LAMP + LAMP.replace("150.0", "-150.0"), tmp_path).lamps
    assert [lamp.position_mm[1] for lamp in lamps] == [150.0, -150.0]
    assert (lamps[0].spectrum, lamps[0].colour_temperature_k) == ("led", 6200.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("angle_deg = 135.0", "angle_deg = 180.0"), r"lamps\[0\]\.angle_deg = 180\.0: expected .*170"),
        (("direction = [1.0, 0.0, -0.2]", "direction = [0.0, 0.0, 0.0]"), r"lamps\[0\]\.direction.*three zeros"),
        (
            ("luminous_flux_lm = 1500.0", ""),
            r"lamps\[0\].*either luminous_flux_lm or radiant_flux_w, got None and None",
        ),
        (("1500.0", "1500.0\nradiant_flux_w = 5.0"), r"lamps\[0\].*got 1500\.0 and 5\.0"),
        (("1500.0", "1500.0\ncolour_temperature_k = 3000.0"), r"from 4500 to 9000 with spectrum = \"led\", got 3000"),
        (("1500.0", "1500.0\nflux = 3.0"), r"lamps\[0\]\.flux = 3\.0"),
    ],
)
def test_a_bad_lamp_is_said_with_its_place(change, message, tmp_path):
    with pytest.raises(RigError, match=message):
        rig_with(LAMP.replace(*change), tmp_path)


def test_a_glowing_lamp_may_be_warm():
    lamp = Lamp(
        position_mm=(0.0, 0.0, 0.0), angle_deg=60.0, radiant_flux_w=20.0, spectrum="planck", colour_temperature_k=3000.0
    )
    assert lamp.direction == (1.0, 0.0, 0.0)
    with pytest.raises(ValidationError, match="from 1500 to 15000"):
        lamp.model_validate({**lamp.model_dump(), "colour_temperature_k": 1000.0})
