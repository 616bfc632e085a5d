"""Evidence of a track: what is trusted and doubted when, what clutter is and for how long."""

import json
import math

import numpy as np
import pytest

from tracking.estimation.own_motion import AREAS, MOVED_RAD, SOONEST_S, STAYS_AS_LARGE, STAYS_RAD, WAY_M
from tracking.estimation.size_jumps import FEWEST_COMPARED
from tracking.estimation.track_evidence import (
    AT_LEISURE_S,
    CLUTTER_RAD,
    CLUTTER_S,
    KNOWN_S,
    OUTSHONE_S,
    PLAIN_LOG_ODDS,
    PLAIN_S,
    PROBATION_S,
    SOON_LOG_ODDS,
    SOON_S,
    SWALLOWED_S,
    UNDECIDED_S,
    TrackEvidence,
)
from tracking.estimation.track_record import (
    FADED,
    GAP_S,
    LONGEST_MEMORY_S,
    MEMORY_S,
    MOST_LOG_ODDS,
    MOVED_LOG_ODDS,
    OVERHEAD_RAD,
    SHARE_MEMORY_S,
    TRUSTED_LOG_ODDS,
    TRUSTED_S,
)

INTERVAL_S = 1 / 30
AHEAD = np.array([1.0, 0.0, 0.0])


def turned(angle_rad):
    return np.array([math.cos(angle_rad), math.sin(angle_rad), 0.0])


def followed(contrast, outline, images, direction=AHEAD):
    """Evidence of a thing whose looks do not change."""
    evidence = TrackEvidence()
    for _ in range(images):
        evidence.update(contrast, outline, direction, INTERVAL_S)
    return evidence


def images(seconds):
    return math.ceil(seconds / INTERVAL_S)


def test_odds_are_averaged_over_their_memory():
    """A step of one, after the memory's time: 1 - 1/e of it, whatever the rate of the images."""
    for interval_s in (INTERVAL_S, INTERVAL_S / 10):
        evidence = TrackEvidence()
        evidence.update(0.0, 0.0, AHEAD, interval_s)
        for _ in range(round(MEMORY_S / interval_s)):
            evidence.update(1.0, -1.0, AHEAD, interval_s)
        assert evidence.contrast == pytest.approx(1 - math.exp(-1))
        assert evidence.together == pytest.approx(0.0)


def test_the_share_of_images_that_show_it_is_averaged_too():
    evidence = followed(3.0, 2.0, 60)
    for _ in range(round(SHARE_MEMORY_S / INTERVAL_S)):
        evidence.miss(INTERVAL_S, shown=True)
    assert evidence.share == pytest.approx(math.exp(-1))


def test_a_thing_of_the_targets_colour_and_another_outline_is_doubted():
    """A tile: log odds of 1.1 by contrast and -1.2 by outline, below even together."""
    tile = followed(1.1, -1.2, images(0.5) + 1)
    assert not tile.trusted and not tile.likely and tile.doubted
    ball = followed(1.1, 1.2, images(0.5) + 1)
    assert ball.trusted and ball.likely and not ball.doubted


def test_what_is_trusted_may_fade_until_its_contrast_is_below_even():
    """Before the sun: ragged and pale, but still in the place where it is followed."""
    evidence = followed(3.0, 2.0, 30)
    for _ in range(60):
        evidence.update(0.4, -1.5, AHEAD, INTERVAL_S)
    assert evidence.together < 0 and not evidence.doubted
    for _ in range(60):
        evidence.update(-0.4, -1.5, AHEAD, INTERVAL_S)
    assert evidence.doubted


@pytest.mark.parametrize("seen_s, doubted", [(2.0, True), (30.0, False)])
def test_what_was_followed_for_long_may_fade_for_longer(seen_s, doubted):
    """A second and a half below even, after log odds of 1.5: before a dim reef, in `dark`, the ball has as much."""
    evidence = followed(1.5, 1.0, images(seen_s))
    evidence.motion.moved = True
    for _ in range(images(1.5)):
        evidence.update(-1.5, -1.0, AHEAD, INTERVAL_S)
    assert evidence.trusted and evidence.doubted is doubted


