"""The arena's tables: medians by order statistics, rows by factor, pairs by seed, and stories."""

import csv
import io
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

from dives.arena.run import ArenaOutcome
from dives.arena.tables import (
    ALL,
    METRICS,
    arena_rows,
    dives_csv,
    median_interval,
    pair_differences,
    story,
    summary_csv,
    worst_dives,
)
from optics.workers.run import Failure


def numbers(**changed):
    return {
        "available_s": 20.0,
        "acquired": True,
        "acquisition_time_s": 6.0,
        "expected_first_look_s": 4.0,
        "planned_first_look_s": 5.0,
        "first_visible_s": 5.5,
        "held_fraction": 0.9,
        "held_of_possible_fraction": 0.95,
        "held_of_all_fraction": 0.7,
        "following_s": 15.0,
        "identity_error_fraction": 0.0,
        "longest_on_robot_s": 0.0,
        "longest_on_decoy_s": 0.0,
        "longest_on_world_s": 0.0,
        "longest_on_water_s": 0.0,
        "losses": 1,
        "losses_recovered": 1,
        "reacquisition_times_s": [1.5],
        "unrecovered_times_s": [],
        "gaze_error_held_rms_deg": 0.5,
        "target_rate_p95_deg_per_s": 10.0,
        "not_found_causes_frames": {"colour": 20},
        "loss_causes": [[9.0, 1.5, "colour", True]],
    } | changed


NEVER = {
    "acquired": False,
    "acquisition_time_s": None,
    "held_fraction": None,
    "held_of_possible_fraction": None,
    "held_of_all_fraction": 0.0,
    "following_s": 0.0,
    "identity_error_fraction": None,
    "losses": 0,
    "losses_recovered": 0,
    "reacquisition_times_s": [],
    "unrecovered_times_s": [],
    "gaze_error_held_rms_deg": None,
    "planned_first_look_s": None,
    "loss_causes": [],
}


def outcome(seed, variant="default", *, place="tank", failure=None, **changed):
    return ArenaOutcome(
        seed=seed,
        variant=variant,
        factors={"place": place},
        folder=Path(f"{seed}-{variant}"),
        numbers=None if failure else numbers(**changed),
        failure=failure,
    )


def test_median_holds_the_truth_in_95_of_100_cases_or_more():
    """500 samples of 15 normal numbers: distribution-free, so that it holds at least so often; 0.93 leaves 2 sigma."""
    rng = np.random.default_rng(1)
    held = [
        found.low <= 0 <= found.high
        for found in (median_interval(norm.rvs(size=15, random_state=rng)) for _ in range(500))
    ]
    assert np.mean(held) > 0.93


def test_medians_of_few_and_of_what_never_happened():
    """Of six numbers the least and the largest hold the median in 1 - 2 / 2^6 = 97 % of the cases, of five in 94 %."""
    six = median_interval([3.0, 1.0, 2.0, 6.0, 5.0, 4.0])
    assert (six.low, six.estimate, six.high) == (1.0, 3.5, 6.0)
    five = median_interval([1.0, 2.0, 3.0, 4.0, 5.0])
    assert (five.low, five.estimate, five.high) == (None, 3.0, None)
    censored = median_interval([1.0, 2.0, 3.0, 4.0, np.inf, np.inf])
    assert (censored.low, censored.estimate, censored.high) == (1.0, 3.5, None)
    assert median_interval([1.0, np.inf, np.inf]).estimate is None
    assert median_interval([]).estimate is None


def found(rows, metric, factor=ALL, level="", variant="default"):
    (row,) = [
        row for row in rows if (row.metric, row.factor, row.level, row.variant) == (metric, factor, level, variant)
    ]
    return row.interval


def test_rows_count_dives_whose_target_could_be_seen():
    outcomes = [
        outcome(0),
        outcome(1, place="reef", **NEVER),
        outcome(2, available_s=1.9),
        outcome(3, failure=Failure(sentence="no disk", trace="")),
        outcome(0, "paper", longest_on_robot_s=1.1),
    ]
    rows = arena_rows(outcomes)
    assert found(rows, "acquired_fraction").estimate == 0.5
    assert found(rows, "acquired_fraction").count == 2
    assert found(rows, "acquired_fraction", "place", "reef").estimate == 0.0
    assert found(rows, "held_of_all_fraction").estimate == pytest.approx(0.35)
    # Student's interval of 0.7 and 0 reaches from -4 to 5; shares do not.
    assert (found(rows, "held_of_all_fraction").low, found(rows, "held_of_all_fraction").high) == (0.0, 1.0)
    assert found(rows, "held_fraction").count == 1
    assert found(rows, "recovered_fraction").count == 1
    assert found(rows, "on_robot_fraction", variant="paper").estimate == 1.0
    assert found(rows, "acquisition_over_expected_median", "place", "tank").estimate == 1.5
    assert found(rows, "planned_fraction").estimate == 0.5
    assert {row.metric for row in rows} == set(METRICS)


