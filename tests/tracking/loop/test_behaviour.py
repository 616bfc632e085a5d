"""The behaviour of figure 12: every arrow of the state machine."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracking.loop.behaviour import BehaviourSettings, BehaviourState, next_state
from tracking.records import Mode

PAPER = BehaviourSettings(check_s=30.0, confirm_frames=1, predict_frames=30)


def run(settings, images, *, start=BehaviourState(mode=Mode.SCAN), elapsed_s=100.0):  # noqa: B008
    """Modes after each image, given whether it shows the target; 'x': not even its expected place."""
    states, state = [], start
    for image in images:
        state = next_state(state, settings, elapsed_s=elapsed_s, found=image == "t", expected=image != "x")
        states.append(state)
    return states


def modes(states):
    return "".join(state.mode.value[0] for state in states)


def test_the_check_takes_its_time_and_does_not_look():
    for elapsed_s, mode in ((0.0, Mode.CHECK), (29.97, Mode.CHECK)):
        (state,) = run(PAPER, "t", start=BehaviourState(), elapsed_s=elapsed_s)
        assert state.mode is mode
    assert modes(run(PAPER, ".", start=BehaviourState(), elapsed_s=30.0)) == "s"
    assert modes(run(PAPER, "t", start=BehaviourState(), elapsed_s=30.0)) == "t"
    assert modes(run(BehaviourSettings(check_s=0.0), ".", start=BehaviourState(), elapsed_s=0.0)) == "s"


def test_the_papers_behaviour():
    """Tracked from the first detection on; after 30 images without it the environment is scanned again."""
    assert modes(run(PAPER, "..t.t" + "." * 31 + "t")) == "ssttpt"[:2] + "tpt" + "p" * 30 + "s" + "t"


def test_a_candidate_must_be_seen_often_enough():
    """Three images, with at most two running without it between them."""
    settings = BehaviourSettings(confirm_frames=3, look_frames=2)
    assert modes(run(settings, "tt.t")) == "ssst"
    assert modes(run(settings, "t..t..t")) == "sssssst"
    assert [state.hits for state in run(settings, "tt...t")] == [1, 2, 2, 2, 0, 1]
    assert modes(run(settings, "tt...tt")) == "s" * 7
    assert [state.hits for state in run(BehaviourSettings(confirm_frames=3), "tt.t")] == [1, 2, 0, 1]


def test_a_target_found_again_while_predicted_needs_no_confirmation():
    settings = BehaviourSettings(confirm_frames=3, predict_frames=5)
    assert modes(run(settings, "ttt...t")) == "sstpppt"


def test_images_that_cannot_show_it_do_not_count_up_to_a_number():
    settings = BehaviourSettings(predict_frames=2, unseen_frames=3)
    tracking = BehaviourState(mode=Mode.TRACK)
    assert modes(run(settings, "xxx...", start=tracking)) == "pppppss"[:6]
    assert modes(run(settings, "xxxxxx", start=tracking)) == "pppppss"[:6]
    assert modes(run(settings, "x.x.x.", start=tracking)) == "pppppss"[:6]
    assert modes(run(PAPER, "x" * 31, start=tracking)) == "p" * 30 + "s"


def test_what_was_seen_in_few_images_is_not_waited_for_longer():
    settings = BehaviourSettings(confirm_frames=3, predict_frames=5, unseen_frames=9, earned=True)
    assert modes(run(settings, "ttt....")) == "sstppps"
    assert modes(run(settings, "ttt" + "x" * 7)) == "sst" + "p" * 6 + "s"
    assert modes(run(settings, "t" * 20 + "." * 6)) == "ss" + "t" * 18 + "p" * 5 + "s"


def test_what_is_beyond_reach_is_waited_for():
    settings = BehaviourSettings(predict_frames=2, unseen_frames=3, wait_frames=4)
    state, found = BehaviourState(mode=Mode.TRACK), []
    for _ in range(10):
        state = next_state(state, settings, elapsed_s=9.0, found=False, expected=False, beyond_reach=True)
        found.append(state)
    assert modes(found) == "p" * (4 + 3 + 2) + "s"
    assert modes(run(settings, "t", start=found[3])) == "t"


@given(st.text("t.x", max_size=60), st.integers(1, 4), st.integers(0, 5), st.integers(0, 5))
def test_no_other_arrows(images, confirm, predict, unseen):
    settings = BehaviourSettings(confirm_frames=confirm, predict_frames=predict, unseen_frames=unseen)
    before = BehaviourState(mode=Mode.SCAN)
    for image, state in zip(images, run(settings, images), strict=True):
        allowed = {
            Mode.SCAN: {Mode.SCAN, Mode.TRACK},
            Mode.TRACK: {Mode.TRACK} if image == "t" else {Mode.PREDICT, Mode.SCAN},
            Mode.PREDICT: {Mode.TRACK} if image == "t" else {Mode.PREDICT, Mode.SCAN},
        }
        assert state.mode in allowed[before.mode]
        assert state.missed <= predict
        assert state.unseen <= unseen
        before = state


def test_settings_that_cannot_be_are_refused_all_at_once():
    with pytest.raises(
        ValueError, match=r"check_s of at least 0 s, got -1.*confirm_frames.*predict_frames.*unseen"
    ) as said:
        BehaviourSettings(check_s=-1.0, confirm_frames=0, predict_frames=-1, unseen_frames=-2)
    assert str(said.value).count(";") == 3


@pytest.mark.parametrize("mode", [Mode.TRACK, Mode.PREDICT, Mode.SCAN])
def test_what_is_doubted_is_let_go_of(mode):
    state = BehaviourState(mode=mode, hits=2, seen=50)
    settings = BehaviourSettings(check_s=0.0)
    assert next_state(state, settings, elapsed_s=9.0, found=True, expected=True, doubted=True) == BehaviourState(
        mode=Mode.SCAN
    )


def test_a_candidate_must_look_like_the_target_to_be_tracked():
    """Seen often enough, it is tracked in the first image in which it is likely; how often before does not add up."""
    settings = BehaviourSettings(check_s=0.0, confirm_frames=3)
    state = BehaviourState(mode=Mode.SCAN)
    for _ in range(20):
        state = next_state(state, settings, elapsed_s=1.0, found=True, expected=True, likely=False)
    assert state == BehaviourState(mode=Mode.SCAN, hits=3)
    tracked = next_state(state, settings, elapsed_s=1.0, found=True, expected=True, likely=True)
    assert tracked == BehaviourState(mode=Mode.TRACK, seen=3)
