"""What a design is judged to be, on the first page: checks, torque, prints, dive and requirements, one line each."""

from __future__ import annotations

from dataclasses import dataclass

from cad.checks.printing.print_estimate import HOURS_WITHIN
from cad.export.printing.prints import Prints
from cad.finding import Verdict as CheckVerdict
from cad.loads.servo_torque import SAFETY_FACTOR
from dives import Verdict
from optics.feasibility.requirements import Judged, Outcome
from reports.pages import content
from reports.pages.mount import MountResults
from reports.pages.tolerance import ToleranceResults


@dataclass(frozen=True, kw_only=True)
class Standing:
    """What a design was judged by, beside the mount's own checks.

    Attributes
    ----------
    date : str
        Of the newest of what is judged, a day (ISO 8601).
    revision : str, optional
        As the rig file states it.
    rig_digest : str
        First digits of the rig's hash, as drawings and manifest have it.
    version : str
        Of mirrorgaze.
    dive : Verdict, optional
        None for a design without a dive.
    gaze_error_limit_deg : float, optional
        RMS, as the rig requires it.
    requirements : tuple of Judged
        Of the rig file.
    """

    date: str
    revision: str | None
    rig_digest: str
    version: str
    dive: Verdict | None
    gaze_error_limit_deg: float | None
    requirements: tuple[Judged, ...]

    @property
    def marks(self) -> tuple[str, ...]:
        """What distinguishes this report from another of the same rig: revision, digest and version."""
        revision = "revision not stated" if self.revision is None else f"revision {self.revision}"
        return revision, f"rig {self.rig_digest}", f"mirrorgaze {self.version}"

    @property
    def marked(self) -> str:
        """Marks and date as a sentence without its full stop."""
        words = f"{', '.join(self.marks)}, {self.date}"
        return f"{words[0].upper()}{words[1:]}"


Row = tuple[Outcome, str, str]
"""Outcome, what was judged, and in which words."""


def standing_section(
    standing: Standing, mount: MountResults | None, tolerance: ToleranceResults | None
) -> content.Section:
    """The first section of a design's page: the verdict, then what it stands on."""
    rows = standing_rows(standing, mount, tolerance)
    return content.section(f"Verdict: {overall(rows)}", content.judgements(rows))


def standing_rows(standing: Standing, mount: MountResults | None, tolerance: ToleranceResults | None) -> list[Row]:
    """One row for each thing that a design is judged by."""
    dive = standing.dive
    return [
        *_mount_rows(mount),
        _tolerance_row(standing.gaze_error_limit_deg, tolerance),
        (Outcome.OPEN, "dive", "not made: mirrorgaze design")
        if dive is None
        else (Outcome.PASS if dive.passed else Outcome.FAIL, "dive", "; ".join(dive.sentences)),
        *((each.outcome, each.name, f"{each.achieved}; required: {each.required}") for each in standing.requirements),
    ]


def overall(rows: list[Row]) -> str:
    """Verdict on the whole: failed by one failure, passed only when everything was judged."""
    outcomes = [outcome for outcome, _, _ in rows]
    failed, unjudged = (outcomes.count(outcome) for outcome in (Outcome.FAIL, Outcome.OPEN))
    if failed:
        return f"fail ({failed} of {len(rows)})"
    return f"pass, as far as it was judged ({unjudged} of {len(rows)} were not)" if unjudged else "pass"


def _tolerance_row(limit_deg: float | None, found: ToleranceResults | None) -> Row:
    if found is None:
        return (Outcome.OPEN, "tolerance", "not made: mirrorgaze design")
    if limit_deg is None:
        return (Outcome.OPEN, "tolerance", f"{found.words}; the rig has no requirements.gaze_error_deg")
    outcome = Outcome.PASS if found.calibrated_rms_deg <= limit_deg else Outcome.FAIL
    return (outcome, "tolerance", f"{found.words}; at most {limit_deg:g}° calibrated required")


def _prints_row(prints: Prints) -> Row:
    """Judged by the slicer alone: an estimate of hours says nothing of whether a part prints."""
    plates = f"{len(prints.plates)} plate{'s' if len(prints.plates) > 1 else ''}"
    words = f"{plates}, {prints.time_s / 3600:.1f} h, {prints.plastic_g:.0f} g with supports"
    if not prints.sliced:
        return (Outcome.OPEN, "prints", f"{words}, by an estimate that is within {HOURS_WITHIN:.0%}; no slicer here")
    warnings = [warning for plate in prints.plates for warning in plate.warnings]
    if warnings:
        return (Outcome.FAIL, "prints", f"{words}; the slicer warns: {'; '.join(warnings)}")
    return (Outcome.PASS, "prints", f"{words}; the slicer has no warnings")


def _mount_rows(mount: MountResults | None) -> list[Row]:
    """Checks, torque and prints; a mount that fails either is not exported, so what is there has passed."""
    if mount is None:
        return [(Outcome.OPEN, "mount", "not made: mirrorgaze design")]
    verdicts = [finding["verdict"] for finding in mount.checks]
    failed, passed = verdicts.count(CheckVerdict.FAILED), verdicts.count(CheckVerdict.PASSED)
    margins = [(servo["margin"], servo["servo"]) for servo in mount.loads["servos"]]
    margin, weakest = min(margins)
    return [
        (
            Outcome.FAIL if failed else Outcome.PASS,
            "mount",
            f"{passed} figures within their limits in {len(mount.check_rows)} checks, {failed} beyond",
        ),
        (
            Outcome.PASS if margin >= SAFETY_FACTOR else Outcome.FAIL,
            "torque",
            f"the {weakest} servo has {margin:.1f} times what it needs, at least {SAFETY_FACTOR:g} required",
        ),
        _prints_row(mount.prints),
    ]
