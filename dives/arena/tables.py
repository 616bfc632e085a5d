"""What the arena found: each loop's numbers with their intervals, the same by factor, and the dives that went worst."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import binom

from dives.arena.judged import SHORTEST_AVAILABLE_S, THINGS
from dives.arena.run import ArenaOutcome
from dives.metrics.intervals import (
    CONFIDENCE,
    Interval,
    difference_interval,
    ended_interval,
    fraction_interval,
    mean_interval,
    ratio_interval,
)
from dives.planning.followable import SERVO_SHARE
from rigs.atomic_files import csv_text

HELD_FRACTION = 0.95
"""Of the available time after the acquisition, what a dive is to be held."""

LONGEST_ON_ROBOT_S = 1.0

RECOVERED_WITHIN_S = 10.0
"""In which the slowest preset's search of everything expects to come by once. A loss that the dive's end cuts short
says nothing of what would have come after it."""

ALL = "all dives"

Numbers = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class ArenaRow:
    """One number of one loop over some dives.

    Attributes
    ----------
    variant : str
    factor, level : str
        Which dives: those of one level of a factor; `ALL` and empty for all of them.
    metric : str
        With its unit at its end.
    interval : Interval
    """

    variant: str
    factor: str
    level: str
    metric: str
    interval: Interval


def median_interval(values: Sequence[float], *, confidence: float = CONFIDENCE) -> Interval:
    """Median with its distribution-free interval between order statistics (Conover 1999, section 3.2).

    What never happened may stand as infinity; an end or a median there is None.
    """
    ordered = np.sort(np.asarray(values, dtype=np.float64))
    count = len(ordered)
    if count == 0:
        return Interval(estimate=None, low=None, high=None, count=0)
    # With k below and k above left out the median is outside with probability 2 P(B <= k - 1), B ~ Bin(n, 1/2).
    left_out = int(binom.ppf((1 - confidence) / 2, count, 0.5))
    if binom.cdf(left_out, count, 0.5) > (1 - confidence) / 2:
        left_out -= 1
    ends = (ordered[left_out], ordered[count - 1 - left_out]) if left_out >= 0 else (np.nan, np.nan)
    with np.errstate(invalid="ignore"):
        median = np.nan if np.isinf(ordered[(count - 1) // 2 : count // 2 + 1]).any() else np.median(ordered)
    low, estimate, high = (float(each) if np.isfinite(each) else None for each in (ends[0], median, ends[1]))
    return Interval(estimate=estimate, low=low, high=high, count=count)


def _counted(happened: Callable[[Numbers], bool]) -> Callable[[list[Numbers]], Interval]:
    return lambda dives: fraction_interval(sum(map(happened, dives)), len(dives))


def _identity_error(dives: list[Numbers]) -> Interval:
    """Of all time in which something is followed, whatever the dive, the share on something else than the target."""
    following = [dive for dive in dives if dive["following_s"] > 0]
    seconds = [dive["following_s"] for dive in following]
    found = ratio_interval([dive["identity_error_fraction"] * dive["following_s"] for dive in following], seconds)
    return _within_shares(found)


def _within_shares(found: Interval) -> Interval:
    """An interval of a share, which ends at 0 and 1, where the truth must be."""
    if found.low is None or found.high is None:
        return found
    return replace(found, low=max(found.low, 0.0), high=min(found.high, 1.0))


def _mean(name: str) -> Callable[[list[Numbers]], Interval]:
    """Mean over dives that have a number."""

    def interval(dives: list[Numbers]) -> Interval:
        found = mean_interval([dive[name] for dive in dives if dive[name] is not None])
        return _within_shares(found) if name.endswith("_fraction") else found

    return interval


def _median(of: Callable[[Numbers], float]) -> Callable[[list[Numbers]], Interval]:
    return lambda dives: median_interval([of(dive) for dive in dives])


def _recovered(dives: list[Numbers]) -> Interval:
    return fraction_interval(sum(dive["losses_recovered"] for dive in dives), sum(dive["losses"] for dive in dives))


def _recovered_soon(dives: list[Numbers]) -> Interval:
    ended, unended = (
        [time for dive in dives for time in dive[name]] for name in ("reacquisition_times_s", "unrecovered_times_s")
    )
    return ended_interval(ended, unended, RECOVERED_WITHIN_S)


def _acquisition_s(dive: Numbers) -> float:
    return float(dive["acquisition_time_s"]) if dive["acquired"] else float("inf")


METRICS: dict[str, Callable[[list[Numbers]], Interval]] = {
    "planned_fraction": _counted(lambda dive: dive["planned_first_look_s"] is not None),
    "acquired_fraction": _counted(lambda dive: dive["acquired"]),
    "acquisition_time_median_s": _median(_acquisition_s),
    "acquisition_over_expected_median": _median(lambda dive: _acquisition_s(dive) / dive["expected_first_look_s"]),
    "held_fraction": _mean("held_fraction"),
    "held_of_possible_fraction": _mean("held_of_possible_fraction"),
    "held_of_all_fraction": _mean("held_of_all_fraction"),
    "well_held_fraction": _counted(lambda dive: (dive["held_fraction"] or 0.0) >= HELD_FRACTION),
    "identity_error_fraction": _mean("identity_error_fraction"),
    "identity_error_of_all_fraction": _identity_error,
    "on_robot_fraction": _counted(lambda dive: dive["longest_on_robot_s"] > LONGEST_ON_ROBOT_S),
    "recovered_fraction": _recovered,
    "recovered_soon_fraction": _recovered_soon,
    "reacquisition_time_median_s": lambda dives: median_interval(
        [time for dive in dives for time in dive["reacquisition_times_s"]]
    ),
    "gaze_error_held_rms_deg": _mean("gaze_error_held_rms_deg"),
}
"""Numbers of a loop over dives whose target was available for `SHORTEST_AVAILABLE_S` or more."""

MEANINGS = {
    "planned_fraction": "dives in which the search, broken off by nothing, has the target in its view",
    "acquired_fraction": "dives that acquired the target",
    "acquisition_time_median_s": "median time to the acquisition, s; never counts as longer than any",
    "acquisition_over_expected_median": "the same over the search's own expected first look",
    "held_fraction": "held, of the time available after the acquisition; mean over dives that acquired",
    "held_of_possible_fraction": "held after it, of the longest time that a mirror that knows the path beforehand could"
    f" have shown the target at {SERVO_SHARE:.0%} of the servos' speeds",
    "held_of_all_fraction": "held, of all time available; mean over dives",
    "well_held_fraction": f"dives held {HELD_FRACTION:.0%} of the time available after the acquisition, or more",
    "identity_error_fraction": "on something else, of the time in which the loop tracks or predicts; mean over dives",
    "identity_error_of_all_fraction": "the same of all such time, whichever dive it belongs to",
    "on_robot_fraction": f"dives that followed the robot itself for more than {LONGEST_ON_ROBOT_S:g} s at a time",
    "recovered_fraction": "losses after which it was held again before the dive ended",
    "recovered_soon_fraction": f"losses after which it was held again within {RECOVERED_WITHIN_S:g} s of time"
    " available; those that the dive's end cuts short count for as long as they were watched",
    "reacquisition_time_median_s": "median time available until then, s",
    "gaze_error_held_rms_deg": "gaze error while held, deg RMS; mean over dives",
}


HEADLINES = ("held_of_all_fraction", "acquired_fraction", "identity_error_fraction", "gaze_error_held_rms_deg")
"""Numbers that are reported by factor, and by which loops are compared seed by seed."""

OF_ONE_DIVE = {"acquired_fraction": "acquired"}
"""What a dive's own number is called, where it has another name than the metric."""


