"""CSV files of boards' points: what is written is read, and every problem of a file is told."""

import numpy as np
import pytest

from tracking import read_corners
from tracking.port_calibration.corner_files import write_corners
from tracking.port_calibration.observations import BoardObservations


def test_what_is_written_is_read(tmp_path):
    seen = BoardObservations(
        cameras=("left", "right"),
        sizes_px=((640, 480), (800, 600)),
        images=("water/1", "bare/2"),
        camera=np.array([0, 1, 0]),
        image=np.array([0, 0, 1]),
        medium=np.array([2, 2, 0]),
        board_m=np.array([[0, 0], [0.025, 0], [0, 0.05]]),
        pixels=np.array([[1.5, 2], [3, 4.25], [5, 6]]),
    )
    write_corners(tmp_path / "corners.csv", seen)
    again = read_corners(tmp_path / "corners.csv")
    assert (again.cameras, again.sizes_px, again.images) == (seen.cameras, seen.sizes_px, seen.images)
    for name in ("camera", "image", "medium", "places_m", "pixels"):
        np.testing.assert_allclose(getattr(again, name), getattr(seen, name), err_msg=name)


def test_targets_may_have_a_third_dimension(tmp_path):
    text = "image,u_px,v_px,board_x_mm,board_y_mm,board_z_mm\na,1,2,0,25,40\n"
    (tmp_path / "corners.csv").write_text(text)
    seen = read_corners(tmp_path / "corners.csv", size_px=(640, 480))
    assert not seen.is_flat
    write_corners(tmp_path / "again.csv", seen)
    assert read_corners(tmp_path / "again.csv").places_m.tolist() == [[0, 0.025, 0.04]]


def test_the_size_may_be_given_and_what_is_not_said_is_one_camera_in_water(tmp_path):
    (tmp_path / "corners.csv").write_text("image,u_px,v_px,board_x_mm,board_y_mm\na,1,2,0,25\n")
    seen = read_corners(tmp_path / "corners.csv", size_px=(640, 480))
    assert (seen.cameras, seen.sizes_px, seen.medium.tolist()) == (("camera",), ((640, 480),), [2])
    assert seen.board_m.tolist() == [[0, 0.025, 0]]


def test_every_problem_is_told(tmp_path):
    path = tmp_path / "corners.csv"
    path.write_text(
        "image,medium,u_px,v_px,board_x_mm,board_y_mm,width_px,height_px\n"
        "a,lava,1,2,0,0,640,480\na,water,x,2,0,0,640,480\na,water,1,2,0,0,640,480\nb,water,1,2,0,0,480,640\nb,water\n"
    )
    with pytest.raises(ValueError, match="4 problems") as caught:
        read_corners(path)
    for sentence in (
        "line 2, column medium: expected bare, air, water, got 'lava'",
        "line 3, column u_px: expected a finite number, got 'x'",
        "line 6: expected 8 values, got 2",
        "camera camera: expected images of one size, got 640 x 480, 480 x 640",
    ):
        assert sentence in str(caught.value)


def test_missing_columns_are_named(tmp_path):
    (tmp_path / "corners.csv").write_text("image,u_px\na,1\n")
    with pytest.raises(ValueError, match="expected a column v_px"):
        read_corners(tmp_path / "corners.csv", size_px=(640, 480))
