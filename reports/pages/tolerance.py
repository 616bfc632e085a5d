"""What tolerances make of the gaze, on a report's page."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from reports.pages import content

LISTED = 8
"""Tolerances on the page; those after them add less than a thousandth for every preset."""


@dataclass(frozen=True, kw_only=True)
class RankedTolerance:
    """A tolerance, the gaze error that it causes alone (degrees, RMS) and its share of the mean squared error."""

    name: str
    value: float
    gaze_rms_deg: float
    gaze_share: float


@dataclass(frozen=True, kw_only=True)
class ToleranceResults:
    """How far the gaze of rigs built with nominal tolerances is off, in nine poses.

    Attributes
    ----------
    samples : int
        Rigs that were built.
    built_deg, calibrated_deg : dict
        Gaze error by percentile ("50", "90", "95", "99"): as built, and with both joint offsets calibrated.
    built_rms_deg, calibrated_rms_deg : float
        Gaze error, RMS over rigs and poses.
    ranking : tuple of RankedTolerance
        What contributes most first.
    figure : str
        Named from the report's folder.
    """

    samples: int
    built_deg: dict[str, float]
    calibrated_deg: dict[str, float]
    built_rms_deg: float
    calibrated_rms_deg: float
    ranking: tuple[RankedTolerance, ...]
    figure: str

    @property
    def words(self) -> str:
        """How far the gaze is off, in words without a full stop."""
        return (
            f"gaze {self.calibrated_rms_deg:.2f}° off (RMS) with joint offsets calibrated, "
            f"{self.built_rms_deg:.2f}° as built"
        )


def tolerance_section(found: ToleranceResults, folder: Path) -> content.Section:
    """Section on tolerances, whose figure lies in a report's folder."""
    errors = (("as built", found.built_deg), ("joint offsets calibrated", found.calibrated_deg))
    ranking = [
        [each.name.replace("_", " "), f"{each.value:g}", f"{each.gaze_rms_deg:.3f}", f"{each.gaze_share:.1%}"]
        for each in found.ranking[:LISTED]
    ]
    return content.section(
        "Tolerances",
        content.paragraph(f"{found.samples} rigs built with nominal tolerances: {found.words}."),
        content.table(
            ["Gaze error by percentile (°)", *found.built_deg],
            [[name, *(f"{value:.2f}" for value in by.values())] for name, by in errors],
            numbers=range(1, len(found.built_deg) + 1),
        ),
        content.figure(folder / found.figure, "What matters, and the gaze error of built rigs"),
        content.table(["Tolerance", "", "Alone (°, RMS)", "Of the squared error"], ranking, numbers=[1, 2, 3]),
    )