@pytest.mark.parametrize("seen_s, doubted", [(KNOWN_S / 2, True), (KNOWN_S + 1, False)])
def test_what_was_the_target_for_long_may_be_lost_but_is_not_doubted(seen_s, doubted):
    """Found in one image of four, at dusk 4 m away, for ten seconds."""
    evidence = followed(1.5, 1.0, images(seen_s))
    evidence.motion.moved = True
    for image in range(images(10.0)):
        if image % 4:
            evidence.miss(INTERVAL_S, shown=True)
        else:
            evidence.update(0.5, 0.0, AHEAD, INTERVAL_S)
    assert evidence.doubted is doubted


@pytest.mark.parametrize(
    "contrast, moves, doubted",
    [
        (PLAIN_LOG_ODDS - 0.1, False, True),
        (PLAIN_LOG_ODDS + 0.1, False, False),
        (PLAIN_LOG_ODDS - 0.1, True, False),
    ],
)
def test_what_stands_still_and_is_never_plain_is_doubted_in_the_end(contrast, moves, doubted):
    """A round brown sponge is trusted, as a ball in the shade is; a ball that fades or moves stays the target."""
    evidence = followed(contrast, 0.0, images(0.9 * PLAIN_S))
    assert evidence.trusted and not evidence.doubted
    for direction in (turned(1.1 * MOVED_RAD) if moves else AHEAD, AHEAD, AHEAD):
        evidence.update(1.5, 0.0, direction, 0.1 * PLAIN_S)
    assert evidence.doubted is doubted
    evidence.drop(AHEAD, 5.0)
    # It is not looked at again in the same search of everything within reach.
    assert evidence.clutter.covers(AHEAD, 5.0 + 0.99 * CLUTTER_S) is doubted


@pytest.mark.parametrize("below, doubted", [(0.1, True), (-0.1, False)])
def test_what_looks_little_like_the_target_is_doubted_soon(below, doubted):
    """A ball is plain within a second; what is paler than most corals need not be looked at for three."""
    evidence = followed(SOON_LOG_ODDS - below, 0.0, images(0.9 * SOON_S))
    assert evidence.trusted and not evidence.doubted
    for _ in range(images(0.2 * SOON_S)):
        evidence.update(SOON_LOG_ODDS - below, 0.0, AHEAD, INTERVAL_S)
    assert evidence.doubted is doubted


@pytest.mark.parametrize("below, doubted", [(0.1, True), (-0.1, False)])
def test_the_less_colour_the_water_leaves_the_less_plain_it_need_be(below, doubted):
    """A ball 3.4 m away in turbid water, where it has 0.65 of the redness of clear water, was dropped with 2.7."""
    evidence = TrackEvidence(plain=0.65)
    for _ in range(images(1.1 * PLAIN_S)):
        evidence.update(0.65 * PLAIN_LOG_ODDS - below, 0.0, AHEAD, INTERVAL_S)
    assert evidence.trusted and evidence.doubted is doubted


@pytest.mark.parametrize("above_rad, doubted", [(-0.01, True), (0.01, False)])
def test_overhead_a_target_need_not_be_trusted_soon(above_rad, doubted):
    """A ball before the bright surface, told by the colours of the one that was lost, was dropped in full view."""
    evidence = TrackEvidence()
    up = OVERHEAD_RAD + above_rad
    for _ in range(images(2 * PROBATION_S)):
        evidence.update(TRUSTED_LOG_ODDS - 0.1, 0.0, np.array([math.cos(up), 0.0, math.sin(up)]), INTERVAL_S)
    assert not evidence.trusted and evidence.doubted is doubted


