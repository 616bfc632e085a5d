"""What a dive is judged to be, from metrics that are made up."""

import pytest

from dives.metrics.verdict import dive_verdict
from dives.specification import DiveLimits
from rigs import Requirements, Rig

HELD = {
    "acquired": True,
    "acquisition_time_s": 4.0,
    "time_on_target_fraction": 0.99,
    "gaze_error_held_rms_deg": 0.4,
    "false_tracking_fraction": 0.0,
    "false_tracking_things_s": {},
    "possible_fraction": 0.98,
    "losses": 0,
    "losses_reacquired": 0,
    "loss_causes": {},
}


@pytest.fixture(scope="module")
def rig():
    return Rig.load("aqua2")


def test_a_dive_within_its_limits_passes_and_says_what_it_reached(rig):
    verdict = dive_verdict(HELD, DiveLimits(), rig)
    assert verdict.passed
    assert verdict.line == "PASS: acquired after 4.0 s, held 99.0 % of the time, 0.40 degrees off (RMS)"


@pytest.mark.parametrize(
    ("metrics", "words"),
    [
        ({"acquisition_time_s": 20.5}, "acquired after 20.5 s, at most 20 s allowed"),
        ({"gaze_error_held_rms_deg": 1.01}, "gaze 1.01 degrees off while held (RMS), at most 1 degrees allowed"),
        ({"false_tracking_fraction": 0.06}, "on something else 6.0 % of the time, at most 5 % allowed"),
        (
            {"time_on_target_fraction": 0.5, "losses": 3, "losses_reacquired": 2, "loss_causes": {"saturated": 3}},
            "held 50.0 % of the time from then on, at least 95 % required: lost 3 times to saturated (3), "
            "found again 2 times",
        ),
    ],
)
def test_every_limit_that_is_missed_is_said_with_its_number(rig, metrics, words):
    verdict = dive_verdict(HELD | metrics, DiveLimits(), rig)
    assert not verdict.passed
    assert verdict.line == f"FAIL: {words}"


def test_what_no_loop_could_have_held_is_said(rig):
    """Only where it explains the verdict: a mirror that could have held enough does not excuse the loop."""
    missed = HELD | {"time_on_target_fraction": 0.9}
    explained = dive_verdict(missed | {"possible_fraction": 0.92}, DiveLimits(), rig)
    assert "More than 92.0 % was hardly possible" in explained.line
    assert "possible" not in dive_verdict(missed, DiveLimits(), rig).line
    assert "possible" not in dive_verdict(missed | {"possible_fraction": None}, DiveLimits(), rig).line


def test_that_no_gaze_is_as_near_as_required_is_said(rig):
    missed = HELD | {"gaze_error_held_rms_deg": 4.8}
    explained = dive_verdict(missed | {"gaze_error_possible_rms_deg": 4.12}, DiveLimits(), rig)
    assert "Less than 4.12 degrees was not possible" in explained.line
    for least in (None, 0.9):
        assert "possible" not in dive_verdict(missed | {"gaze_error_possible_rms_deg": least}, DiveLimits(), rig).line


def test_all_that_is_missed_is_said_at_once(rig):
    missed = {"acquisition_time_s": 30.0, "time_on_target_fraction": 0.1, "gaze_error_held_rms_deg": 9.0}
    assert len(dive_verdict(HELD | missed, DiveLimits(), rig).sentences) == 3


def test_a_number_at_its_limit_passes(rig):
    limits = DiveLimits()
    at_limit = {
        "acquisition_time_s": limits.acquisition_time_s,
        "time_on_target_fraction": limits.time_on_target_percent / 100,
        "gaze_error_held_rms_deg": limits.gaze_error_deg,
        "false_tracking_fraction": limits.false_tracking_percent / 100,
    }
    assert dive_verdict(HELD | at_limit, limits, rig).passed


def test_the_rigs_own_limit_of_the_gaze_error_counts(rig):
    strict = rig.model_copy(update={"requirements": Requirements(gaze_error_deg=0.3)})
    assert dive_verdict(HELD, DiveLimits(), strict).line == (
        "FAIL: gaze 0.40 degrees off while held (RMS), at most 0.3 degrees allowed"
    )
    lenient = rig.model_copy(update={"requirements": Requirements(gaze_error_deg=2.0)})
    assert dive_verdict(HELD | {"gaze_error_held_rms_deg": 1.5}, DiveLimits(), lenient).passed


def test_a_target_never_acquired_fails_with_what_was_seen(rig):
    never = {
        "acquired": False,
        "frames": 720,
        "functional_check_frames": 360,
        "frames_with_target": 86,
        "frames_detected": 45,
        "frames_found": 22,
        "false_tracking_things_s": {"decoy": 12.34, "world": 0.5},
        "not_found_causes_frames": {"not in view": 200, "colour": 64},
    }
    verdict = dive_verdict(never, DiveLimits(), rig)
    assert not verdict.passed
    assert verdict.line == (
        "FAIL: never acquired: 86 images of 720 had the target, the detector fired in 45, in 23 of them on something "
        "else (followed a decoy for 12.3 s), 360 images were the functional check, most often it was not in view (200)"
    )
