"""Which of the things that an image shows the default follower takes for the target."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from tests.tracking.control.gaze_images import (
    IMAGES,
    INTERVAL_S,
    MIDDLE,
    follower,
    observation,
    of_area,
)
from tracking.control.association import OVERHEAD_LOG_ODDS
from tracking.estimation.track_evidence import PROBATION_S, RECALLED_S, SILHOUETTE_S
from tracking.estimation.track_record import MEMORY_S
from tracking.perception import ACQUIRED_LOG_ODDS
from tracking.perception.appearance import REMEMBERED_S
from tracking.perception.outline import EVEN_MISSING


def weighed(seen, *log_odds):
    """The observation's blob once for each log odds."""
    return replace(seen, blobs=tuple(replace(seen.blobs[0], log_odds=each) for each in log_odds))


def test_of_blobs_that_are_weighed_the_likeliest_is_followed():
    seen, _ = observation(0, np.array([1.0, 0.0, 0.0]), 0.0)
    following = follower(0.0)
    following.expect(seen)
    assert [blob.log_odds for blob in following.update(weighed(seen, 1.5, 3.0, 2.0))] == [3.0]
    # Those of a detector that does not weigh are pieces of one target.
    assert len(follower(0.0).update(weighed(seen, math.inf, math.inf))) == 2


def test_a_target_of_which_nothing_is_known_must_be_likely():
    seen, _ = observation(0, np.array([1.0, 0.0, 0.0]), 0.0)
    following = follower(0.0)
    assert following.update(weighed(seen, ACQUIRED_LOG_ODDS - 0.1)) == ()
    assert not following.known
    assert following.update(weighed(seen, ACQUIRED_LOG_ODDS + 0.1))
    # In its place, less is enough.
    assert following.update(weighed(seen, ACQUIRED_LOG_ODDS - 1.0))