def test_a_loss_that_the_end_cuts_short_is_none_that_was_never_recovered():
    """Of three losses two end after 1.5 s; one is watched for 0.7 s, and says nothing of what comes after it.

    Another that is watched for 20 s was not recovered within ten: one of three that are known.
    """
    short = outcome(1, losses=1, losses_recovered=0, reacquisition_times_s=[], unrecovered_times_s=[0.7])
    rows = arena_rows([outcome(0), outcome(2), short])
    assert found(rows, "recovered_fraction").estimate == pytest.approx(2 / 3)
    assert found(rows, "recovered_soon_fraction").estimate == 1.0
    long = outcome(3, losses=1, losses_recovered=0, reacquisition_times_s=[], unrecovered_times_s=[20.0])
    assert found(arena_rows([outcome(0), outcome(2), short, long]), "recovered_soon_fraction").estimate == (
        pytest.approx(2 / 3)
    )


def test_identity_errors_of_all_time_count_long_dives_more():
    """A tenth of a dive followed for 30 s and all of one followed for 1 s: 4 of 31 s, and 0.55 in the mean."""
    outcomes = [
        outcome(0, following_s=30.0, identity_error_fraction=0.1),
        outcome(1, following_s=1.0, identity_error_fraction=1.0),
        outcome(2, **NEVER),
    ]
    rows = arena_rows(outcomes)
    assert found(rows, "identity_error_of_all_fraction").estimate == pytest.approx(4 / 31)
    assert found(rows, "identity_error_of_all_fraction").low == 0.0
    assert found(rows, "identity_error_fraction").estimate == pytest.approx(0.55)


def test_loops_are_compared_over_the_same_seeds():
    outcomes = [outcome(0), outcome(1, held_of_all_fraction=0.6), outcome(2, held_of_all_fraction=0.1)]
    outcomes += [outcome(0, "paper", held_of_all_fraction=0.5), outcome(1, "paper", held_of_all_fraction=0.3)]
    ((variant, metric, interval),) = pair_differences(outcomes, ["held_of_all_fraction"])
    assert (variant, metric) == ("paper", "held_of_all_fraction")
    assert interval.estimate == pytest.approx(-0.25)
    assert interval.count == 2


def test_acquisitions_are_compared_dive_by_dive():
    """One of two that the first loop acquired, of three that both dived."""
    outcomes = [outcome(0), outcome(1), outcome(2, **NEVER)]
    outcomes += [outcome(0, "paper"), outcome(1, "paper", **NEVER), outcome(2, "paper", **NEVER)]
    ((_, _, interval),) = pair_differences(outcomes, ["acquired_fraction"])
    assert interval.estimate == pytest.approx(-1 / 3)
    assert interval.count == 3


def test_a_first_loop_that_failed_throughout_is_compared_with_by_nobody():
    outcomes = [outcome(0, failure=Failure(sentence="no disk", trace="")), outcome(0, "paper"), outcome(0, "best")]
    found = pair_differences(outcomes, ["held_of_all_fraction"])
    assert [(variant, interval.count) for variant, _, interval in found] == [("paper", 0), ("best", 0)]


def test_the_worst_are_those_held_least():
    outcomes = [
        outcome(0),
        outcome(1, **NEVER),
        outcome(2, held_of_all_fraction=0.3),
        outcome(3, available_s=0.0, **NEVER),
    ]
    assert [each.seed for each in worst_dives(outcomes, "default", 2)] == [1, 2]


def test_stories_say_what_happened():
    assert story(numbers()) == (
        "Acquired after 6.0 s (the search was to come by at 5.0 s), held 90% of the time available from then on; "
        "lost at 9.0 s (colour), held again after 1.5 s."
    )
    assert story(numbers(**NEVER, longest_on_robot_s=3.2)) == (
        "Never acquired in 20.0 s in which it could be seen; the search never came by. "
        "Frames in which it was not found: colour 20. It followed the robot for up to 3.2 s."
    )


def test_tables_have_a_line_for_each_dive_and_number():
    outcomes = [outcome(0), outcome(1, failure=Failure(sentence="no disk", trace=""))]
    lines = list(csv.DictReader(io.StringIO(dives_csv(outcomes))))
    assert [line["failure"] for line in lines] == ["", "no disk"]
    assert lines[0]["acquisition_time_s"] == "6.0"
    assert lines[0]["place"] == "tank"
    rows = arena_rows(outcomes)
    assert len(list(csv.DictReader(io.StringIO(summary_csv(rows))))) == len(rows)
