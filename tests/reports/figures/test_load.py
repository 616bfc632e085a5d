"""Loads as rows, sentences and files."""

import csv

import pytest

from cad.loads.study import load_study
from reports.figures.load import load_lines, load_summary, write_loads
from rigs import Rig


@pytest.fixture(scope="module")
def study():
    return load_study(Rig.load("aqua2"))


def test_the_files_hold_what_was_studied(study, tmp_path):
    files = write_loads(study, tmp_path / "loads")
    assert [file.name for file in files] == ["masses.csv", "ballast.csv", "torques.csv", "torques.png"]
    rows = list(csv.DictReader(files[0].read_text(encoding="utf-8").splitlines()))
    total = next(row for row in rows if row["part"] == "mount")
    parts = [float(row["mass_g"]) for row in rows if row["part"] != "mount"]
    assert float(total["mass_g"]) == pytest.approx(sum(parts), rel=1e-4)
    servos = [row["servo"] for row in csv.DictReader(files[2].read_text(encoding="utf-8").splitlines())]
    assert servos == ["pan", "tilt"]


def test_the_same_study_gives_the_same_bytes(study, tmp_path):
    first, second = write_loads(study, tmp_path / "a"), write_loads(study, tmp_path / "b")
    assert [file.read_bytes() for file in first] == [file.read_bytes() for file in second]


def test_the_summary_names_units_and_the_sentences_say_the_same(study):
    summary = load_summary(study)
    assert summary["weight_in_air_n"] == pytest.approx(9.80665 * summary["mass_kg"])
    text = "\n".join(load_lines(study))
    assert f"mount: {1000 * summary['mass_kg']:.0f} g" in text
    assert f"{abs(summary['trim_deg']['pitch']):.1f} deg bow down" in text


def test_a_rig_without_a_vehicle_says_so():
    bare = Rig.model_validate({**Rig.load("aqua2").model_dump(), "vehicle": None})
    assert any("no [vehicle]" in line for line in load_lines(load_study(bare)))