@pytest.mark.parametrize("above_rad, doubted", [(-0.01, True), (0.01, False)])
def test_overhead_a_target_need_not_be_plain(above_rad, doubted):
    """Before the bright surface a ball shows its dark side; corals stand below."""
    evidence = TrackEvidence()
    up = OVERHEAD_RAD + above_rad
    for _ in range(images(1.1 * PLAIN_S)):
        evidence.update(2.0, 1.0, np.array([math.cos(up), 0.0, math.sin(up)]), INTERVAL_S)
    assert evidence.trusted and evidence.doubted is doubted


@pytest.mark.parametrize(
    "contrast, outline, doubted", [(3.6, 0.0, True), (3.6, 1.0, False), (3.6, None, True), (2.9, 2.0, True)]
)
def test_a_round_outline_makes_it_plainer(contrast, outline, doubted):
    """A ball of 300 pixels, which had 3.6 by contrast and misses 2 % of an ellipse, was dropped in full view.

    One of another colour is as round.
    """
    assert followed(contrast, outline, images(1.1 * PLAIN_S)).doubted is doubted


def test_one_image_that_looks_very_plain_does_not_make_it_plain():
    evidence = followed(2.7, 1.0, images(0.5 * PLAIN_S))
    evidence.update(50.0, 1.0, AHEAD, INTERVAL_S)
    for _ in range(images(PLAIN_S)):
        evidence.update(2.7, 1.0, AHEAD, INTERVAL_S)
    assert evidence.doubted


@pytest.mark.parametrize(
    "contrast, other, doubted", [(1.4, 4.6, True), (1.4, 4.2, False), (1.9, 4.6, False), (2.5, 9.0, False)]
)
def test_what_has_become_pale_is_doubted_beside_what_looks_much_more_like_the_target(contrast, other, doubted):
    """A grey ball hid the target, and was followed in its place while that stood beside it with odds of 5 to 7."""
    evidence = followed(5.0, 1.0, images(2.0))
    for _ in range(images(3 * LONGEST_MEMORY_S)):
        evidence.update(contrast, 0.0, turned(math.radians(9.0)), INTERVAL_S)
    assert not evidence.doubted
    for _ in range(images(1.5 * OUTSHONE_S)):
        evidence.note_other(other, INTERVAL_S)
    assert evidence.doubted is doubted
    # Where it was is clutter, as it was for nine degrees about when the robot swayed; the target beside it is none.
    evidence.drop(AHEAD, 5.0)
    assert evidence.clutter.covers(turned(math.radians(5.0)), 5.1) is not doubted


@pytest.mark.parametrize(
    "contrast, other, moved, outdone",
    [(4.4, 10.6, False, True), (4.4, 10.2, False, False), (6.0, 25.0, False, False), (4.4, 25.0, True, False)],
    ids=["a coral beside the target", "hardly more", "it is as plain itself", "it moves"],
)
def test_what_stands_still_is_outdone_by_what_looks_much_more_like_the_target(contrast, other, moved, outdone):
    """A round coral had 4.5 for 35 s, and a target that passed it 27."""
    evidence = followed(contrast, 0.0, images(5.0))
    evidence.update(contrast, 0.0, turned(1.1 * MOVED_RAD if moved else 0.0), INTERVAL_S)
    assert not evidence.doubted and evidence.is_outdone_by(other) is outdone
    for _ in range(images(1.5 * OUTSHONE_S)):
        evidence.note_other(other, INTERVAL_S)
    assert evidence.doubted is outdone
    evidence.drop(AHEAD, 5.0)
    assert evidence.clutter.covers(AHEAD, 5.0 + 2 * UNDECIDED_S) is outdone
    assert not evidence.outdone


def test_where_the_water_leaves_no_colour_a_pale_thing_may_be_the_target():
    """A ball at 9 m in coastal water has a mean of 1.5."""
    evidence = TrackEvidence(plain=0.0)
    for _ in range(images(1.5 * PLAIN_S)):
        evidence.update(1.5, 1.0, AHEAD, INTERVAL_S)
    evidence.outshone_s = 2 * OUTSHONE_S
    assert evidence.trusted and not evidence.doubted


