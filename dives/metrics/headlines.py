"""The few numbers of a dive and of its plan that are printed, with their labels and units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

HEADLINES = {
    "acquisition_time_s": ("acquired after", "s"),
    "search_time_s": ("of it looked for", "s"),
    "planned_first_look_s": ("first look as planned", "s"),
    "expected_first_look_s": ("expected for any target", "s"),
    "time_on_target_fraction": ("time on target", ""),
    "possible_fraction": ("most that was possible", ""),
    "visible_fraction": ("target visible", ""),
    "gaze_error_held_rms_deg": ("gaze error held, RMS", "deg"),
    "gaze_error_held_p95_deg": ("gaze error held, 95 %", "deg"),
    "gaze_error_possible_rms_deg": ("least gaze error possible", "deg"),
    "false_tracking_fraction": ("on something else", ""),
    "beyond_reach_s": ("beyond reach", "s"),
    "losses": ("losses", ""),
    "losses_reacquired": ("found again", ""),
}
"""Of the metrics (`dives.metrics.dive_metrics`), what is printed."""

PLANNED = {
    "available_fraction": ("target available", ""),
    "first_available_s": ("first after", "s"),
    "expected_first_look_s": ("search expected to take", "s"),
    "nearest_m": ("nearest", "m"),
    "farthest_m": ("farthest", "m"),
    "rate_p95_deg_per_s": ("angular speed, 95 %", "deg/s"),
    "rate_max_deg_per_s": ("angular speed, largest", "deg/s"),
    "within_speeds_fraction": ("servos keep up", ""),
}
"""Likewise of a plan's numbers (`dives.planning.plan.DivePlan.numbers`)."""


def headline_rows(
    numbers: Mapping[str, Any], labels: Mapping[str, tuple[str, str]] = HEADLINES
) -> list[tuple[str, str]]:
    """Label and value with its unit of each number that is printed; a dash for what is not known."""
    rows = []
    for name, (label, unit) in labels.items():
        value = numbers.get(name)
        text = "-" if value is None else f"{100 * value:.1f} %" if name.endswith("fraction") else f"{value:.4g}"
        rows.append((f"  {label}", f"{text} {unit}".rstrip()))
    return rows
