"""`mirrorgaze water`: tables, JSON, exit status."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


def rows(text: str) -> list[list[str]]:
    return [line.split() for line in text.splitlines()]


def test_water_of_a_rig():
    result = mirrorgaze("water", "bench")
    assert result.exit_code == 0, result.stderr
    assert result.stdout.startswith("Jerlov IB by williamson-hollins")
    assert (
        "particles: fournier-forand, mean cosine 0.9300, 0.0183 scattered back, 0.255 within 1 degree" in result.stdout
    )
    # Williamson & Hollins at 550 nm: a = 0.0655, b = 0.122; 1 / c = 5.33 m, b / c = 0.651.
    found = next(row for row in rows(result.stdout) if row[:1] == ["550"])
    assert found[1:6] == ["0.0655", "0.1220", "0.1875", "5.33", "0.651"]


def test_water_of_a_type_by_another_source():
    result = mirrorgaze("water", "5C", "--source", "solonenko-mobley")
    assert result.stdout.startswith("Jerlov 5C by solonenko-mobley")
    assert "a at 600, 625, 650, 675, 700 nm is interpolated between the neighbouring types" in result.stdout


def test_the_solved_attenuation_stands_beside_the_tables():
    """Type III: the solution for measured a and b lies within 13 % of Austin & Petzold's Kd, measured elsewhere."""
    answer = json.loads(mirrorgaze("water", "III", "--json").stdout)
    at = answer["wavelength_nm"].index(500.0)
    assert answer["kd_austin_petzold_per_m"][at] == 0.1056
    assert answer["kd_jerlov_per_m"][at] == 0.115
    assert answer["kd_5_m_per_m"][at] == pytest.approx(0.1056, rel=0.13)
    # Light that is not collimated fades faster than a and slower than c, and between a and a / mean cosine + bb.
    assert answer["a_per_m"][at] < answer["kd_1_m_per_m"][at] < answer["c_per_m"][at]
    assert 0.5 < answer["mean_cosine_up"][at] * 2 < answer["mean_cosine_down"][at] * 2 < 2
    assert answer["particles"]["mean_cosine"] == pytest.approx(0.93, abs=1e-3)


def test_pure_water_has_no_particles_to_speak_of():
    result = mirrorgaze("water", "pure")
    assert "particles" not in result.stdout
    assert result.stdout.startswith("pure sea water, 35 ppt")


def test_ones_own_file(here):
    from rigs import preset_path

    text = preset_path("bench").read_text(encoding="utf-8").replace('jerlov_type = "IB"', 'iop_file = "lake.csv"')
    (here / "rig.toml").write_text(text, encoding="utf-8")
    (here / "lake.csv").write_text("wavelength_nm,a_per_m,b_per_m\n400,0.1,0.5\n700,0.4,0.2\n", encoding="utf-8")
    result = mirrorgaze("water", "rig.toml")
    assert result.exit_code == 0, result.stderr
    assert result.stdout.startswith("lake.csv, ")
    assert "Kd A&P" not in result.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["water", "benhc"], "did you mean 'bench'?"),
        (["water", "9C"], 'source = "solonenko-mobley" has it'),
        (["water", "III", "--source", "jerlov"], "expected williamson-hollins or solonenko-mobley"),
        (["water", "pure", "--source", "solonenko-mobley"], "expected with a Jerlov type only, got pure water"),
        (
            ["water", "III", "--sun-elevation-deg", "-3"],
            "expected a sun elevation above 0 and at most 90 degrees",
        ),
    ],
)
def test_bad_input_is_a_sentence(arguments, words):
    result = mirrorgaze(*arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert words in result.stderr
