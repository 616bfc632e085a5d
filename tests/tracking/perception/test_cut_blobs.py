"""Where the middle of a disc is of which the view shows a part."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tracking.perception.cut_blobs import cut_sides, middle_of_cut, middle_of_part
from tracking.records import Blob

WIDTH_PX, HEIGHT_PX, RADIUS_PX = 320, 240, 30.0
WHOLE_PX2 = math.pi * RADIUS_PX**2


def part_of_disc(middle_px, hidden):
    """What is left of a disc where nothing is hidden, as a detector would report it."""
    columns, rows = np.meshgrid(np.arange(WIDTH_PX), np.arange(HEIGHT_PX))
    shown = ((columns - middle_px[0]) ** 2 + (rows - middle_px[1]) ** 2 < RADIUS_PX**2) & ~hidden
    columns, rows = columns[shown], rows[shown]
    first = int(columns.min()), int(rows.min())
    return Blob(
        area_px=float(shown.sum()),
        centroid_px=(float(columns.mean()), float(rows.mean())),
        box_px=(*first, int(np.ptp(columns)) + 1, int(np.ptp(rows)) + 1),
        circularity=1.0,
    )


@pytest.mark.parametrize(
    ("middle_px", "sides"),
    [
        ((160.0, 120.0), (0, 0)),
        ((10.0, 120.0), (-1, 0)),
        ((-15.0, 120.0), (-1, 0)),
        ((315.0, 120.0), (1, 0)),
        ((160.0, -12.0), (0, -1)),
        ((160.0, 235.0), (0, 1)),
        ((310.0, 230.0), (1, 1)),
    ],
)
def test_a_disc_at_the_crops_edge_is_completed(middle_px, sides):
    """To a pixel, where the centroid of what is left is off by up to 25."""
    hidden = np.zeros((HEIGHT_PX, WIDTH_PX), dtype=bool)
    blob = part_of_disc(middle_px, hidden)
    assert cut_sides(blob, hidden) == sides
    middle, deviation_px = middle_of_cut(blob, sides, WHOLE_PX2, by_edge=True)
    np.testing.assert_allclose(middle, middle_px, atol=1.0)
    assert deviation_px == pytest.approx(math.dist(middle, blob.centroid_px) / 2)


def test_the_robot_cuts_as_the_crops_edge_does():
    hidden = np.zeros((HEIGHT_PX, WIDTH_PX), dtype=bool)
    hidden[:, 180:] = True
    blob = part_of_disc((175.0, 100.0), hidden)
    assert cut_sides(blob, hidden) == (1, 0)
    np.testing.assert_allclose(middle_of_cut(blob, (1, 0), WHOLE_PX2, by_edge=False)[0], (175.0, 100.0), atol=1.0)


@pytest.mark.parametrize("known", [0.0, 0.5])
def test_what_is_larger_than_ever_is_as_wide_as_it_is_high(known):
    """A ball that has come nearer, or of which nothing whole was seen: its height is seen, and half of its width."""
    hidden = np.zeros((HEIGHT_PX, WIDTH_PX), dtype=bool)
    blob = part_of_disc((5.0, 120.0), hidden)
    middle, deviation_px = middle_of_cut(blob, (-1, 0), known * WHOLE_PX2, by_edge=True)
    np.testing.assert_allclose(middle, (5.0, 120.0), atol=1.0)
    assert deviation_px == pytest.approx(math.dist(middle, blob.centroid_px) / 2)
    # In a corner neither is known, and a bar of the robot may have left but a piece.
    unknown = blob.centroid_px, math.sqrt(blob.area_px / math.pi)
    assert middle_of_cut(blob, (-1, 0), known * WHOLE_PX2, by_edge=False) == unknown
    blob = part_of_disc((5.0, 5.0), hidden)
    unknown = blob.centroid_px, math.sqrt(blob.area_px / math.pi)
    assert middle_of_cut(blob, (-1, -1), 0.0, by_edge=True) == unknown


def test_what_no_side_cuts_is_where_its_centroid_is():
    blob = part_of_disc((100.0, 120.0), np.zeros((HEIGHT_PX, WIDTH_PX), dtype=bool))
    assert middle_of_cut(blob, (0, 0), 2 * WHOLE_PX2, by_edge=True) == (blob.centroid_px, 0.0)


@pytest.mark.parametrize("reach_px", [-20, 0, 20])
@pytest.mark.parametrize("off_px", [0.0, 8.0, 100.0])
def test_behind_an_edge_that_nobody_knows_a_disc_is_where_it_is_expected_if_it_can_be(reach_px, off_px):
    """What is left of a column is hidden; the disc's right end is seen, and its middle is a radius from that."""
    hidden = np.zeros((HEIGHT_PX, WIDTH_PX), dtype=bool)
    hidden[:, : 160 + reach_px] = True
    middle, deviation_px = middle_of_part(part_of_disc((160.0, 120.0), hidden), WHOLE_PX2, (160.0 - off_px, 120.0))
    np.testing.assert_allclose(middle, (160.0, 120.0), atol=1.5)
    assert deviation_px == pytest.approx((RADIUS_PX + reach_px) / 2, abs=1.5)


@pytest.mark.parametrize(("expected_x", "x"), [(100.0, 150.0), (170.0, 170.0), (300.0, 190.0)])
def test_in_one_piece_with_something_a_disc_is_somewhere_within(expected_x, x):
    piece = Blob(area_px=5000.0, centroid_px=(170.0, 120.0), box_px=(120, 90, 100, 60), circularity=1.0)
    middle, deviation_px = middle_of_part(piece, WHOLE_PX2, (expected_x, 120.0))
    np.testing.assert_allclose(middle, (x, 119.5), atol=0.6)
    assert deviation_px == pytest.approx(20.0, abs=0.6)
