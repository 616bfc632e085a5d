"""What a rig is asked for beside what it reaches: each requirement passes, fails, or is not judged yet."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from rigs import Requirements

AT_LEAST, AT_MOST = "at least", "at most"
CHECK = "mirrorgaze check --require"


class Outcome(StrEnum):
    """What became of a requirement."""

    PASS = "pass"
    FAIL = "fail"
    OPEN = "not judged"


@dataclass(frozen=True, kw_only=True)
class Judged:
    """One requirement.

    Attributes
    ----------
    name : str
    required, achieved : str
        With units; what is achieved of one that is not judged says which command judges it.
    outcome : Outcome
    """

    name: str
    required: str
    achieved: str
    outcome: Outcome


@dataclass(frozen=True, kw_only=True)
class Achieved:
    """What is known of a design; None where it is not.

    Attributes
    ----------
    seen : tuple of bool, optional
        Whether each of the required directions is seen over both mirrors at some joint values.
    covered_fraction : float, optional
        Of all directions.
    pixels_per_degree : float, optional
        Where the image is coarsest.
    gaze_error_deg : float, optional
        RMS of a dive's gaze after the acquisition; infinite for a target that was never acquired.
    mount_mass_kg : float, optional
    print_time_s : float, optional
        Of all plates.
    """

    seen: tuple[bool, ...] | None = None
    covered_fraction: float | None = None
    pixels_per_degree: float | None = None
    gaze_error_deg: float | None = None
    mount_mass_kg: float | None = None
    print_time_s: float | None = None


def judged(asked: Requirements | None, achieved: Achieved) -> list[Judged]:
    """Every requirement that is stated, in the order of the rig file."""
    if asked is None:
        return []
    found = []
    for position, (azimuth, elevation) in enumerate(asked.directions_deg):
        seen = None if achieved.seen is None else achieved.seen[position]
        name = f"azimuth {azimuth:g}°, elevation {elevation:g}°"
        words = {None: f"not known: {CHECK}", True: "seen", False: "not seen at any joint values"}[seen]
        found.append(Judged(name=name, required="seen over both mirrors", achieved=words, outcome=_outcome(seen)))
    covered = None if achieved.covered_fraction is None else 100 * achieved.covered_fraction
    mass_g = None if achieved.mount_mass_kg is None else 1000 * achieved.mount_mass_kg
    hours = None if achieved.print_time_s is None else achieved.print_time_s / 3600
    numbers = (
        ("directions covered", (AT_LEAST, asked.covered_percent), covered, "%", "mirrorgaze coverage"),
        (_target_name(asked), (AT_LEAST, asked.target_px), _target_px(asked, achieved), "px", CHECK),
        ("gaze error, RMS", (AT_MOST, asked.gaze_error_deg), achieved.gaze_error_deg, "°", "mirrorgaze design"),
        ("mass of the mount", (AT_MOST, asked.mount_mass_g), mass_g, "g", CHECK),
        ("print time", (AT_MOST, asked.print_hours), hours, "h", f"{CHECK} --cad, with a slicer"),
    )
    for name, (words, bound), value, unit, command in numbers:
        if bound is not None:
            found.append(_number(name, (words, bound), value, unit, command))
    return found


def _target_name(asked: Requirements) -> str:
    return f"target of {asked.target_diameter_mm or 0:g} mm in {(asked.target_distance_mm or 0) / 1000:g} m"


def _target_px(asked: Requirements, achieved: Achieved) -> float | None:
    """Pixels across the target: a sphere of diameter D whose centre is d away subtends 2 asin(D / 2 d)."""
    if asked.target_diameter_mm is None or asked.target_distance_mm is None or achieved.pixels_per_degree is None:
        return None
    half_sine = min(1.0, asked.target_diameter_mm / 2 / asked.target_distance_mm)
    return float(2 * np.degrees(np.arcsin(half_sine)) * achieved.pixels_per_degree)


def _number(name: str, limit: tuple[str, float], value: float | None, unit: str, command: str) -> Judged:
    """A requirement about a number, whose limit is such as ("at least", 20.0); `command` tells the number."""
    words, bound = limit
    if value is None:
        achieved, met = f"not known: {command}", None
    else:
        achieved, met = _with_unit(value, unit), value >= bound if words == AT_LEAST else value <= bound
    return Judged(name=name, required=f"{words} {_with_unit(bound, unit)}", achieved=achieved, outcome=_outcome(met))


def _with_unit(value: float, unit: str) -> str:
    if np.isinf(value):
        return "target never acquired"
    return f"{value:.4g}{'' if unit == '°' else ' '}{unit}"


def _outcome(met: bool | None) -> Outcome:
    return Outcome.OPEN if met is None else Outcome.PASS if met else Outcome.FAIL
