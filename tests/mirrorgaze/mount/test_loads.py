"""`mirrorgaze loads`: what it prints, writes and refuses."""

from __future__ import annotations

import json

from typer.testing import CliRunner

from mirrorgaze.cli import app
from rigs import preset_path


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, ["loads", *arguments])


def test_it_weighs_trims_and_compares_servos(tmp_path):
    result = mirrorgaze("aqua2", "-o", str(tmp_path / "out"))
    assert result.exit_code == 0, result.stderr
    for expected in ("gimbal_base", "bow down", "Hz in water", "margin"):
        assert expected in result.stdout
    assert (tmp_path / "out/torques.png").stat().st_size > 5000


def test_json_carries_units_in_its_keys():
    data = json.loads(mirrorgaze("aqua2", "--json").stdout)
    assert data["weight_in_water_n"] < data["weight_in_air_n"]
    assert [servo["servo"] for servo in data["servos"]] == ["pan", "tilt"]
    assert data["problems"] == []


def test_a_servo_that_is_too_weak_ends_with_two_and_names_both_torques(here):
    text = preset_path("aqua2").read_text(encoding="utf-8").replace("speed_m_per_s = 0.7", "speed_m_per_s = 3.0")
    (here / "fast.toml").write_text(text, encoding="utf-8")
    result = mirrorgaze("fast.toml")
    assert result.exit_code == 2
    for expected in ("servos.pan.torque_n_m = 0.353: expected at least", "servos.tilt.torque_n_m = 0.353"):
        assert expected in result.stderr


def test_a_rig_without_mirrors_is_refused():
    result = mirrorgaze("bench")
    assert result.exit_code == 2
    assert "expected a rig with mirrors" in result.stderr
