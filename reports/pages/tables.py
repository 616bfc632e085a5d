"""Results as CSV and as the rows of a report's tables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from optics.coverage.blind import BlindPatch, blind_causes, cause_name
from optics.coverage.convergence import Refinement
from optics.coverage.coverage import Coverage
from optics.coverage.openings.openings import Opening
from optics.coverage.outcome import Outcome
from optics.coverage.sphere import cell_directions
from optics.gaze.kinematics import forward_gaze
from optics.layout import Layout
from rigs import Rig
from rigs.atomic_files import csv_text, write_text


def write_poses(coverage: Coverage, rig: Rig, path: Path) -> None:
    """One row per pose: joint values, gaze, usable solid angle, and the image's pixels by outcome."""
    layout = Layout.from_rig(rig)
    q1_deg, q2_deg = (grid.ravel() for grid in np.meshgrid(coverage.q1_deg, coverage.q2_deg))
    gaze = forward_gaze(layout, np.radians(q1_deg), np.radians(q2_deg))
    header = ["q1_deg", "q2_deg", "azimuth_deg", "elevation_deg", "roll_deg", "usable_solid_angle_sr"]
    gaze_deg = np.degrees(np.stack([gaze.azimuth, gaze.elevation, gaze.roll], axis=1))
    angles = np.concatenate([np.stack([q1_deg, q2_deg], axis=1), gaze_deg], axis=1)
    counts = coverage.pixels.reshape(-1, len(Outcome))
    rows = (
        [*(f"{value:.4f}" for value in angle), f"{solid_angle:.6g}", *map(str, count)]
        for angle, solid_angle, count in zip(angles, coverage.solid_angle_sr.ravel(), counts, strict=True)
    )
    _write(path, [*header, *(f"{outcome.name.lower()}_cells" for outcome in Outcome)], rows)


def write_sphere(coverage: Coverage, path: Path) -> None:
    """One row per cell of the sphere: how many poses see it, how finely, and what makes it blind."""
    x, y, z = cell_directions(coverage.nside).T
    azimuth, elevation = np.degrees(np.arctan2(y, x)), np.degrees(np.arcsin(z))
    causes = blind_causes(coverage)
    rows = (
        [str(k), f"{azimuth[k]:.4f}", f"{elevation[k]:.4f}", str(poses), f"{resolution:.3f}", cause_name(cause)]
        for k, (poses, resolution, cause) in enumerate(
            zip(coverage.poses_seeing, coverage.pixels_per_degree, causes, strict=True)
        )
    )
    header = ["healpix_ring", "azimuth_deg", "elevation_deg", "poses", "pixels_per_degree", "blind_because_of"]
    _write(path, header, rows)


def write_blind(patches: Sequence[BlindPatch], path: Path) -> None:
    """One row per blind patch, the largest first."""
    header = ["azimuth_deg", "elevation_deg", "radius_deg", "solid_angle_sr", "blind_because_of", "share"]
    rows = (
        [
            *(f"{value:.3f}" for value in (patch.azimuth_deg, patch.elevation_deg, patch.radius_deg)),
            f"{patch.solid_angle_sr:.6f}",
            patch.cause,
            f"{patch.cause_share:.3f}",
        ]
        for patch in patches
    )
    _write(path, header, rows)


def write_openings(openings: Sequence[Opening], patches: Sequence[BlindPatch], path: Path) -> None:
    """One row per blind patch that a change opens, what gains most first."""
    header = [
        "azimuth_deg",
        "elevation_deg",
        "change",
        "before",
        "after",
        "unit",
        "also",
        "gained_sr",
        "share",
        "net_sr",
    ]
    rows = (
        [
            *(f"{value:.3f}" for value in (patches[each.patch].azimuth_deg, patches[each.patch].elevation_deg)),
            each.key,
            f"{each.before:g}",
            f"{each.after:g}",
            each.unit,
            each.also,
            *(f"{value:.6f}" for value in (each.gained_sr, each.share, each.net_sr)),
        ]
        for each in openings
    )
    _write(path, header, rows)


def write_convergence(study: Sequence[Refinement], path: Path) -> None:
    """One row per refinement and quantity: three values, observed order, estimate at a step of zero."""
    header = ["halved", "quantity", "coarse", "middle", "fine", "order", "estimate"]
    rows = (
        [
            refinement.name,
            quantity,
            *(f"{value:.8g}" for value in found.values),
            *("" if value is None else f"{value:.6g}" for value in (found.order, found.estimate)),
        ]
        for refinement in study
        for quantity, found in (
            ("covered_fraction", refinement.covered_fraction),
            ("mean_solid_angle_sr", refinement.mean_solid_angle_sr),
        )
    )
    _write(path, header, rows)


def _write(path: Path, header: list[str], rows: Iterable[list[str]]) -> None:
    write_text(path, csv_text([header, *rows]))
