"""How large a target is: what is in one piece with something else is not it alone."""

import math

import pytest

from tracking.estimation.target_look import NEARER_PER_S, OUTGROWN, TargetLook
from tracking.perception import ACQUIRED_LOG_ODDS
from tracking.records import Blob

INTERVAL_S = 1 / 30
OWN_PX2 = 1000.0


def blob(times=1.0, log_odds=5.0, *, recalled=False):
    """So many times as large as the target."""
    return Blob(
        area_px=OWN_PX2 * times,
        centroid_px=(150.0, 110.0),
        box_px=(130, 90, 40, 40),
        circularity=1.0,
        log_odds=log_odds,
        recalled=recalled,
    )


def noted(look, seen, swallowed_s=0.0):
    return look.note(seen, whole=True, interval_s=INTERVAL_S, swallowed_s=swallowed_s)


def followed(images=30):
    look = TargetLook()
    for _ in range(images):
        assert noted(look, blob()) == 0
    return look


@pytest.mark.parametrize("log_odds", [-1.0, ACQUIRED_LOG_ODDS, 5.0])
def test_what_is_three_times_as_large_is_not_the_target_alone_however_it_looks(log_odds):
    """And does not become usual, for as long as it is there."""
    look, swallowed_s = followed(), 0.0
    for image in range(60):
        swallowed_s = noted(look, blob(1.01 * OUTGROWN, log_odds), swallowed_s)
        assert swallowed_s == pytest.approx((image + 1) * INTERVAL_S)
    assert look.usual_px2 == look.whole_px2 == OWN_PX2
    assert noted(look, blob(), swallowed_s) == 0


@pytest.mark.parametrize("share, swallowed", [(0.95, False), (1.05, True)])
def test_while_it_is_not_seen_it_may_come_nearer(share, swallowed):
    """By half of its distance in a second: its area goes with the inverse square, exp(2 x 0.5 x 2) = 7.4 in 2 s."""
    look = followed()
    for _ in range(60):
        look.miss(INTERVAL_S)
    grown = math.exp(2 * NEARER_PER_S * 2.0)
    assert (noted(look, blob(share * OUTGROWN * grown)) > 0) is swallowed


@pytest.mark.parametrize("swallowed_s", [0.0, 0.7])
def test_its_own_colours_say_neither_that_it_is_hidden_nor_that_it_is_not(swallowed_s):
    assert noted(followed(), blob(log_odds=-math.inf, recalled=True), swallowed_s) == swallowed_s


def test_a_pale_image_of_its_own_size_does_not_end_it():
    assert noted(followed(), blob(log_odds=1.0), 0.7) == pytest.approx(0.7 + INTERVAL_S)
