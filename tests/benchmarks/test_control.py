"""The loop without images: its detector, and what counts as a loss."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.control import LOG_ODDS, ToldDetector, _losses
from rigs import Rig
from tracking.loop.loop import TrackingLoop
from tracking.loop.variants import VARIANTS
from tracking.protocols import CameraFrame, MirrorReport

CROP = np.zeros((100, 200, 3), np.uint8)


def report(frame):
    """Mirrors that stand in the middle."""
    return MirrorReport(q=np.zeros(2), time_s=frame / 30, measured=False)


def told(centre_px, ignored=None):
    """Detector that is told of a disc of 10 pixels, and what it finds in ten crops."""
    detector = ToldDetector(np.random.default_rng(1), np.array(centre_px), 10.0)
    return detector, [detector(CROP, ignored, None) for _ in range(10)]


def test_a_whole_disc_is_found_in_most_crops_where_it_is():
    detector, detections = told([50.0, 40.0])
    assert detector.shown == pytest.approx(1, abs=0.02)
    found = [each for each in detections if each.blobs]
    assert len(found) >= 7
    assert found[0].centroid_px == pytest.approx((50, 40), abs=0.5)
    assert found[0].blobs[0].area_px == pytest.approx(314, abs=5)
    assert found[0].blobs[0].log_odds == LOG_ODDS


def test_half_a_disc_is_found_where_its_half_is():
    robot = np.zeros((100, 200), np.uint8)
    robot[:, :50] = 255
    for detector, detections in (told([0.0, 40.0]), told([50.0, 40.0], robot)):
        assert 0.4 < detector.shown < 0.6
        found = next(each for each in detections if each.blobs)
        assert detector.centre_px[0] + 2 < found.centroid_px[0] < detector.centre_px[0] + 6


@pytest.mark.parametrize("centre_px", [[-8.0, 40.0], [250.0, 40.0]])
def test_a_disc_of_which_little_is_shown_is_not_found(centre_px):
    detector, detections = told(centre_px)
    assert detector.shown < 1 / 3
    assert not any(each.blobs for each in detections)


def test_the_loop_takes_what_a_detector_of_its_users_finds():
    variant = replace(VARIANTS["default"], behaviour=replace(VARIANTS["default"].behaviour, check_s=0.0))
    rig, detector = Rig.load("aqua2"), ToldDetector(np.random.default_rng(1))
    loop = TrackingLoop(rig, variant, detector=detector)
    image = np.zeros((rig.camera.height_px, rig.camera.width_px, 3), np.uint8)
    found = []
    for frame in range(10):
        step = loop.step(CameraFrame(image=image, time_s=frame / 30), report(frame))
        # Of an image taken before the next step, whose crop is as large.
        detector.centre_px, detector.radius_px = np.array(step.crop.shape[1::-1]) / 2, 20.0
        found.append(step.detection.centroid_px is not None)
    assert not found[0] and any(found)


def test_losses_last_while_the_target_is_available():
    held = np.array([1, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0], bool)
    available = np.array([1, 1, 1, 1, 0, 1, 1, 1, 1, 1, 1, 1], bool)
    assert _losses(held, available, 0.25) == [(0.5, 0.75, True), (2.25, 0.75, False)]
