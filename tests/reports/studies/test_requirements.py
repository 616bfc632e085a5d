"""What a rig is asked for beside what it reaches."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from cad import rig_meshes
from mirrorgaze.cli import app
from optics.camera import camera_from_spec
from optics.feasibility.requirements import Achieved, Outcome, judged
from reports.studies.requirements import achieved_by, directions
from rigs import Requirements, Rig, RigError, preset_path

ASKED = Requirements(
    directions_deg=((0, 0), (0, -90)),
    covered_percent=80,
    target_px=20,
    target_diameter_mm=200,
    target_distance_mm=5000,
    gaze_error_deg=1,
    mount_mass_g=600,
    print_hours=30,
)
REACHED = Achieved(
    seen=(True, False),
    covered_fraction=0.8,
    pixels_per_degree=10.0,
    gaze_error_deg=1.1,
    mount_mass_kg=0.6,
    print_time_s=30.1 * 3600,
)


def test_each_requirement_passes_or_fails_by_its_own_number():
    found = judged(ASKED, REACHED)
    assert [(each.name, each.outcome.value) for each in found] == [
        ("azimuth 0°, elevation 0°", "pass"),
        ("azimuth 0°, elevation -90°", "fail"),
        ("directions covered", "pass"),
        ("target of 200 mm in 5 m", "pass"),
        ("gaze error, RMS", "fail"),
        ("mass of the mount", "pass"),
        ("print time", "fail"),
    ]
    # 2 asin(0.02) = 2.2920 degrees.
    assert found[3].achieved == "22.92 px"


def test_what_nobody_computed_is_not_judged_and_names_the_command():
    found = judged(ASKED, Achieved())
    assert {each.outcome for each in found} == {Outcome.OPEN}
    assert all(each.achieved.startswith("not known: mirrorgaze ") for each in found)


def test_only_what_is_asked_for_is_judged():
    assert judged(None, REACHED) == []
    assert [each.name for each in judged(Requirements(mount_mass_g=1), REACHED)] == ["mass of the mount"]


def test_directions_are_azimuth_from_the_bow_to_the_left_and_elevation_upwards():
    asked = Requirements(directions_deg=((0, 0), (90, 0), (0, 90), (180, -45)))
    half = 0.5**0.5
    np.testing.assert_allclose(
        directions(asked), [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-half, 0, -half]], rtol=0, atol=1e-15
    )


def test_what_a_preset_reaches_agrees_with_its_closed_forms():
    """On the axis of a pinhole behind a flat port a pixel spans 1 / (n f): the image is coarsest there."""
    rig = Rig.load("aqua2").model_copy(update={"requirements": ASKED})
    found = achieved_by(rig, rig_meshes(rig), covered_fraction=0.5)
    index = 1.34
    assert found.pixels_per_degree == pytest.approx(
        np.radians(1) * index * camera_from_spec(rig.camera).fx_px, rel=0.01
    )
    assert found.seen == (True, False)
    assert found.covered_fraction == 0.5


def test_a_target_needs_all_its_numbers():
    with pytest.raises(ValueError, match="missing: target_diameter_mm, target_distance_mm"):
        Requirements(target_px=20)


@pytest.fixture
def rig_file(tmp_path):
    """Writes aqua2 with requirements."""

    def write(text):
        path = tmp_path / "asked.toml"
        path.write_text(
            f"{preset_path('aqua2').read_text(encoding='utf-8')}\n[requirements]\n{text}\n", encoding="utf-8"
        )
        return path

    return write


def test_check_ends_with_1_when_one_fails(rig_file):
    path = rig_file("mount_mass_g = 100\ngaze_error_deg = 1")
    done = CliRunner().invoke(app, ["check", str(path), "--require", "--json"])
    assert done.exit_code == 1
    outcomes = {each["name"]: each["outcome"] for each in json.loads(done.stdout)["requirements"]}
    assert outcomes == {"mass of the mount": "fail", "gaze error, RMS": "not judged"}
    assert CliRunner().invoke(app, ["check", str(path)]).exit_code == 0


def test_check_ends_with_0_when_none_fails(rig_file):
    path = rig_file("mount_mass_g = 5000\ndirections_deg = [[0, 0]]")
    done = CliRunner().invoke(app, ["check", str(path), "--require"])
    assert done.exit_code == 0
    assert "pass" in done.stdout


def test_check_says_when_nothing_is_asked_for():
    done = CliRunner().invoke(app, ["check", "aqua2", "--require"])
    assert done.exit_code == 2
    assert "expected a table [requirements]" in done.output


def test_a_file_that_asks_for_the_impossible_says_all_of_it(rig_file):
    path = rig_file("covered_percent = 120\ntarget_px = -1\ndirections_deg = [[0, 95]]")
    with pytest.raises(RigError) as refused:
        Rig.load(path)
    assert {problem.place for problem in refused.value.problems} >= {
        "requirements.covered_percent",
        "requirements.target_px",
        "requirements.directions_deg[0][1]",
    }
