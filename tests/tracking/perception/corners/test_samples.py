"""Samples of the corners: their CSV, what is refused, and the corners of an outline in an image."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dives.calibration.corner_collection import outline_corners
from rigs import Rig
from tracking.calibration.observations import corners_problem, edge_problems
from tracking.perception import CornerSamples, exact_samples
from tracking.perception.corners.samples import COLUMNS

QUADRILATERAL = np.array([[100.0, 50.0], [400.0, 90.0], [390.0, 300.0], [130.0, 280.0]])
HEADER = ",".join(COLUMNS)
GOOD = [f"{q1},{q2},100,50,400,60,390,300,110,280" for q1, q2 in ((-60, -20), (60, -20), (-60, 90), (60, 90))]

ROUNDING = 4.5e-16
"""Two units of the last bit: radians to degrees and back."""

OUTLINE_PX = 0.2
"""Of a corner: an edge's points are rounded by half a pixel, 0.29 px rms, and more than 100 lead to each corner."""


def written(tmp_path, lines):
    path = tmp_path / "corners.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_file_is_read_whatever_the_order_of_its_columns(tmp_path):
    path = written(tmp_path, ["# by hand", HEADER, *GOOD])
    samples = CornerSamples.from_csv(path)
    np.testing.assert_allclose(np.degrees(samples.q[2]), [-60, 90])
    assert samples.corners_px[0].tolist() == [[100, 50], [400, 60], [390, 300], [110, 280]]
    turned = [",".join(reversed(line.split(","))) for line in (HEADER, *GOOD)]
    again = CornerSamples.from_csv(written(tmp_path, turned))
    assert (again.q == samples.q).all() and (again.corners_px == samples.corners_px).all()


def test_what_is_written_is_read_back_exactly(tmp_path):
    samples = exact_samples(Rig.load("aqua2"), 7, 7)
    path = tmp_path / "corners.csv"
    samples.to_csv(path)
    again = CornerSamples.from_csv(path)
    assert (again.corners_px == samples.corners_px).all()
    np.testing.assert_allclose(again.q, samples.q, rtol=ROUNDING)
    assert [each.name for each in tmp_path.iterdir()] == ["corners.csv"]


@given(degrees=st.lists(st.floats(-180, 180), min_size=4, max_size=4, unique=True))
def test_joint_values_survive_their_own_file(degrees, tmp_path_factory):
    q = np.radians(np.column_stack([degrees, np.zeros(4)]))
    if len(np.unique(q, axis=0)) < 4:
        return
    path = tmp_path_factory.mktemp("csv") / "corners.csv"
    CornerSamples(q=q, corners_px=np.repeat(QUADRILATERAL[np.newaxis], 4, axis=0)).to_csv(path)
    np.testing.assert_allclose(CornerSamples.from_csv(path).q, q, rtol=ROUNDING, atol=0)


def test_all_that_is_wrong_with_a_file_is_told_at_once(tmp_path):
    lines = [
        "# q1_deg of line 3 is no number",
        HEADER,
        GOOD[0].replace("-60", "nan"),
        GOOD[1] + ",7",
        GOOD[2],
        GOOD[2],
        "10,10,100,50,110,280,390,300,400,60",
    ]
    with pytest.raises(ValueError) as caught:
        CornerSamples.from_csv(written(tmp_path, lines))
    told = str(caught.value)
    assert "corners.csv: 4 problems" in told
    assert "line 3, column q1_deg: expected a finite number, got 'nan'" in told
    assert "line 4: expected 10 values, got 11" in told
    assert "line 6: expected joint values that are not those of line 5 already" in told
    assert "line 7: expected top_left, top_right, bottom_right, bottom_left clockwise" in told


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ([], "expected a line of column names, got nothing"),
        ([HEADER], "expected at least 4 samples, got 0"),
        ([HEADER, *GOOD[:3]], "expected at least 4 samples, got 3"),
        ([HEADER.replace("top_left_u_px,", ""), "1,2"], "expected a column top_left_u_px; the file has q1_deg"),
        ([HEADER + ",q3_deg", *(line + ",0" for line in GOOD)], "column 'q3_deg': expected one of q1_deg"),
        ([HEADER + ",q1_deg", *(line + ",0" for line in GOOD)], "column q1_deg: expected once, got it again"),
        ([HEADER, *GOOD[:3], GOOD[3].replace("300", "inf")], "line 5, column bottom_right_v_px: expected a finite"),
        ([HEADER, *GOOD[:3], GOOD[3].replace("300", "three")], "got 'three'"),
    ],
)
def test_bad_files_are_refused_with_a_sentence(tmp_path, lines, told):
    with pytest.raises(ValueError) as caught:
        CornerSamples.from_csv(written(tmp_path, lines))
    assert told in str(caught.value)