@pytest.mark.parametrize("contrast, doubted", [(PLAIN_LOG_ODDS - 0.1, True), (PLAIN_LOG_ODDS + 0.1, False)])
def test_what_is_never_plain_is_doubted_beside_what_looks_like_the_target(contrast, doubted):
    evidence = followed(contrast, 0.0, images(1.0))
    evidence.outshone_s = 0.9 * OUTSHONE_S
    assert not evidence.doubted
    evidence.outshone_s = 1.1 * OUTSHONE_S
    assert evidence.doubted is doubted
    evidence.begin_again()
    assert evidence == TrackEvidence()


@pytest.mark.parametrize("swallowed_s, doubted", [(0.9 * SWALLOWED_S, False), (1.1 * SWALLOWED_S, True)])
def test_what_something_larger_has_swallowed_is_doubted_however_long_it_was_the_target(swallowed_s, doubted):
    evidence = followed(5.0, 2.0, images(KNOWN_S + 1))
    evidence.swallowed_s = swallowed_s
    assert evidence.doubted is doubted
    evidence.begin_again()
    assert evidence.swallowed_s == 0


@pytest.mark.parametrize(
    "sizes, doubted",
    [
        ([600.0, 9000.0, 9200.0, 700.0], True),
        ([600.0, None, 9000.0, None], False),
        ([1000.0, 1300.0], False),
        ([1000.0, 1000.0, 1000.0, 1000.0, 2000.0], False),
    ],
    ids=["pieces", "cut every second time", "breathes", "jumps at times"],
)
def test_what_jumps_in_size_is_pieces_of_something(sizes, doubted):
    """Every second image as much larger or smaller is no ball that comes nearer, however plain it looks."""
    evidence = followed(5.0, 2.0, images(KNOWN_S + 1))
    for number in range(FEWEST_COMPARED):
        evidence.sizes.note(sizes[number % len(sizes)])
    assert not evidence.doubted
    for number in range(FEWEST_COMPARED, 4 * FEWEST_COMPARED):
        evidence.sizes.note(sizes[number % len(sizes)])
    assert evidence.doubted is doubted
    evidence.drop(AHEAD, 5.0)
    assert evidence.clutter.covers(AHEAD, 5.0 + 2 * UNDECIDED_S) is doubted
    assert not evidence.doubted


def test_what_has_moved_by_itself_is_no_piece_of_a_coral():
    """A ball in water that takes its colour is found in pieces, too."""
    still, moving = followed(3.0, 2.0, 30), followed(3.0, 2.0, 30)
    moving.update(3.0, 2.0, turned(1.1 * MOVED_RAD), INTERVAL_S)
    for number in range(2 * FEWEST_COMPARED):
        for evidence in (still, moving):
            evidence.sizes.note(1000.0 * 2 ** (number % 2))
    assert still.doubted and not moving.doubted


def test_a_gap_is_no_jump():
    evidence = followed(3.0, 2.0, 30)
    for number in range(4 * FEWEST_COMPARED):
        evidence.sizes.note(1000.0 * 2 ** (number % 2))
        evidence.miss(INTERVAL_S, shown=False)
    assert evidence.sizes.compared == 0 and not evidence.doubted


def test_what_is_neither_has_a_probation():
    assert not followed(0.5, 0.0, images(PROBATION_S) - 1).doubted
    assert followed(0.5, 0.0, images(PROBATION_S) + 1).doubted


def test_what_moves_by_itself_is_trusted_sooner():
    """Half a log odd by its looks; 13 degrees from where it was first seen, which no hovering robot makes."""
    evidence = followed(0.5, 0.0, images(1.0))
    assert not evidence.trusted
    for _ in range(images(MEMORY_S)):
        evidence.update(0.5, 0.0, turned(1.1 * MOVED_RAD), INTERVAL_S)
    assert evidence.together == pytest.approx(0.5 + MOVED_LOG_ODDS * (1 - math.exp(-1)), abs=0.05)
    assert evidence.trusted and not evidence.doubted


