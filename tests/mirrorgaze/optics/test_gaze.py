"""`mirrorgaze gaze` and `mirrorgaze virtual-camera`: their numbers, their files, their refusals."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app


def run(*arguments):
    return CliRunner().invoke(app, list(arguments))


def test_a_wanted_gaze_lists_the_joints_and_the_time():
    """Straight back is over the zenith, 90 degrees of tilt at 60 deg/s: the paper's 1.5 s."""
    result = run("gaze", "aqua2", "--azimuth-deg", "180", "--elevation-deg", "0")
    assert result.exit_code == 0, result.stderr
    assert "q1 = 0.00, q2 = 90.00 deg  1.50 s" in result.stdout
    assert "60.0 deg/s by pan, 120.0 deg/s by tilt" in result.stdout


def test_joint_values_give_their_gaze():
    result = run("gaze", "aqua2", "--q1-deg", "30", "--q2-deg", "-10", "--json")
    report = json.loads(result.stdout)
    assert report["azimuth_deg"] == pytest.approx(30)
    assert report["elevation_deg"] == pytest.approx(-20)
    assert report["jacobian"] == [[pytest.approx(1), pytest.approx(0)], [pytest.approx(0), pytest.approx(2)]]
    assert "solutions" not in report


def test_at_the_zenith_it_says_so():
    result = run("gaze", "aqua2", "--q1-deg", "30", "--q2-deg", "45")
    assert "singular: pan does not turn the gaze" in result.stdout
    assert "none: azimuth has no meaning here" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (
            ("--azimuth-deg", "0", "--elevation-deg", "-80"),
            "within the joints' reach, got azimuth 0 deg, elevation -80 deg",
        ),
        (("--azimuth-deg", "10"), "expected both --azimuth-deg and --elevation-deg or neither"),
        (("--q1-deg", "100"), "expected q1 (pan) between -77.5 and 77.5 deg, got 100"),
        (("--azimuth-deg", "nan", "--elevation-deg", "0"), "expected finite azimuth and elevation"),
    ],
)
def test_a_gaze_that_cannot_be_is_bad_input(arguments, sentence):
    result = run("gaze", "aqua2", *arguments)
    assert result.exit_code == 2
    assert sentence in result.stderr


def test_the_virtual_camera_is_written_for_both(here):
    result = run("virtual-camera", "aqua2", "--q1-deg", "30", "--q2-deg", "-10", "-o", "camera")
    assert result.exit_code == 0, result.stderr
    assert "edges of the gaze mirror off their chords" in result.stdout
    assert sorted(path.name for path in (here / "camera").iterdir()) == [
        "virtual_camera_opencv.yaml",
        "virtual_camera_ros.yaml",
    ]


def test_the_virtual_camera_as_json():
    report = json.loads(run("virtual-camera", "bluerov2", "--distances-m", "1,3", "--json").stdout)
    assert [row["distance_m"] for row in report["residuals"]] == [1, 3]
    # A centred dome: the camera itself.
    assert report["camera_matrix"][0][0] == pytest.approx(1144, abs=1e-6)
    assert set(report["edge_deviation_px"]) == {"bottom", "right", "top", "left"}


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("aqua2", "--distances-m", "1,x"), "expected --distances-m as numbers separated by commas, got '1,x'"),
        (("aqua2", "--distances-m", "-1"), "expected distances_m > 0"),
        (("bench",), "expected a rig with mirrors, got 'bench'"),
    ],
)
def test_a_virtual_camera_that_cannot_be_leaves_nothing(here, arguments, sentence):
    result = run("virtual-camera", *arguments, "-o", "camera")
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert list(here.iterdir()) == []
