"""What an ensemble found: a table of its dives, one of its settings, and one of their differences pair by pair."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from dives.ensembles.members import SEED_KEY, Member
from dives.ensembles.run import Outcome
from dives.metrics.intervals import Interval, difference_interval, fraction_interval, mean_interval
from rigs.atomic_files import csv_text

HEADLINE = (
    "visible_fraction",
    "time_on_target_fraction",
    "found_fraction",
    "gaze_error_rms_deg",
    "gaze_error_held_rms_deg",
    "gaze_error_p95_deg",
    "crop_error_rms_px",
    "estimated_direction_error_rms_deg",
    "search_time_s",
    "false_tracking_fraction",
    "losses",
    "reacquisition_time_mean_s",
    "pixel_precision",
    "pixel_recall",
    "frame_precision",
    "frame_recall",
    "target_to_gaze_lag_s",
)
"""Metrics that are averaged over dives: each dive is one number, whose spread over seeds is reported."""

POOLED = {
    "passed_fraction": ("passed", None),
    "acquired_fraction": ("acquired", None),
    "recovered_fraction": ("losses_reacquired", "losses"),
}
"""Fractions that are counted over all dives together: what counts, and of what; None for the dives themselves."""

AS_IT_IS = "as it is"
"""The settings of an ensemble that varies its seed alone."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """One metric of one setting.

    Attributes
    ----------
    settings : str
    metric : str
        With its unit at its end.
    interval : Interval
    """

    settings: str
    metric: str
    interval: Interval


@dataclass(frozen=True, kw_only=True)
class Difference:
    """How much one metric differs between two values of a key, everything else being the same.

    Attributes
    ----------
    key : str
    value, baseline : str
    metric : str
    interval : Interval
        Of the value's metric minus the baseline's; `count` pairs.
    """

    key: str
    value: str
    baseline: str
    metric: str
    interval: Interval


def summary_rows(outcomes: Sequence[Outcome]) -> list[Row]:
    """Metrics of each setting over its seeds, with 95 per cent intervals: Student's for means, Wilson's for counts."""
    rows = []
    for settings in dict.fromkeys(settings_text(outcome.member) for outcome in outcomes):
        metrics = [
            outcome.metrics
            for outcome in outcomes
            if settings_text(outcome.member) == settings and outcome.metrics is not None
        ]
        rows += [
            Row(settings=settings, metric=name, interval=_pooled(metrics, *counts)) for name, counts in POOLED.items()
        ]
        rows += [
            Row(settings=settings, metric=name, interval=mean_interval(_numbers(metrics, name))) for name in HEADLINE
        ]
    return rows


def differences(outcomes: Sequence[Outcome], key: str) -> list[Difference]:
    """Compare the values of a key with the first of them, over pairs of dives that share all else, the seed included.

    Raises
    ------
    ValueError
        For a key that does not take two values or more.
    """
    # By their text: TOML's lists do not hash, and 1 and true are different settings.
    values = list(
        dict.fromkeys(str(outcome.member.settings[key]) for outcome in outcomes if key in outcome.member.settings)
    )
    if len(values) < 2:
        varied = sorted({name for outcome in outcomes for name in outcome.member.settings})
        raise ValueError(
            f"expected a key that takes two values or more among {', '.join(varied) or 'none'}, got {key!r}"
        )
    by_value = {
        value: {
            _rest(outcome.member, key): outcome.metrics
            for outcome in outcomes
            if str(outcome.member.settings.get(key)) == value
        }
        for value in values
    }
    baseline = by_value[values[0]]
    return [
        Difference(
            key=key,
            value=value,
            baseline=values[0],
            metric=name,
            interval=difference_interval(*_paired(baseline, by_value[value], name)),
        )
        for value in values[1:]
        for name in HEADLINE
    ]


def settings_text(member: Member) -> str:
    """Settings of a member without its seed, legible."""
    return ", ".join(f"{key} = {value}" for key, value in member.settings.items()) or AS_IT_IS


def dives_csv(outcomes: Sequence[Outcome]) -> str:
    """One line a dive: its settings, its seed, what failed, and every metric that is one number."""
    settings = list(dict.fromkeys(key for outcome in outcomes for key in outcome.member.settings))
    names = list(dict.fromkeys(name for outcome in outcomes for name in _single(outcome.metrics or {})))
    lines: list[Sequence[Any]] = [("dive", *settings, SEED_KEY, "failure", *names)]
    lines += [
        (
            outcome.member.name,
            *(outcome.member.settings.get(key) for key in settings),
            outcome.member.seed,
            outcome.failure.sentence if outcome.failure else None,
            *(_single(outcome.metrics or {}).get(name) for name in names),
        )
        for outcome in outcomes
    ]
    return csv_text(lines)


def summary_csv(rows: Iterable[Row]) -> str:
    """One line a setting and metric: estimate, ends of the interval, numbers it stands on."""
    return csv_text(
        [("settings", "metric", "estimate", "low", "high", "count")]
        + [(row.settings, row.metric, *asdict(row.interval).values()) for row in rows]
    )


def differences_csv(rows: Iterable[Difference]) -> str:
    """One line a value and metric: mean difference to the baseline, ends of its interval, pairs."""
    return csv_text(
        [("key", "value", "baseline", "metric", "difference", "low", "high", "pairs")]
        + [(row.key, row.value, row.baseline, row.metric, *asdict(row.interval).values()) for row in rows]
    )


def summary_table(rows: Sequence[Row]) -> list[list[str]]:
    """Metrics down, settings across, the head first."""
    settings = list(dict.fromkeys(row.settings for row in rows))
    cells = {(row.metric, row.settings): str(row.interval) for row in rows}
    metrics = dict.fromkeys(row.metric for row in rows)
    return [["metric", *settings], *([metric, *(cells[metric, each] for each in settings)] for metric in metrics)]


def differences_table(rows: Sequence[Difference]) -> list[list[str]]:
    """Metrics down, values across, each minus the baseline, the head first; what does not cover zero has a star."""
    values = list(dict.fromkeys(row.value for row in rows))
    cells = {(row.metric, row.value): _difference_text(row.interval) for row in rows}
    metrics = dict.fromkeys(row.metric for row in rows)
    head = ["metric", *(f"{value} minus {rows[0].baseline}" for value in values)]
    return [head, *([metric, *(cells[metric, value] for value in values)] for metric in metrics)]


def markdown(table: Sequence[Sequence[str]]) -> str:
    """Table in Markdown; its first row is the head."""
    lines = [table[0], ["---"] * len(table[0]), *table[1:]]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _difference_text(interval: Interval) -> str:
    apart = interval.low is not None and interval.high is not None and not interval.low <= 0 <= interval.high
    return f"{interval} *" if apart else str(interval)


def _pooled(metrics: Sequence[dict[str, Any]], part: str, whole: str | None) -> Interval:
    counted = sum(int(found[part] or 0) for found in metrics)
    trials = len(metrics) if whole is None else sum(int(found[whole] or 0) for found in metrics)
    return fraction_interval(counted, trials)


def _numbers(metrics: Sequence[dict[str, Any]], name: str) -> list[float]:
    return [float(found[name]) for found in metrics if found[name] is not None]


def _paired(
    baseline: dict[tuple[str, int], dict[str, Any] | None],
    others: dict[tuple[str, int], dict[str, Any] | None],
    name: str,
) -> tuple[list[float | None], list[float | None]]:
    shared = [rest for rest in baseline if baseline[rest] is not None and others.get(rest) is not None]
    first, second = ([(found[rest] or {})[name] for rest in shared] for found in (baseline, others))
    return first, second


def _rest(member: Member, key: str) -> tuple[str, int]:
    """What a member is beside the value of a key."""
    return str({name: value for name, value in member.settings.items() if name != key}), member.seed


def _single(metrics: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in metrics.items() if not isinstance(value, dict | list)}