def test_two_things_beside_each_other_have_not_moved():
    """A tile is seen, then another one 13 degrees beside it, after an image that shows neither."""
    evidence = followed(0.5, 0.0, 9)
    evidence.miss(INTERVAL_S, shown=False)
    assert evidence.share == 1.0
    evidence.update(0.5, 0.0, turned(1.1 * MOVED_RAD), INTERVAL_S)
    assert evidence.together == pytest.approx(0.5)


@pytest.mark.parametrize("log_odds, likely_after_s", [(5.0, 0.0), (1.5, 0.5), (0.3, 0.9)])
def test_the_longer_a_candidate_is_seen_the_less_is_asked_of_it(log_odds, likely_after_s):
    """Three times as much as even asks for, falling to nothing within a second."""
    evidence = followed(min(log_odds, MOST_LOG_ODDS), max(log_odds - MOST_LOG_ODDS, 0.0), 1)
    age_s = INTERVAL_S
    while not evidence.likely:
        evidence.update(min(log_odds, MOST_LOG_ODDS), max(log_odds - MOST_LOG_ODDS, 0.0), AHEAD, INTERVAL_S)
        age_s += INTERVAL_S
    assert age_s == pytest.approx(likely_after_s, abs=2 * INTERVAL_S)


def test_what_an_edge_cuts_is_tracked_when_all_of_it_is_seen_or_it_is_trusted():
    evidence = followed(MOST_LOG_ODDS, None, 6)
    assert evidence.together == MOST_LOG_ODDS
    assert not evidence.likely
    evidence.update(MOST_LOG_ODDS, 0.0, AHEAD, INTERVAL_S)
    assert evidence.likely
    assert not followed(MOST_LOG_ODDS, None, images(TRUSTED_S) - 1).likely
    assert followed(MOST_LOG_ODDS, None, images(TRUSTED_S) + 1).likely
    # Too pale to be trusted, it is tracked after the second in which less and less is asked of what is whole.
    assert not followed(0.5, None, images(AT_LEISURE_S) - 2).likely
    assert followed(0.5, None, images(AT_LEISURE_S) + 1).likely
    evidence.begin_again()
    assert not evidence.whole


def test_what_is_seen_in_few_of_the_images_that_should_show_it_is_doubted():
    """A coral is found in one of five images, a ball at dusk in two of three."""
    for every, seen, doubted in ((5, 1, True), (3, 2, False)):
        evidence = followed(3.0, 0.0, 30)
        for image in range(90):
            if image % every < seen:
                evidence.update(3.0, 0.0, AHEAD, INTERVAL_S)
            else:
                evidence.miss(INTERVAL_S, shown=True)
        assert evidence.doubted is doubted


def test_what_comes_back_paler_may_be_another_thing():
    evidence = followed(3.0, 2.0, 30)
    assert evidence.is_another(2.9 - FADED, GAP_S)
    assert not evidence.is_another(3.1 - FADED, GAP_S)
    assert not evidence.is_another(2.9 - FADED, 0.9 * GAP_S)
    assert not TrackEvidence().is_another(-3.0, GAP_S)


def test_one_image_does_not_outweigh_the_others():
    evidence = TrackEvidence()
    evidence.update(math.inf, 0.0, AHEAD, INTERVAL_S)
    assert evidence.contrast == evidence.together == MOST_LOG_ODDS
    evidence.update(-math.inf, 0.0, AHEAD, INTERVAL_S)
    assert not evidence.doubted


def test_nothing_followed_is_not_doubted():
    evidence = followed(-1.0, 0.0, 30)
    assert evidence.doubted
    evidence.begin_again()
    assert not evidence.doubted and evidence.clutter.places == []
    assert evidence == TrackEvidence()