@pytest.mark.parametrize(
    ("log_odds", "later_s", "overhead", "taken"),
    [
        (4.0, 1.0, False, True),
        (2.9, 1.0, False, False),
        (1.9, 1.0, True, True),  # before the bright surface it shows its dark side
        (2.9, REMEMBERED_S + 0.1, False, True),  # by then it may be anywhere, in another light
    ],
)
def test_what_is_far_paler_than_a_target_that_was_lost_is_no_candidate(log_odds, later_s, overhead, taken):
    """A ball of log odds 6 is followed for a second and lost; something is seen elsewhere."""
    following = follower(0.0)
    for image in range(30):
        seen, _ = observation(IMAGES // 2, MIDDLE, 0.0)
        blob = replace(of_area(seen.blobs[0], 500.0), log_odds=6.0)
        seen = replace(seen, time_s=image * INTERVAL_S, blobs=(blob,))
        following.expect(seen)
        following.update(seen)
    assert following.trusted and not following.doubted
    following.forget(brief=False)
    up = math.radians(21.0 if overhead else 2.0)
    elsewhere, _ = observation(IMAGES // 2, np.array([math.cos(up), 0.0, math.sin(up)]), 0.0)
    elsewhere = replace(weighed(elsewhere, log_odds), time_s=1.0 + later_s)
    following.restore(json.loads(json.dumps(following.snapshot())))
    following.expect(elsewhere)
    assert bool(following.update(elsewhere)) is taken


@pytest.mark.parametrize(
    ("log_odds", "ellipse_share", "box_px", "taken"),
    [
        (1.2, 0.99, (140, 100, 25, 25), True),
        (1.2, 0.90, (140, 100, 25, 25), False),
        (1.2, 0.99, (0, 100, 25, 25), False),
        (0.9, 1.00, (140, 100, 25, 25), False),
    ],
)
def test_what_is_pale_and_has_the_outline_of_a_ball_is_a_candidate(log_odds, ellipse_share, box_px, taken):
    """Not what is ragged, what the crop's edge cuts, or what hardly stands out at all."""
    seen, _ = observation(0, np.array([1.0, 0.0, 0.0]), 0.0)
    blob = replace(seen.blobs[0], log_odds=log_odds, ellipse_share=ellipse_share, box_px=box_px)
    assert bool(follower(0.0).update(replace(seen, blobs=(blob,)))) == taken


@pytest.mark.parametrize(
    ("elevation_deg", "silhouette", "overhead", "taken"),
    [(25.0, False, True, True), (15.0, False, True, False), (25.0, True, True, False), (25.0, False, False, False)],
)
def test_what_is_overhead_has_better_odds(elevation_deg, silhouette, overhead, taken):
    """Where the water leaves no colour it has not: black things stand out there as much."""
    up = math.radians(elevation_deg)
    seen, _ = observation(IMAGES // 2, np.array([math.cos(up), 0.0, math.sin(up)]), 0.0)
    blob = replace(
        seen.blobs[0], log_odds=ACQUIRED_LOG_ODDS - 0.9 * OVERHEAD_LOG_ODDS, silhouette=silhouette, ellipse_share=0.8
    )
    assert bool(follower(0.0, overhead=overhead).update(replace(seen, blobs=(blob,)))) is taken


@pytest.mark.parametrize(("elevation_deg", "doubted"), [(2.0, True), (22.0, False)])
def test_what_is_found_in_pieces_overhead_is_not_doubted_for_it(elevation_deg, doubted):
    """Level it may be a coral; overhead it is a ball's dark side before the bright surface."""
    up = math.radians(elevation_deg)
    following = follower(0.0)
    for image in range(80):
        seen, _ = observation(IMAGES // 2, np.array([math.cos(up), 0.0, math.sin(up)]), 0.0)
        blob = replace(of_area(seen.blobs[0], 500.0 * (1 + image % 2)), log_odds=5.0)
        seen = replace(seen, time_s=image * INTERVAL_S, blobs=(blob,))
        following.expect(seen)
        following.update(seen)
    assert following.trusted and following.doubted is doubted


@pytest.mark.parametrize(("share", "aside_px", "taken"), [(0.9, 0, True), (0.3, 0, False), (0.3, 200, True)])
def test_the_red_part_of_a_dark_thing_overhead_is_no_likelier(share, aside_px, taken):
    """A blue ball's dark upper side, whose lower side is blue; not beside another dark thing."""
    up = math.radians(25.0)
    seen, _ = observation(IMAGES // 2, np.array([math.cos(up), 0.0, math.sin(up)]), 0.0)
    blob = replace(seen.blobs[0], log_odds=ACQUIRED_LOG_ODDS - 0.9 * OVERHEAD_LOG_ODDS, ellipse_share=0.8)
    x, y = blob.centroid_px
    dark = replace(blob, area_px=blob.area_px / share, centroid_px=(x + aside_px, y), silhouette=True, log_odds=0.0)
    assert bool(follower(0.0).update(replace(seen, blobs=(blob, dark)))) is taken


def test_what_was_doubted_is_not_acquired_again():
    target = np.array([1.0, 0.0, 0.0])
    following = follower(0.0)
    for image in range(IMAGES):
        seen, _ = observation(image, target, 0.0)
        following.expect(seen)
        following.update(weighed(seen, ACQUIRED_LOG_ODDS if image == 0 else -3.0))
    assert following.doubted
    following.forget(brief=False)
    seen, _ = observation(IMAGES, target, 0.0)
    following.expect(seen)
    assert following.update(weighed(seen, 3.0)) == ()
    again = follower(0.0)
    again.restore(following.snapshot())
    assert again.update(weighed(seen, 3.0)) == ()
    # Elsewhere it may be the target.
    elsewhere, _ = observation(IMAGES, np.array([math.cos(0.1), math.sin(0.1), 0.0]), 0.0)
    assert following.update(weighed(elsewhere, 3.0))


@pytest.mark.parametrize("log_odds, ellipse_share, doubted", [(1.1, 0.95, True), (5.0, 0.99, False)])
def test_what_is_met_where_the_target_was_hidden_must_be_trusted_anew(log_odds, ellipse_share, doubted):
    """A ball is seen for a second and hidden for 8 images; then a tile or the ball is in its place for a second."""
    target = np.array([1.0, 0.0, 0.0])
    following = follower(0.0)
    for image in range(68):
        seen, _ = observation(IMAGES // 2, target, 0.0)
        looks = (5.0, 0.99) if image < 30 else (log_odds, ellipse_share)
        blob = replace(seen.blobs[0], log_odds=looks[0], ellipse_share=looks[1], box_px=(140, 100, 25, 25))
        seen = replace(seen, time_s=image * INTERVAL_S, blobs=() if 30 <= image < 38 else (blob,))
        following.expect(seen)
        following.update(seen)
    assert following.known and following.doubted is doubted


@pytest.mark.parametrize(
    "larger, left, doubted",
    [
        ((2.9, 0.0), (1.0, 1.0), False),  # pale, and no larger than a target that comes nearer
        ((3.1, 0.0), (1.0, 1.0), True),  # a grey ball's edge is left of the two
        ((3.1, 0.0), (1.0, ACQUIRED_LOG_ODDS), False),  # it comes out again
        ((3.1, ACQUIRED_LOG_ODDS), (1.0, 1.0), True),  # both together still look like it
        ((3.1, ACQUIRED_LOG_ODDS), (3.1, ACQUIRED_LOG_ODDS), True),  # for as long as they are together
    ],
)
def test_what_is_left_of_the_target_and_something_larger_must_look_like_it(larger, left, doubted):
    """A ball is followed for a second, is of another size in two images, and then another thing for 2.1 s."""
    following = follower(0.0)
    for image in range(30 + 2 + 63):
        seen, _ = observation(IMAGES // 2, MIDDLE, 0.0)
        size, log_odds = (1.0, 5.0) if image < 30 else larger if image < 32 else left
        blob = of_area(replace(seen.blobs[0], log_odds=log_odds), 500.0 * size)
        seen = replace(seen, time_s=image * INTERVAL_S, blobs=(blob,))
        following.expect(seen)
        following.update(seen)
    again = follower(0.0)
    again.restore(json.loads(json.dumps(following.snapshot())))
    assert following.known and following.doubted is again.doubted is doubted


@pytest.mark.parametrize("log_odds, left", [(27.0, True), (6.0, False)])
def test_what_passes_before_a_coral_is_the_target_if_it_looks_much_more_like_one(log_odds, left):
    """A coral is followed for two seconds; something of ten times its area passes before it, and is gone."""
    following = follower(0.0)
    for image in range(60 + 5 + 20):
        seen, _ = observation(IMAGES // 2, MIDDLE, 0.0)
        times, odds = (10.0, log_odds) if 60 <= image < 65 else (1.0, 4.3)
        blob = of_area(replace(seen.blobs[0], log_odds=odds), 500.0 * times)
        seen = replace(seen, time_s=image * INTERVAL_S, blobs=(blob,))
        following.expect(seen)
        following.update(seen)
        if image == 61:
            assert following.trusted is not left
    following.forget(brief=False)
    again = replace(seen, time_s=10.0)
    following.expect(again)
    assert (not following.update(again)) is left


def test_what_has_come_before_a_coral_is_followed_for_as_long_as_it_stays():
    """It is not the coral in one piece with something larger, which is doubted after two seconds."""
    following = follower(0.0)
    for image in range(60 + 120):
        seen, _ = observation(IMAGES // 2, MIDDLE, 0.0)
        times, odds = (1.0, 4.3) if image < 60 else (10.0, 27.0)
        blob = of_area(replace(seen.blobs[0], log_odds=odds), 500.0 * times)
        seen = replace(seen, time_s=image * INTERVAL_S, blobs=(blob,))
        following.expect(seen)
        assert following.update(seen)
        assert not following.doubted
    assert following.trusted


@pytest.mark.parametrize("per_s, doubted", [(0.5, False), (40.0, True)])
def test_a_pale_target_that_comes_nearer_is_not_taken_for_something_larger(per_s, doubted):
    """A ball is followed for a second, then has log odds of 1, and 12 times its area after 5 s, or after 0.1 s.

    Its area goes with the inverse square of the distance: by 0.5 a second when it comes nearer by a quarter of it.
    """
    following = follower(0.0)
    for image in range(30 + 150):
        seen, _ = observation(IMAGES // 2, MIDDLE, 0.0)
        grown = min(math.exp(per_s * max(image - 29, 0) * INTERVAL_S), 12.0)
        blob = of_area(replace(seen.blobs[0], log_odds=5.0 if image < 30 else 1.0), 500.0 * grown)
        seen = replace(seen, time_s=image * INTERVAL_S, blobs=(blob,))
        following.expect(seen)
        following.update(seen)
    assert following.doubted is doubted


@pytest.mark.parametrize(
    "seconds, times, taken, doubted",
    [
        (1.5, 1.0, True, False),  # trusted, and as large
        (1.5, 1.9, True, False),
        (1.5, 2.1, False, True),  # something else that is dark, and the target is not to be seen
        (1.5, 0.45, False, True),
        (0.3, 1.0, False, False),  # not yet trusted
        (12.0, 1.0, True, True),  # for too long
    ],
)
def test_a_silhouette_is_the_target_where_it_was_as_large(seconds, times, taken, doubted):
    """A ball is followed for some time, and then as long in its place is something dark."""
    following, images = follower(0.0), round(seconds / INTERVAL_S)
    for image in range(2 * images):
        seen, _ = observation(IMAGES // 2, MIDDLE, 0.0)
        dark = image >= images
        blob = replace(seen.blobs[0], log_odds=0.0 if dark else 5.0, silhouette=dark)
        blob = of_area(blob, 500.0 * (times if dark else 1.0))
        seen = replace(seen, time_s=image * INTERVAL_S, blobs=(blob,))
        following.expect(seen)
        last = following.update(seen)
        if image == images:
            assert bool(last) is taken
    again = follower(0.0)
    again.restore(json.loads(json.dumps(following.snapshot())))
    assert following.doubted is again.doubted is doubted


@pytest.mark.parametrize(
    "elevation_deg, ellipse_share, doubted", [(25.0, 1.0, False), (25.0, 0.8, True), (15.0, 1.0, True)]
)
def test_what_is_dark_and_round_overhead_is_the_target_for_as_long_as_it_is_there(
    elevation_deg, ellipse_share, doubted
):
    """A ball that hovers before the surface was dropped in full view after ten seconds."""
    up = math.radians(elevation_deg)
    seen, _ = observation(IMAGES // 2, np.array([math.cos(up), 0.0, math.sin(up)]), 0.0)
    ball = replace(seen.blobs[0], log_odds=5.0, box_px=(140, 100, 25, 25), ellipse_share=1.0)
    dark = replace(ball, log_odds=0.0, silhouette=True, ellipse_share=ellipse_share)
    following, images = follower(0.0), round(1.5 / INTERVAL_S)
    for image in range(images + round(1.1 * SILHOUETTE_S / INTERVAL_S)):
        now = replace(seen, time_s=image * INTERVAL_S, blobs=(ball if image < images else dark,))
        following.expect(now)
        assert following.update(now)
    assert following.doubted is doubted


def test_what_has_the_colours_of_a_lost_target_is_a_candidate_that_must_show_more():
    """Its log odds of 2 hold the search; with the outline of no ball it is not trusted, and dropped soon."""
    seen, _ = observation(0, np.array([1.0, 0.0, 0.0]), 0.0)
    ragged = {"ellipse_share": 0.96, "box_px": (140, 100, 25, 25)}
    for recalled, trusted in ((False, True), (True, False)):
        blob = replace(seen.blobs[0], log_odds=ACQUIRED_LOG_ODDS, recalled=recalled, **ragged)
        followed = follower(0.0)
        for image in range(math.ceil((PROBATION_S + 0.1) / INTERVAL_S)):
            now = replace(seen, time_s=image * INTERVAL_S, blobs=(blob,))
            followed.expect(now)
            followed.update(now)
        assert followed.trusted is trusted
    assert followed.doubted


@pytest.mark.parametrize(("recalled_s", "doubted"), [(0.9 * RECALLED_S, False), (1.1 * RECALLED_S, True)])
def test_its_own_colours_tell_where_a_target_is_but_not_that_it_is_one(recalled_s, doubted):
    seen, _ = observation(IMAGES // 2, np.array([1.0, 0.0, 0.0]), 0.0)
    ball = replace(seen.blobs[0], log_odds=5.0, area_px=500.0, box_px=(140, 100, 25, 25))
    recalled = replace(ball, log_odds=-math.inf, recalled=True)
    following, images = follower(0.0), round(1.5 / INTERVAL_S)
    for image in range(images + round(recalled_s / INTERVAL_S)):
        now = replace(seen, time_s=image * INTERVAL_S, blobs=(ball if image < images else recalled,))
        following.expect(now)
        last = following.update(now)
        if image == images - 1:
            before = following.snapshot()["evidence"]
        elif image == images:
            assert last == (recalled,)
    after = following.snapshot()["evidence"]
    assert [after[name] for name in ("contrast", "together", "age_s")] == [
        before[name] for name in ("contrast", "together", "age_s")
    ]
    assert following.doubted is doubted


def test_beside_a_rim_that_has_some_colour_what_has_its_own_counts():
    seen, _ = observation(IMAGES // 2, np.array([1.0, 0.0, 0.0]), 0.0)
    ball = replace(seen.blobs[0], log_odds=5.0, area_px=500.0, box_px=(140, 100, 25, 25))
    rim, dark = replace(ball, log_odds=1.9, area_px=60.0), replace(ball, log_odds=0.0, silhouette=True)
    recalled = replace(ball, log_odds=-math.inf, recalled=True)
    following = follower(0.0)
    for image in range(46):
        blobs = (ball,) if image < 45 else (rim, dark, recalled)
        now = replace(seen, time_s=image * INTERVAL_S, blobs=blobs)
        following.expect(now)
        last = following.update(now)
    assert last == (recalled,)


@pytest.mark.parametrize("times, taken", [(1.0, "silhouette"), (2.1, "rim")])
def test_beside_a_rim_that_has_some_colour_the_silhouette_counts(times, taken):
    """Where it may not be the target, what is left is the rim."""
    following = follower(0.0)
    for image in range(46):
        seen, _ = observation(IMAGES // 2, np.array([1.0, 0.0, 0.0]), 0.0)
        ball = replace(seen.blobs[0], log_odds=5.0, area_px=500.0, box_px=(140, 100, 25, 25))
        rim = replace(ball, log_odds=1.0, area_px=60.0)
        dark = replace(ball, log_odds=0.0, area_px=500.0 * times, silhouette=True)
        seen = replace(seen, time_s=image * INTERVAL_S, blobs=(ball,) if image < 45 else (rim, dark))
        following.expect(seen)
        last = following.update(seen)
    assert [blob.silhouette for blob in last] == [taken == "silhouette"]


@pytest.mark.parametrize(
    "looked, times, later_s, acquired",
    [
        (0.2, 1.0, 1.0, True),  # as pale as it was, and as large
        (0.2, 2.1, 1.0, False),
        (0.2, 1.0, 12.1, False),  # it may be anywhere by then
        (3.5, 1.0, 1.0, False),  # it was never so pale
    ],
)
def test_a_target_that_was_lost_is_looked_for_as_it_looked(looked, times, later_s, acquired):
    """A ball that is trusted pales; it is lost, and then something with log odds of -0.5 comes into view."""
    following = follower(0.0)
    for image in range(330):
        seen, _ = observation(IMAGES // 2, np.array([1.0, 0.0, 0.0]), 0.0)
        log_odds = 5.0 if image < 30 else looked
        blob = replace(seen.blobs[0], log_odds=log_odds, area_px=500.0, ellipse_share=1.0, box_px=(140, 100, 25, 25))
        seen = replace(seen, time_s=image * INTERVAL_S, blobs=(blob,))
        following.expect(seen)
        following.update(seen)
    assert following.known and not following.doubted
    following.forget(brief=False)
    again = follower(0.0)
    again.restore(json.loads(json.dumps(following.snapshot())))
    met = replace(seen, time_s=330 * INTERVAL_S + later_s, blobs=(replace(blob, log_odds=-0.5, area_px=500.0 * times),))
    for each in (following, again):
        each.expect(met)
        assert bool(each.update(met)) is acquired


@pytest.mark.parametrize(("log_odds", "may_be"), [(-1.0, True), (5.0, False)])
def test_what_is_dropped_may_be_the_target_and_is_passed_by(log_odds, may_be):
    """As likely as the mean of its odds says, where it was; what is plain and lost is sought in another way."""
    target, images = np.array([1.0, 0.0, 0.0]), 2 * IMAGES
    following = follower(0.0)
    for image in range(images):
        seen, _ = observation(IMAGES // 2, target, 0.0)
        seen = weighed(replace(seen, time_s=image * INTERVAL_S), ACQUIRED_LOG_ODDS if image == 0 else log_odds)
        following.expect(seen)
        following.update(seen)
    assert following.clutter == []
    dropped = following.forget(brief=False)
    if not may_be:
        assert dropped is None and following.clutter == []
        return
    mean = log_odds + (ACQUIRED_LOG_ODDS - log_odds) * math.exp(-(images - 1) * INTERVAL_S / MEMORY_S)
    assert dropped.probability == pytest.approx(1 / (1 + math.exp(-mean)), abs=0.01)
    for direction in (dropped.direction, *(each.direction for each in following.clutter)):
        np.testing.assert_allclose(direction, target, atol=0.01)
    assert len(following.clutter) == 1


def test_what_has_its_own_odds_gets_none_of_a_lost_targets():
    """A coral as large as a pale target that was lost does not look plainly like it for that."""
    following = follower(0.0)
    seen, _ = observation(IMAGES // 2, np.array([1.0, 0.0, 0.0]), 0.0)
    blob = replace(seen.blobs[0], area_px=500.0, ellipse_share=1 - EVEN_MISSING, box_px=(140, 100, 25, 25))
    for image in range(360):
        log_odds = 5.0 if image < 30 else 0.2 if image < 330 else 2.1
        seen = replace(seen, time_s=image * INTERVAL_S, blobs=(replace(blob, log_odds=log_odds),))
        if image == 330:
            following.forget(brief=False)
        following.expect(seen)
        following.update(seen)
    assert following.snapshot()["evidence"]["clearest"] == pytest.approx(2.1)


@pytest.mark.parametrize(
    ("pale", "other", "aside_px", "doubted"),
    [
        (1.8, 8.0, 100.0, True),
        (1.8, 2.0, 100.0, False),
        (5.0, 8.0, 100.0, False),
        (1.8, 8.0, 40.0, False),
    ],
)
def test_a_pale_thing_is_left_for_what_looks_like_the_target_beside_it(pale, other, aside_px, doubted):
    """A brown sponge is followed as the ball comes into view; a coral is there beside the ball, or a bar before it."""
    ahead = np.array([1.0, 0.0, 0.0])
    following = follower(0.0)
    for image in range(3 * IMAGES):
        seen, _ = observation(IMAGES // 2, ahead, 0.0)
        x, y = seen.blobs[0].centroid_px
        aside = replace(seen.blobs[0], centroid_px=(x - aside_px, y), log_odds=other)
        one = replace(seen.blobs[0], log_odds=ACQUIRED_LOG_ODDS if image == 0 else pale)
        beside = replace(seen, time_s=image * INTERVAL_S, blobs=(one, aside) if image > IMAGES else (one,))
        following.expect(beside)
        taken = following.update(beside)
        if following.doubted:
            break
        # A piece of the same thing that looks more like it is followed in its place.
        assert taken == ((aside,) if aside_px < 50 and image > IMAGES else (one,))
    assert following.doubted is doubted
    if doubted:
        following.forget(brief=False)
        assert following.update(beside) == (aside,)


@pytest.mark.parametrize(
    ("told_by", "hidden", "odds", "aside_px", "taken"),
    [
        ("silhouette", 10, 9.0, 80.0, True),
        ("recalled", 10, 9.0, 80.0, True),
        ("now and then", 8, 9.0, 80.0, True),  # between two bars its own colours tell it, in every second image
        ("now and then", 3, 9.0, 80.0, False),
        ("silhouette", 3, 9.0, 80.0, False),  # for an image or two a rim may look like it
        ("silhouette", 10, 4.5, 80.0, False),  # less plain than the target was
        ("", 10, 9.0, 80.0, False),  # the target is seen where it is expected
        ("silhouette", 10, 9.0, 300.0, False),  # too far from there
    ],
)
def test_what_hides_the_target_is_left_when_that_comes_out(told_by, hidden, odds, aside_px, taken):
    """A ball is followed for two seconds, then a grey one before it, which is as dark or has its colours."""
    following = follower(0.0)
    for image in range(60 + hidden):
        seen, _ = observation(IMAGES // 2, np.array([1.0, 0.0, 0.0]), 0.0)
        plain = replace(seen.blobs[0], log_odds=6.0, box_px=(140, 100, 25, 25), area_px=500.0)
        mark = "recalled" if told_by == "now and then" else told_by
        alone = {"silhouette": 0.0, "recalled": -np.inf, "": 5.0}[mark]
        dark = replace(plain, log_odds=alone, **({mark: True} if mark else {}))
        blobs = () if told_by == "now and then" and image > 60 and image % 2 else (plain if image < 60 else dark,)
        seen = replace(seen, time_s=image * INTERVAL_S, blobs=blobs)
        following.expect(seen)
        following.update(seen)
    x, y = plain.centroid_px
    aside = replace(plain, log_odds=odds, centroid_px=(x - aside_px, y), box_px=(40, 100, 25, 25))
    seen = replace(seen, time_s=seen.time_s + INTERVAL_S, blobs=(dark, aside))
    following.expect(seen)
    assert following.update(seen) == ((aside,) if taken else (dark,))
    assert following.trusted is not taken