def arena_rows(outcomes: Sequence[ArenaOutcome]) -> list[ArenaRow]:
    """Numbers of each loop over all dives, and by the levels of each factor, with 95 per cent intervals."""
    usable = [outcome for outcome in outcomes if is_available(outcome)]
    rows = []
    for variant in dict.fromkeys(outcome.variant for outcome in usable):
        own = [outcome for outcome in usable if outcome.variant == variant]
        groups = {(ALL, ""): own}
        for factor in own[0].factors:
            for level in sorted({outcome.factors[factor] for outcome in own}):
                groups[factor, level] = [outcome for outcome in own if outcome.factors[factor] == level]
        rows += [
            ArenaRow(variant=variant, factor=factor, level=level, metric=metric, interval=of(_numbers(group)))
            for (factor, level), group in groups.items()
            for metric, of in METRICS.items()
        ]
    return rows


def is_available(outcome: ArenaOutcome) -> bool:
    """Whether a dive was finished and its target was available long enough to say something of the loop."""
    return outcome.numbers is not None and outcome.numbers["available_s"] >= SHORTEST_AVAILABLE_S


def pair_differences(outcomes: Sequence[ArenaOutcome], metrics: Iterable[str]) -> list[tuple[str, str, Interval]]:
    """Loop, metric, and the mean difference to the first loop over the same seeds, with its interval.

    Metrics are of `METRICS`, and means or fractions over dives.
    """
    # A loop whose dives all failed is there without any: the first one stays the first.
    by_variant: dict[str, dict[int, Numbers]] = {outcome.variant: {} for outcome in outcomes}
    for outcome in outcomes:
        if is_available(outcome) and outcome.numbers is not None:
            by_variant[outcome.variant][outcome.seed] = outcome.numbers
    if not by_variant:
        return []
    (_, first), *others = by_variant.items()
    return [
        (
            variant,
            metric,
            difference_interval(
                *([_of_one(dives[seed], metric) for seed in first if seed in own] for dives in (first, own))
            ),
        )
        for variant, own in others
        for metric in metrics
    ]