def test_file_of_bytes_is_refused(tmp_path):
    path = tmp_path / "corners.csv"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match="expected text in UTF-8, got something else at byte 0"):
        CornerSamples.from_csv(path)


def test_arrays_are_checked_like_files():
    corners = np.repeat(QUADRILATERAL[np.newaxis], 4, axis=0)
    q = np.array([[0, 0], [0, 1], [1, 0], [1, 0.0]])
    with pytest.raises(ValueError, match="sample 3: expected joint values that are not those of sample 2"):
        CornerSamples(q=q, corners_px=corners)
    with pytest.raises(ValueError, match=r"got \(4, 2\) and \(4, 2, 2\)"):
        CornerSamples(q=q, corners_px=corners[:, :2])
    corners[1, 2, 0] = np.nan
    with pytest.raises(ValueError, match="sample 1: expected finite numbers"):
        CornerSamples(q=q, corners_px=corners)


def drawn(corners, shape=(480, 640)):
    """Pixels whose centre lies within a convex outline: closed form, half-planes."""
    v, u = np.indices(shape)
    inside = np.ones(shape, dtype=bool)
    for (a, b), (c, d) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        inside &= (c - a) * (v - b) - (d - b) * (u - a) > 0
    return inside


@pytest.mark.parametrize("angle", [7.0, -35.0, 52.0, 80.0])
def test_corners_of_an_outline_are_found_finer_than_a_pixel(angle):
    middle = np.array([320.3, 239.6])
    turn = cv2.getRotationMatrix2D((0.0, 0.0), angle, 1.0)[:, :2]
    corners = (QUADRILATERAL - QUADRILATERAL.mean(axis=0)) @ turn.T + middle
    guess = corners + np.random.default_rng(3).uniform(-6, 6, (4, 2))
    np.testing.assert_allclose(outline_corners(drawn(corners), guess), corners, atol=OUTLINE_PX)


def test_hidden_corner_is_where_its_sides_lead():
    corners = QUADRILATERAL + np.array([30.2, 20.7])
    mirror = drawn(corners)
    v, u = np.indices(mirror.shape)
    found = outline_corners(mirror & (u + 0.7 * v < 590), corners + 3)
    # Led to over a fifth of each side: the parabola's end is a few times less sure.
    np.testing.assert_allclose(found, corners, atol=4 * OUTLINE_PX)


def test_image_edge_is_no_edge_of_the_mirror():
    corners = QUADRILATERAL - np.array([180.3, 0.0])
    found = outline_corners(drawn(corners), corners)
    assert np.isnan(found[[0, 3]]).all()
    np.testing.assert_allclose(found[1:3], corners[1:3], atol=OUTLINE_PX)


def test_nothing_is_found_without_a_mirror():
    for mirror in (np.zeros((480, 640), dtype=bool), np.ones((480, 640), dtype=bool)):
        assert np.isnan(outline_corners(mirror, QUADRILATERAL)).all()
    assert np.isnan(outline_corners(drawn(QUADRILATERAL), np.full((4, 2), np.nan))).all()


@pytest.mark.parametrize("outline", ["octagon", "ellipse"])
def test_a_mirror_without_the_rectangles_corners_has_none_to_be_found(outline):
    rig = Rig.load("aqua2").with_gaze(gaze_mirror={"outline": outline})
    (problem,) = edge_problems(rig, None)
    assert problem.startswith(f"gaze_mirror.outline = '{outline}': expected a rectangle, whose corners")
    assert not corners_problem(Rig.load("aqua2"))
