"""Evidence of a track: what is doubted when, what clutter is and for how long."""

import json
import math

import numpy as np
import pytest

from tracking.estimation.track_evidence import CLUTTER_RAD, CLUTTER_S, MEMORY_S, MOST_LOG_ODDS, TrackEvidence

INTERVAL_S = 1 / 30
AHEAD = np.array([1.0, 0.0, 0.0])


def turned(angle_rad):
    return np.array([math.cos(angle_rad), math.sin(angle_rad), 0.0])


def test_odds_are_averaged_over_their_memory():
    """A step of one, after the memory's time: 1 - 1/e of it, whatever the rate of the images."""
    for interval_s in (INTERVAL_S, INTERVAL_S / 10):
        evidence = TrackEvidence()
        evidence.update(0.0, interval_s)
        for _ in range(round(MEMORY_S / interval_s)):
            evidence.update(1.0, interval_s)
        assert evidence.mean == pytest.approx(1 - math.exp(-1))


def test_a_coral_is_doubted_and_a_target_is_not():
    """Acquired at odds of e to 1; then on the one side of even or on the other, image by image."""
    coral, target = TrackEvidence(mean=1.0), TrackEvidence(mean=1.0)
    for image in range(60):
        coral.update(-0.4, INTERVAL_S)
        target.update(-0.4 if image % 3 else 4.0, INTERVAL_S)
        assert not target.doubted
    assert coral.doubted


def test_one_image_does_not_outweigh_the_others():
    evidence = TrackEvidence()
    evidence.update(math.inf, INTERVAL_S)
    assert evidence.mean == MOST_LOG_ODDS
    evidence.update(-math.inf, INTERVAL_S)
    assert not evidence.doubted


def test_nothing_followed_is_not_doubted():
    evidence = TrackEvidence(mean=-1.0)
    evidence.forget()
    assert not evidence.doubted and evidence.clutter == []


def test_what_was_dropped_is_clutter_there_and_for_a_while():
    evidence = TrackEvidence(mean=-1.0)
    evidence.drop(AHEAD, 5.0)
    assert evidence.mean is None
    assert evidence.is_clutter(turned(0.9 * CLUTTER_RAD), 6.0)
    assert not evidence.is_clutter(turned(1.1 * CLUTTER_RAD), 6.0)
    assert evidence.is_clutter(AHEAD, 5.0 + 0.99 * CLUTTER_S)
    assert not evidence.is_clutter(AHEAD, 5.0 + CLUTTER_S)


def test_a_snapshot_holds_all_of_it():
    evidence = TrackEvidence(mean=0.3)
    evidence.drop(turned(0.1), 2.0)
    evidence.update(1.0, INTERVAL_S)
    again = TrackEvidence()
    again.restore(json.loads(json.dumps(evidence.snapshot())))
    assert again.mean == evidence.mean
    assert again.is_clutter(turned(0.1), 3.0)
