"""`[water]` of a rig file: one origin of the coefficients, one shape of the phase function, files beside the rig."""

from __future__ import annotations

import pytest

from rigs import Rig, RigError, Water, preset_path


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"iop_file": "x.csv", "jerlov_type": "II"}, "expected iop_file or a Jerlov type with its source, got both"),
        ({"source": "pure", "jerlov_type": "II"}, "expected no jerlov_type with source = \"pure\", got 'II'"),
        ({"jerlov_type": "9C"}, "got '9C'; source = \"solonenko-mobley\" has it"),
        ({"phase_function": "petzold", "backscattered_fraction": 0.01}, "expected backscattered_fraction with"),
        ({"mean_cosine": 0.9}, 'expected mean_cosine with phase_function = "henyey-greenstein" only'),
        ({"backscattered_fraction": 0.1}, "less than or equal to 0.05"),
        ({"turbidity": 3}, "Extra inputs"),
    ],
)
def test_what_does_not_go_together_is_said(values, words):
    with pytest.raises(ValueError, match=words):
        Water(**values)


def test_another_type_keeps_salt_heat_and_shape():
    water = Water(source="pure", salinity_ppt=5.0, phase_function="petzold").of_type("III")
    assert (water.label, water.source, water.salinity_ppt) == ("Jerlov III", "williamson-hollins", 5.0)
    assert water.phase_function == "petzold"
    other = Water(source="solonenko-mobley", jerlov_type="9C").of_type("7C")
    assert other.source == "solonenko-mobley"
    assert Water(iop_file="lake.csv").of_type("II").iop_file is None
    with pytest.raises(ValueError, match="got '7C'"):
        Water().of_type("7C")


def test_labels():
    assert Water().label == "Jerlov IB"
    assert Water(source="pure").label == "pure sea water"
    assert Water(iop_file="somewhere/lake.csv").label == "lake.csv"


def own_rig(tmp_path, water, camera=""):
    text = preset_path("bench").read_text(encoding="utf-8")
    text = text.replace('jerlov_type = "IB"', water).replace("[camera]", f"[camera]\n{camera}")
    file = tmp_path / "rig.toml"
    file.write_text(text, encoding="utf-8")
    return file


def test_files_are_looked_for_beside_the_rig_file(tmp_path):
    file = own_rig(tmp_path, 'iop_file = "lake.csv"', 'response_file = "camera.csv"')
    (tmp_path / "lake.csv").touch()
    (tmp_path / "camera.csv").touch()
    rig = Rig.load(file)
    assert rig.water.iop_file == (tmp_path / "lake.csv").resolve()
    assert rig.camera.response_file == (tmp_path / "camera.csv").resolve()


def test_files_that_are_not_there_are_said_at_once(tmp_path):
    file = own_rig(tmp_path, 'iop_file = "lake.csv"', 'response_file = "camera.csv"')
    with pytest.raises(RigError) as caught:
        Rig.load(file)
    assert [problem.place for problem in caught.value.problems] == ["water.iop_file", "camera.response_file"]


def test_a_type_of_another_source_is_said_in_the_rig(tmp_path):
    with pytest.raises(RigError, match=r"water: expected jerlov_type IB, .* got '9C'"):
        Rig.load(own_rig(tmp_path, 'jerlov_type = "9C"'))
