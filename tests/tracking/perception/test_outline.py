"""Whether an outline is a ball's: drawn outlines whose area and second moments are known in closed form."""

import math

import cv2
import numpy as np
import pytest

from tracking.perception.outline import EVEN_MISSING, MOST_AGAINST, MOST_FOR, ellipse_share, outline_log_odds
from tracking.records import Blob

ROWS, COLUMNS = np.mgrid[:200, :200].astype(float)
ROWS, COLUMNS = ROWS - 100.3, COLUMNS - 99.6


def ellipse(long, short, turned_deg):
    turn = math.radians(turned_deg)
    along = COLUMNS * math.cos(turn) + ROWS * math.sin(turn)
    across = ROWS * math.cos(turn) - COLUMNS * math.sin(turn)
    return (along / long) ** 2 + (across / short) ** 2 <= 1


HALF_DISC = 0.25 / math.sqrt(0.25 * (0.25 - (4 / (3 * math.pi)) ** 2)) / 2
"""Area pi / 2, second moments 1 / 4 along the cut and 1 / 4 - (4 / 3 pi)^2 across it."""


@pytest.mark.parametrize(
    "outline, expected",
    [
        (ellipse(60, 60, 0), 1.0),
        (ellipse(80, 40, 30), 1.0),
        ((abs(ROWS) < 60) & (abs(COLUMNS) < 60), 3 / math.pi),
        ((abs(ROWS) < 30) & (abs(COLUMNS) < 90), 3 / math.pi),
        (ellipse(80, 80, 0) & (ROWS < 0), HALF_DISC),
        # Triangle of sides 1 along both axes: area 1 / 2, moments 1 / 18, 1 / 18, -1 / 36.
        ((COLUMNS > -90) & (ROWS > -90) & (COLUMNS + ROWS < 0), 9 / (math.pi * math.sqrt(12))),
    ],
)
def test_share_of_the_ellipse_with_the_same_moments(outline, expected):
    assert ellipse_share(cv2.moments(outline.astype(np.uint8), binaryImage=True)) == pytest.approx(expected, abs=3e-3)


def test_few_cells_are_hardly_less_round():
    """A ball of 8 cells across, as the detector cuts it out of its finer level at 3 m."""
    small = cv2.circle(np.zeros((20, 20), dtype=np.uint8), (10, 10), 4, 1, cv2.FILLED)
    assert ellipse_share(cv2.moments(small, binaryImage=True)) > 1 - EVEN_MISSING


def blob(share):
    return Blob(area_px=900.0, centroid_px=(0.0, 0.0), box_px=(0, 0, 30, 30), circularity=1.0, ellipse_share=share)


def test_odds_of_an_outline():
    """Even where it is said to be, for a ball above and against it below, and nothing where an edge cuts it."""
    assert outline_log_odds(blob(1 - EVEN_MISSING)) == pytest.approx(0.0)
    assert outline_log_odds(blob(1 - EVEN_MISSING / 1.3)) == pytest.approx(
        -outline_log_odds(blob(1 - EVEN_MISSING * 1.3))
    )
    assert outline_log_odds(blob(1.0)) == MOST_FOR
    assert outline_log_odds(blob(0.7)) == -MOST_AGAINST
