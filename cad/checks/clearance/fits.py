"""Pairs of parts that move against each other nearer than the mount's clearance, because they are made to.

Every such pair is named here with what it must keep; all others keep `mount.clearance_mm`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

RUNNING_GAP_MM = 0.8
"""Between faces that pass each other within the gimbal: twice what two printed faces may be off (0.2 mm each)."""


class FitKind(StrEnum):
    """How two parts meet."""

    BEARING = "bearing"
    """They all but touch on surfaces of revolution about the joint's axis: the gap is the same for all q."""
    RUNNING = "running"
    """They pass each other with a gap smaller than the mount's clearance."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """What two parts that move against each other are made to keep.

    Attributes
    ----------
    moving, other : str
        Names of bodies (`cad.checks.clearance.clearance.clearance_bodies`): parts, or the hardware of a group.
    kind : FitKind
    gap_mm : float
        Least gap of the tessellated parts for a running fit; least clearance of the solids for a bearing.
    why : str
        What is paired there.
    """

    moving: str
    other: str
    kind: FitKind
    gap_mm: float
    why: str


BEARING, RUNNING = FitKind.BEARING, FitKind.RUNNING
FITS = (
    Fit(moving="pan_horn", other="pan_servo", kind=BEARING, gap_mm=0.05, why="horn over the pan servo's shaft"),
    Fit(moving="tilt_horn", other="tilt_servo", kind=BEARING, gap_mm=0.05, why="horn over the tilt servo's shaft"),
    Fit(moving="pan_shaft_screw", other="pan_servo", kind=BEARING, gap_mm=0.05, why="screw in its shaft"),
    Fit(moving="tilt_shaft_screw", other="tilt_servo", kind=BEARING, gap_mm=0.05, why="screw in its shaft"),
    Fit(moving="yoke", other="pan_bushing", kind=BEARING, gap_mm=0.05, why="hub in the pan bushing"),
    Fit(moving="tilt hardware", other="pivot_bushing", kind=BEARING, gap_mm=0.05, why="sleeve in the pivot's bushing"),
    Fit(moving="tilt hardware", other="yoke", kind=BEARING, gap_mm=0.2, why="washer before the pivot's boss"),
    Fit(
        moving="mirror_holder", other="pivot_bushing", kind=BEARING, gap_mm=0.2, why="cheek before the pivot's bushing"
    ),
    Fit(moving="yoke", other="gimbal_base", kind=RUNNING, gap_mm=RUNNING_GAP_MM, why="hub over the housing"),
    Fit(moving="pan_horn", other="gimbal_base", kind=RUNNING, gap_mm=RUNNING_GAP_MM, why="horn in the housing"),
    Fit(moving="yoke", other="pan_servo", kind=RUNNING, gap_mm=RUNNING_GAP_MM, why="hub over the servo's case"),
    Fit(
        moving="pan hardware",
        other="pan_servo",
        kind=RUNNING,
        gap_mm=RUNNING_GAP_MM,
        why="screws of the horn over the servo's case",
    ),
    Fit(moving="mirror_holder", other="yoke", kind=RUNNING, gap_mm=RUNNING_GAP_MM, why="cheek beside the arm"),
    Fit(
        moving="mirror_holder",
        other="tilt_servo",
        kind=RUNNING,
        gap_mm=RUNNING_GAP_MM,
        why="cheek over the servo's case",
    ),
    Fit(
        moving="tilt hardware",
        other="tilt_servo",
        kind=RUNNING,
        gap_mm=RUNNING_GAP_MM,
        why="screws of the horn over the servo's case",
    ),
)


def fit_of(moving: str, other: str) -> Fit | None:
    """Declared fit of two parts; None for parts that keep the mount's clearance."""
    for fit in FITS:
        if (moving, other) == (fit.moving, fit.other):
            return fit
    return None