def test_what_was_dropped_is_clutter_there_and_for_a_while():
    evidence = followed(-1.0, 0.0, 30)
    evidence.drop(AHEAD, 5.0)
    assert evidence.contrast is None and evidence.together is None
    assert evidence.clutter.covers(turned(0.9 * CLUTTER_RAD), 6.0)
    assert not evidence.clutter.covers(turned(1.1 * CLUTTER_RAD), 6.0)
    assert evidence.clutter.covers(AHEAD, 5.0 + 0.99 * CLUTTER_S)
    assert not evidence.clutter.covers(AHEAD, 5.0 + CLUTTER_S)


def test_what_swings_with_the_robot_is_clutter_as_far_as_it_swung():
    """A robot that sways by four degrees to each side sees a coral swing by eight: it is not taken up again beside."""
    evidence = TrackEvidence()
    for image in range(60):
        evidence.update(-1.0, 0.0, turned(math.radians(8.0) * math.sin(image / 20) ** 2), INTERVAL_S)
    evidence.drop(AHEAD, 5.0)
    assert evidence.clutter.covers(turned(math.radians(7.9)), 6.0)
    assert not evidence.clutter.covers(turned(math.radians(8.1)), 6.0)
    evidence.update(-1.0, 0.0, turned(1.0), INTERVAL_S)
    evidence.drop(turned(1.0), 6.0)
    assert not evidence.clutter.covers(turned(1.0 + 1.1 * CLUTTER_RAD), 6.0)


def test_a_large_thing_is_passed_as_far_as_it_reaches():
    """Of a ball that fills half the view now this part is seen and now that: it broke a search off eight times."""
    evidence = followed(2.0, 0.0, 5)
    evidence.drop(AHEAD, 5.0, 2 * CLUTTER_RAD)
    assert evidence.clutter.covers(turned(1.9 * CLUTTER_RAD), 6.0)
    assert not evidence.clutter.covers(turned(2.1 * CLUTTER_RAD), 6.0)


def test_what_was_above_even_is_passed_for_a_while_only():
    """A ball in murky water is not trusted within its probation; a speck was not seen again before it was judged."""
    for evidence in (followed(0.5, 0.0, 60), followed(1.5, 0.0, 1)):
        evidence.drop(AHEAD, 5.0)
        assert evidence.clutter.covers(AHEAD, 5.0 + 0.99 * UNDECIDED_S)
        assert not evidence.clutter.covers(AHEAD, 5.0 + UNDECIDED_S)


@pytest.mark.parametrize(
    ("contrast", "outline", "chance"), [(-1.0, 0.0, 0.27), (0.5, 0.0, 0.62), (1.0, -1.0, 0.5)], ids=str
)
def test_what_is_dropped_is_the_target_as_likely_as_its_odds_say(contrast, outline, chance):
    assert followed(contrast, outline, 30).probability == pytest.approx(chance, abs=0.01)


def test_what_was_seen_too_briefly_or_is_no_target_by_other_signs_has_no_probability():
    """What stands still and was never plain is a coral; pieces are, where targets look plain."""
    assert followed(2.0, 1.0, 5).probability == 0
    assert followed(1.5, 0.5, images(PLAIN_S + 0.5)).probability == 0
    plain, pale = followed(0.5, 0.0, 30), followed(0.5, 0.0, 30)
    pale.plain = False
    for number in range(2 * FEWEST_COMPARED):
        for evidence in (plain, pale):
            evidence.sizes.note(1000.0 * 2 ** (number % 2))
    assert plain.probability == 0 and pale.probability == pytest.approx(0.62, abs=0.01)


def test_a_snapshot_holds_all_of_it():
    evidence = followed(3.0, 2.0, 30)
    evidence.drop(turned(0.1), 2.0)
    for _ in range(20):
        evidence.update(1.0, 0.5, AHEAD, INTERVAL_S)
    evidence.miss(INTERVAL_S, shown=True)
    evidence.swallowed_s = 0.5
    for area_px in (1000.0, 2000.0):
        evidence.sizes.note(area_px)
    again = TrackEvidence()
    again.restore(json.loads(json.dumps(evidence.snapshot())))
    assert again.snapshot() == evidence.snapshot()
    assert again.clutter.covers(turned(0.1), 3.0)
    np.testing.assert_array_equal(again.motion.first, evidence.motion.first)


