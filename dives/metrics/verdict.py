"""Whether a dive did what was asked of it, and what kept it from that, in sentences."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dives.specification import DiveLimits
from rigs import Rig


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What a dive is judged to be.

    Attributes
    ----------
    passed : bool
    sentences : tuple of str
        Of a dive that failed, every limit that it missed and what it was due to; of one that passed, what it reached.
    """

    passed: bool
    sentences: tuple[str, ...]

    @property
    def line(self) -> str:
        """The verdict in one line."""
        return f"{'PASS' if self.passed else 'FAIL'}: {'; '.join(self.sentences)}"


def dive_verdict(metrics: Mapping[str, Any], limits: DiveLimits, rig: Rig) -> Verdict:
    """Judge a dive.

    Parameters
    ----------
    metrics : mapping
        As `dives.dive_metrics` names them.
    limits : DiveLimits
        Of the dive file.
    rig : Rig
        Its `[requirements] gaze_error_deg`, where there is one, stands in the place of the limit's.
    """
    if not metrics["acquired"]:
        return Verdict(passed=False, sentences=(_never_acquired(metrics),))
    asked = None if rig.requirements is None else rig.requirements.gaze_error_deg
    gaze_limit_deg = limits.gaze_error_deg if asked is None else asked
    held, false = metrics["time_on_target_fraction"], metrics["false_tracking_fraction"]
    error_deg, took_s = metrics["gaze_error_held_rms_deg"], metrics["acquisition_time_s"]
    missed = []
    if took_s > limits.acquisition_time_s:
        missed.append(f"acquired after {took_s:.1f} s, at most {limits.acquisition_time_s:g} s allowed")
    if 100 * held < limits.time_on_target_percent:
        missed.append(
            f"held {100 * held:.1f} % of the time from then on, at least {limits.time_on_target_percent:g} % required"
            f"{_losses(metrics)}{_possible(metrics, limits)}"
        )
    if error_deg > gaze_limit_deg:
        missed.append(
            f"gaze {error_deg:.2f} degrees off while held (RMS), at most {gaze_limit_deg:g} degrees allowed"
            f"{_least(metrics, gaze_limit_deg)}"
        )
    if 100 * false > limits.false_tracking_percent:
        missed.append(
            f"on something else {100 * false:.1f} % of the time{_thing(metrics)}, at most"
            f" {limits.false_tracking_percent:g} % allowed"
        )
    if missed:
        return Verdict(passed=False, sentences=tuple(missed))
    reached = f"acquired after {took_s:.1f} s, held {100 * held:.1f} % of the time, {error_deg:.2f} degrees off (RMS)"
    return Verdict(passed=True, sentences=(reached,))


def _never_acquired(metrics: Mapping[str, Any]) -> str:
    """Why a loop never found its target: it was not there to be seen, not detected, or something else was."""
    seen, fired, hit = (metrics[f"frames_{name}"] for name in ("with_target", "detected", "found"))
    words = [f"never acquired: {_images(seen)} of {metrics['frames']} had the target"]
    words.append(f"the detector fired in {fired}, in {fired - hit} of them on something else{_thing(metrics)}")
    if metrics["functional_check_frames"]:
        words.append(f"{_images(metrics['functional_check_frames'])} were the functional check")
    causes = metrics["not_found_causes_frames"]
    if causes:
        cause, count = next(iter(causes.items()))
        words.append(f"most often it was {cause} ({count})")
    return ", ".join(words)


def _thing(metrics: Mapping[str, Any]) -> str:
    """What was followed instead of the target for the longest time."""
    lasting = metrics["false_tracking_things_s"]
    if not lasting:
        return ""
    thing, seconds = next(iter(lasting.items()))
    named = {"decoy": "a decoy", "water": "nothing but water"}.get(thing, f"the {thing}")
    return f" (followed {named} for {seconds:.1f} s)"


def _images(count: int) -> str:
    return f"{count} image{'' if count == 1 else 's'}"


def _losses(metrics: Mapping[str, Any]) -> str:
    """How often it was lost, to what, and how often found again."""
    if not metrics["losses"]:
        return ""
    causes = ", ".join(f"{cause} ({count})" for cause, count in metrics["loss_causes"].items())
    return f": lost {metrics['losses']} times to {causes}, found again {metrics['losses_reacquired']} times"


def _least(metrics: Mapping[str, Any], limit_deg: float) -> str:
    """That no loop could have looked at the target as closely as is required, where that is so."""
    least_deg = metrics.get("gaze_error_possible_rms_deg")
    if least_deg is None or least_deg <= limit_deg:
        return ""
    return f". Less than {least_deg:.2f} degrees was not possible: the target was past the joints' ends"


def _possible(metrics: Mapping[str, Any], limits: DiveLimits) -> str:
    """That no loop could have held the target for as long as is required, where that is so."""
    possible = metrics.get("possible_fraction")
    if possible is None or 100 * possible >= limits.time_on_target_percent:
        return ""
    return (
        f". More than {100 * possible:.1f} % was hardly possible: for the rest of the time nothing shows the target's"
        " middle, or the servos are too slow for it, as where the mirror has to turn round past a joint's end"
    )
