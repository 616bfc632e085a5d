"""CSV files of observations: what is written is read back, and all that is wrong is told at once."""

from __future__ import annotations

import numpy as np
import pytest

from dives.calibration.simulation import simulated_target, useful_poses
from rigs import Rig
from tracking.calibration.observation_files import read_observations, write_observations


@pytest.fixture(scope="module")
def rig():
    return Rig.load("aqua2")


@pytest.fixture(scope="module")
def poses(rig):
    return useful_poses(rig, 4)


@pytest.mark.parametrize("known", [True, False])
def test_observations_are_read_back(rig, poses, tmp_path, known):
    written = simulated_target(rig, {}, poses, known=known, direct=True, noise_px=0.3, seed=1)
    write_observations(tmp_path / "observations.csv", written)
    read = read_observations(tmp_path / "observations.csv", rig)
    # Degrees and millimetres in the file: the last digit may go.
    np.testing.assert_allclose(read.q, written.q, rtol=1e-14)
    assert np.isnan(read.q).any()
    np.testing.assert_allclose(read.points_m, written.points_m, atol=1e-14)
    np.testing.assert_array_equal(read.pixels, written.pixels)
    assert (read.boards, read.board.tolist()) == (written.boards, written.board.tolist())
    assert not list(tmp_path.glob("*.partial"))


def test_board_without_a_name_is_one_board(rig, tmp_path):
    rows = [f"{q1},0,{x},{y},{300 + x},{200 + y}" for q1 in (-5, 0, 5) for x in (0, 20) for y in (0, 30)]
    text = "# by hand\nq1_deg, q2_deg, board_x_mm, board_y_mm, u_px, v_px\n" + "\n".join(rows)
    (tmp_path / "o.csv").write_text(text)
    read = read_observations(tmp_path / "o.csv", rig)
    assert read.boards == ("board",)
    assert read.points_m.max() == pytest.approx(0.03)
    assert np.abs(read.points_m[:, 2]).max() == 0


HEADER = "q1_deg,q2_deg,body_x_mm,body_y_mm,body_z_mm,u_px,v_px"


@pytest.mark.parametrize(
    ("text", "sentences"),
    [
        ("", ["expected a line of column names, got nothing"]),
        (
            "q1_deg,q2,u_px,v_px,u_px\n",
            [
                "4 problems",
                "column 'q2': expected one of q1_deg, q2_deg,",
                "column u_px: expected once, got it again",
                "expected columns body_x_mm, body_y_mm, body_z_mm or board_x_mm, board_y_mm, either or",
                "expected a column q2_deg; the file has",
            ],
        ),
        (HEADER + ",board\n", ["expected no column board with body_x_mm"]),
        (HEADER + ",board_x_mm\n", ["either or"]),
        (
            HEADER + "\n1,2,3000,0,0,nan,5\n1,2,3000,0\n500,0,3000,0,0,10,10\n,0,3000,0,0,10,1e9\n0,0,3000,0,0,10,1e9",
            [
                "7 problems",
                "line 2, column u_px: expected a finite number, got 'nan'",
                "line 3: expected 7 values, got 4",
                "line 5, column q1_deg: expected a finite number, got ''",
                "line 6: expected a pixel inside the 640 x 480 image, got [10.0, 1000000000.0]",
                "line 4: expected q1 between -77.5 and 77.5 deg, got 500",
                "expected at least 12 observations, got 2",
                "expected at least 3 pairs of joint values, got 2",
            ],
        ),
        (
            "q1_deg,q2_deg,board_x_mm,board_y_mm,u_px,v_px\n"
            + "\n".join(f"{k % 4},0,{10 * k},{20 * k},{50 + k},60" for k in range(12)),
            ["1 problem", "board board: expected points that are not on a line"],
        ),
    ],
)
def test_everything_that_is_wrong_is_told(rig, tmp_path, text, sentences):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=r"bad\.csv: ") as told:
        read_observations(path, rig)
    for sentence in sentences:
        assert sentence in str(told.value)


def test_what_is_no_text_is_told(rig, tmp_path):
    (tmp_path / "bad.csv").write_bytes(b"q1_deg\xff")
    with pytest.raises(ValueError, match="expected text in UTF-8"):
        read_observations(tmp_path / "bad.csv", rig)
