"""Paths from files: what lies between rows, by closed forms, and what is wrong with a file, by its lines."""

import numpy as np
import pytest

from dives.trajectories.timed_paths import TimedPathError, timed_path

HEAD = "time_s,x_m,y_m,z_m"


def path(folder, text):
    (folder / "path.csv").write_text(text, encoding="utf-8")
    return timed_path(folder / "path.csv")


def problems(folder, text):
    with pytest.raises(TimedPathError) as caught:
        path(folder, text)
    return {problem.place: problem for problem in caught.value.problems}


def test_even_motion_is_even_and_the_ends_are_kept(tmp_path):
    """On a straight line at one speed a monotone cubic is that line."""
    found = path(tmp_path, f"{HEAD}\n1,0,0,0\n2,1,2,3\n3,2,4,6\n")
    places, velocity = found.places(np.array([0.0, 1.25, 2.5, 9.0]))
    np.testing.assert_allclose(places, np.outer([0.0, 0.25, 1.5, 2.0], [1, 2, 3]), atol=1e-12)
    np.testing.assert_allclose(velocity, [[1, 2, 3]] * 4, atol=1e-12)
    assert found.attitudes(np.zeros(1)) is None


def test_no_place_between_rows_is_beyond_them_nor_faster_than_said(tmp_path):
    """A jump between two rests: a plain cubic spline would overshoot by several per cent of it."""
    found = path(tmp_path, f"{HEAD}\n0,0,0,0\n1,0,0,0\n2,1,0,0\n3,1,0,0\n")
    times = np.linspace(0, 3, 3001)
    x = found.places(times)[0][:, 0]
    assert x.min() >= 0
    assert x.max() <= 1
    assert np.abs(np.diff(x)).max() / (times[1] - times[0]) <= found.fastest_m_per_s


def test_velocity_is_the_derivative_and_does_not_jump(tmp_path):
    """Central differences 1e-5 s to either side; at a row the second derivative jumps, by less than 10 m/s^2 here."""
    found = path(tmp_path, f"{HEAD}\n0,0,1,2\n1,1,3,2\n2,4,3,1\n4,5,0,0\n")
    times, step = np.array([0.5, 1.0, 1.7, 2.0, 3.3]), 1e-5
    difference = (found.places(times + step)[0] - found.places(times - step)[0]) / (2 * step)
    np.testing.assert_allclose(found.places(times)[1], difference, atol=1e-4)


def test_angles_and_quaternions_say_the_same(tmp_path):
    """30 degrees to the left, 20 up, 10 clockwise: as turns about z, -y and x, one after the other from the right."""
    angles = path(tmp_path, f"{HEAD},yaw_deg,pitch_deg,roll_deg\n0,0,0,0,30,20,10\n1,0,0,0,30,20,10\n")
    bow = angles.attitudes(np.zeros(1)).apply([1.0, 0.0, 0.0])[0]
    yaw, pitch = np.radians([30, 20])
    assert bow == pytest.approx([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)])
    # Rolled clockwise as seen from behind, the left side goes up.
    assert angles.attitudes(np.zeros(1)).apply([0.0, 1.0, 0.0])[0, 2] > 0
    numbers = ",".join(f"{each:.6f}" for each in angles.attitudes(np.zeros(1)).as_quat()[0])
    quaternion = path(tmp_path, f"{HEAD},qx,qy,qz,qw\n0,0,0,0,{numbers}\n1,0,0,0,{numbers}\n")
    assert quaternion.attitudes(np.zeros(1)).apply([1.0, 0.0, 0.0])[0] == pytest.approx(bow, abs=1e-5)


def test_columns_stand_in_any_order_and_others_are_left_alone(tmp_path):
    found = path(tmp_path, "note,z_m,y_m,x_m,time_s\na,3,2,1,0\nb,3,2,1,1\n\n")
    assert found.points_m.tolist() == [[1, 2, 3], [1, 2, 3]]


def test_files_of_loggers_and_spreadsheets_are_read(tmp_path):
    """Comments before the names, a byte order mark, spaces after commas, and lines of commas alone at the end."""
    found = path(tmp_path, "\ufeff# a robot's log\ntime_s, x_m, y_m, z_m\n0, 1, 2, 3\n1, 1, 2, 3\n,,,\n , , ,\n")
    assert found.points_m.tolist() == [[1, 2, 3], [1, 2, 3]]


def test_what_is_no_text_is_refused(tmp_path):
    (tmp_path / "path.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TimedPathError, match="expected text in UTF-8"):
        timed_path(tmp_path / "path.csv")


def test_everything_that_is_wrong_is_told_by_line(tmp_path):
    found = problems(tmp_path, f"{HEAD},qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,here,0,,0,0,0,1\n1,0,0,0,0,0,0,2\n")
    assert found.keys() == {"line 3, x_m", "line 3, z_m", "line 4, time_s", "line 4, qx, qy, qz, qw"}
    assert found["line 3, x_m"].value == "here"
    assert found["line 4, time_s"].expected == "a time after 1 s"
    assert found["line 4, qx, qy, qz, qw"].expected == "a quaternion of length 1, got 2"


@pytest.mark.parametrize(
    ("text", "place", "expected"),
    [
        ("time,x,y,z\n0,0,0,0\n1,0,0,0\n", "column names", "time_s, x_m, y_m, z_m"),
        (f"{HEAD},yaw_deg\n0,0,0,0,0\n", "column names", "pitch_deg, roll_deg"),
        (f"{HEAD},qx,yaw_deg\n0,0,0,0,0,0\n", "column names", "one of"),
        (f"{HEAD},x_m\n0,0,0,0,0\n", "column names", "x_m once"),
        (f"{HEAD}\n0,0,0,0\n", "", "2 rows or more"),
        ("", "", "a line of column names, got nothing"),
    ],
)
def test_files_without_a_path(text, place, expected, tmp_path):
    assert expected in problems(tmp_path, text)[place].expected


def test_many_problems_are_counted(tmp_path):
    found = problems(tmp_path, HEAD + "\n" + "0,a,0,0\n" * 50)
    assert "79 more" in found[""].expected


def test_a_changed_file_is_read_again(tmp_path):
    assert path(tmp_path, f"{HEAD}\n0,0,0,0\n1,0,0,0\n").points_m.max() == 0
    (tmp_path / "path.csv").unlink()
    with pytest.raises(TimedPathError, match="a file that is there"):
        timed_path(tmp_path / "path.csv")
