"""A coverage in numbers: what reports, tables and machines read of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optics.coverage.blind import OUT_OF_REACH, BlindPatch, blind_causes, blind_patches, cause_name, rim_fraction
from optics.coverage.coverage import Coverage
from optics.coverage.dwell import Dwell, dwell
from optics.coverage.outcome import BLOCKERS, Outcome
from optics.coverage.uncertainty import cells_standard_error
from optics.status import Region

SHOWN = (Outcome.SEEN, *BLOCKERS, Outcome.BACK_OF_MIRROR)
"""What a region of the image can show."""

REGIONS = (Region.GAZE, Region.FOLD, Region.DIRECT)


@dataclass(frozen=True, kw_only=True)
class UsableSolidAngle:
    """Solid angle seen through both mirrors in one pose, in steradians; over all poses."""

    mean: float
    smallest: float
    largest: float
    largest_at_deg: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Resolution:
    """Pixels per degree of the directions that are seen; zeros where none is."""

    worst: float
    median: float
    best: float


@dataclass(frozen=True, kw_only=True)
class CoverageSummary:
    """Numbers of a coverage; a value by outcome, cause or region stands under its name.

    Attributes
    ----------
    poses : int
    image_cells : tuple of int
        Columns and rows into which the image was divided.
    nside : int
        Of the sphere's cells.
    covered_fraction, upper_fraction, lower_fraction : float
        Share of all directions, and of those of each hemisphere, that some pose sees.
    covered_standard_error : float
        Of the covered fraction, when each cell at the rim is seen, or not, with the same probability.
    rim_fraction : float
        Share of the sphere whose cells lie at the rim of what is seen.
    blind_fraction_by_cause : dict
    usable_solid_angle_sr : UsableSolidAngle
    share_of_image, mean_solid_angle_sr : dict
        By outcome, mean over the poses.
    mean_solid_angle_by_region_sr : dict of dict
        By region of the image, then by what it shows.
    pixels_per_degree : Resolution
    poses_seeing_a_direction : Dwell
    blind_patches : tuple of BlindPatch
        The largest first.
    """

    poses: int
    image_cells: tuple[int, int]
    nside: int
    covered_fraction: float
    covered_standard_error: float
    rim_fraction: float
    upper_fraction: float
    lower_fraction: float
    blind_fraction_by_cause: dict[str, float]
    usable_solid_angle_sr: UsableSolidAngle
    share_of_image: dict[str, float]
    mean_solid_angle_sr: dict[str, float]
    mean_solid_angle_by_region_sr: dict[str, dict[str, float]]
    pixels_per_degree: Resolution
    poses_seeing_a_direction: Dwell
    blind_patches: tuple[BlindPatch, ...]


def coverage_summary(coverage: Coverage, *, image_cells: tuple[int, int]) -> CoverageSummary:
    """Numbers of a coverage whose image was divided into these columns and rows."""
    counts = coverage.pixels.sum(axis=(0, 1))
    lost = coverage.solid_angle_by_outcome_sr.mean(axis=(0, 1))
    shown = coverage.solid_angle_by_region_sr.mean(axis=(0, 1))
    causes, rim = blind_causes(coverage), rim_fraction(coverage)
    return CoverageSummary(
        poses=int(coverage.solid_angle_sr.size),
        image_cells=image_cells,
        nside=coverage.nside,
        covered_fraction=coverage.covered_fraction,
        covered_standard_error=cells_standard_error(coverage),
        rim_fraction=rim,
        upper_fraction=coverage.upper_fraction,
        lower_fraction=coverage.lower_fraction,
        blind_fraction_by_cause={
            cause_name(cause): float((causes == cause).mean()) for cause in (OUT_OF_REACH, *BLOCKERS)
        },
        usable_solid_angle_sr=_usable(coverage),
        share_of_image={name_of(outcome): float(counts[outcome] / counts.sum()) for outcome in Outcome},
        mean_solid_angle_sr={name_of(outcome): float(lost[outcome]) for outcome in Outcome},
        mean_solid_angle_by_region_sr={
            name_of(region): {name_of(outcome): float(shown[region, outcome]) for outcome in SHOWN}
            for region in REGIONS
        },
        pixels_per_degree=_resolution(coverage),
        poses_seeing_a_direction=dwell(coverage),
        blind_patches=tuple(blind_patches(coverage)),
    )


def name_of(kind: Outcome | Region) -> str:
    """Name under which a summary has the value of an outcome or a region."""
    return kind.name.lower()


def _usable(coverage: Coverage) -> UsableSolidAngle:
    j, i = np.unravel_index(coverage.solid_angle_sr.argmax(), coverage.solid_angle_sr.shape)
    return UsableSolidAngle(
        mean=coverage.mean_solid_angle_sr,
        smallest=float(coverage.solid_angle_sr.min()),
        largest=float(coverage.solid_angle_sr.max()),
        largest_at_deg=(float(coverage.q1_deg[i]), float(coverage.q2_deg[j])),
    )


def _resolution(coverage: Coverage) -> Resolution:
    seen = coverage.pixels_per_degree[coverage.covered]
    if not len(seen):
        return Resolution(worst=0.0, median=0.0, best=0.0)
    return Resolution(worst=float(seen.min()), median=float(np.median(seen)), best=float(seen.max()))