def _of_one(dive: Numbers, metric: str) -> float | None:
    value: float | None = dive[OF_ONE_DIVE.get(metric, metric)]
    return value


def worst_dives(outcomes: Sequence[ArenaOutcome], variant: str, count: int) -> list[ArenaOutcome]:
    """Dives of a loop that held least of the available time, the worst first."""
    own = [outcome for outcome in outcomes if outcome.variant == variant and is_available(outcome)]
    return sorted(own, key=lambda outcome: (outcome.numbers or {})["held_of_all_fraction"])[:count]


def story(numbers: Numbers) -> str:
    """How a dive went, and what it was due to, in a sentence or two."""
    causes = numbers["not_found_causes_frames"]
    why = ", ".join(f"{cause} {count}" for cause, count in list(causes.items())[:3]) or "none"
    longest = max(THINGS, key=lambda thing: numbers[f"longest_on_{thing}_s"])
    seconds = numbers[f"longest_on_{longest}_s"]
    elsewhere = f" It followed the {longest} for up to {seconds:.1f} s." if seconds > LONGEST_ON_ROBOT_S else ""
    planned = numbers["planned_first_look_s"]
    look = "the search never came by" if planned is None else f"the search was to come by at {planned:.1f} s"
    if not numbers["acquired"]:
        return (
            f"Never acquired in {numbers['available_s']:.1f} s in which it could be seen; {look}. "
            f"Frames in which it was not found: {why}.{elsewhere}"
        )
    lost = [
        f"lost at {start:.1f} s ({cause}), " + (f"held again after {lasting:.1f} s" if again else "not found again")
        for start, lasting, cause, again in numbers["loss_causes"]
    ]
    held = numbers["held_fraction"]
    held_text = "" if held is None else f", held {held:.0%} of the time available from then on"
    losses = f"; {'; '.join(lost)}" if lost else ""
    return f"Acquired after {numbers['acquisition_time_s']:.1f} s ({look}){held_text}{losses}.{elsewhere}"


def dives_csv(outcomes: Sequence[ArenaOutcome]) -> str:
    """One line a dive: seed, loop, factors, what failed, and every number."""
    factors = list(outcomes[0].factors) if outcomes else []
    names = list(
        dict.fromkeys(
            name
            for outcome in outcomes
            for name, value in (outcome.numbers or {}).items()
            if not isinstance(value, dict | list)
        )
    )
    lines: list[Sequence[Any]] = [("seed", "loop", *factors, "failure", *names)]
    lines += [
        (
            outcome.seed,
            outcome.variant,
            *(outcome.factors[factor] for factor in factors),
            outcome.failure.sentence if outcome.failure else None,
            *((outcome.numbers or {}).get(name) for name in names),
        )
        for outcome in outcomes
    ]
    return csv_text(lines)


def summary_csv(rows: Iterable[ArenaRow]) -> str:
    """One line a loop, level and metric: estimate, ends of the interval, numbers it stands on."""
    return csv_text(
        [("loop", "factor", "level", "metric", "estimate", "low", "high", "count")]
        + [(row.variant, row.factor, row.level, row.metric, *asdict(row.interval).values()) for row in rows]
    )


def _numbers(outcomes: Iterable[ArenaOutcome]) -> list[Numbers]:
    return [outcome.numbers for outcome in outcomes if outcome.numbers is not None]