@pytest.mark.parametrize("speed", [0.1, 0.3, 2.0])
def test_what_stays_where_it_was_seen_first_is_no_target_that_swims(speed):
    """It looks like the target for ever, and is dropped once that would have swum 1.4 m, or after 3 s; for 30 s."""
    patience_s = max(WAY_M / speed, SOONEST_S)
    decoy = TrackEvidence(least_speed_m_per_s=speed)
    for image in range(images(patience_s) + 2):
        # A robot that sways does not take it away from there.
        swayed = turned(0.45 * STAYS_RAD * math.sin(image / 20))
        assert not decoy.doubted or image * INTERVAL_S > patience_s
        # At first a part of it is seen, later it is in one piece with something else: neither is round.
        in_part = image < 15 or image > 60
        area_px = 300.0 if image < 15 else 2000.0 if image > 60 else 1000.0 + 150.0 * math.cos(image / 20)
        decoy.update(5.0, 0.5 if in_part else 2.0, swayed, INTERVAL_S, area_px)
    assert decoy.doubted and decoy.probability == 0
    # Wherever the robot's sway takes it, it is passed by.
    decoy.drop(turned(-0.45 * STAYS_RAD), 0.0)
    for sway in (-0.6, 0.0, 0.6):
        assert decoy.clutter.covers(turned(sway * STAYS_RAD), 0.99 * CLUTTER_S)
    assert not followed(5.0, 2.0, images(KNOWN_S)).doubted  # nothing is known of its speed


@pytest.mark.parametrize(
    ("direction", "times"), [(turned(1.1 * STAYS_RAD), 1), (AHEAD, 1.1 * STAYS_AS_LARGE), (AHEAD, 0.9 / STAYS_AS_LARGE)]
)
def test_what_has_left_the_place_where_it_was_seen_first_may_rest_anywhere(direction, times):
    """Once is enough, also across a gap, and where it comes back: aside, towards the robot or away from it."""
    evidence = TrackEvidence(least_speed_m_per_s=1.0)
    show(evidence, AHEAD, 1000.0)
    evidence.miss(INTERVAL_S, shown=False)
    show(evidence, direction, 1000.0 * times)
    assert_never_stays(evidence)


@pytest.mark.parametrize(("angle_rad", "times"), [(0.55 * STAYS_RAD, 1.0), (0.0, 1.1 * math.sqrt(STAYS_AS_LARGE))])
def test_what_is_met_half_way_leaves_from_end_to_end(angle_rad, times):
    """As a target that swims to and fro about a place, across the view or towards the robot and away from it."""
    evidence = TrackEvidence(least_speed_m_per_s=1.0)
    show(evidence, AHEAD, 1000.0)
    show(evidence, turned(angle_rad), 1000.0 * times)
    assert not evidence.motion.left
    show(evidence, turned(-angle_rad), 1000.0 / times)
    assert_never_stays(evidence)


def show(evidence, direction, area_px):
    for _ in range(AREAS):
        evidence.update(5.0, 2.0, direction, INTERVAL_S, area_px)


def assert_never_stays(evidence):
    restored = TrackEvidence(least_speed_m_per_s=1.0)
    restored.restore(json.loads(json.dumps(evidence.snapshot())))
    for each in (evidence, restored):
        for _ in range(images(2 * SOONEST_S)):
            each.update(5.0, 2.0, AHEAD, INTERVAL_S)
        assert not each.doubted


def test_time_in_which_it_is_not_seen_does_not_count_as_rest():
    evidence = TrackEvidence(least_speed_m_per_s=1.0)
    for _ in range(images(0.8 * SOONEST_S)):
        evidence.update(5.0, 2.0, AHEAD, INTERVAL_S)
        evidence.miss(INTERVAL_S, shown=False)
    assert not evidence.doubted
