"""Results as CSV and as the rows of a report's tables."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from optics.analysis import Coverage, Fate
from optics.analysis.sphere import cell_centres
from optics.gaze import forward_gaze
from optics.layout import Layout
from reports.progress import write_text
from rigs import Rig


def write_poses(coverage: Coverage, rig: Rig, path: Path) -> None:
    """One row per pose: joint values, gaze, usable solid angle, and the image's pixels by fate."""
    layout = Layout.from_rig(rig)
    q1_deg, q2_deg = (grid.ravel() for grid in np.meshgrid(coverage.q1_deg, coverage.q2_deg))
    gaze = forward_gaze(layout, np.radians(q1_deg), np.radians(q2_deg))
    header = ["q1_deg", "q2_deg", "azimuth_deg", "elevation_deg", "roll_deg", "usable_solid_angle_sr"]
    gaze_deg = np.degrees(np.stack([gaze.azimuth, gaze.elevation, gaze.roll], axis=1))
    angles = np.concatenate([np.stack([q1_deg, q2_deg], axis=1), gaze_deg], axis=1)
    counts = coverage.pixels.reshape(-1, len(Fate))
    rows = (
        [*(f"{value:.4f}" for value in angle), f"{solid_angle:.6g}", *map(str, count)]
        for angle, solid_angle, count in zip(angles, coverage.solid_angle_sr.ravel(), counts, strict=True)
    )
    _write(path, [*header, *(f"{fate.name.lower()}_cells" for fate in Fate)], rows)


def write_sphere(coverage: Coverage, path: Path) -> None:
    """One row per cell of the equal-area sphere: how many rays of all poses look into it."""
    azimuths, elevations = cell_centres(coverage.sphere.shape[1], coverage.sphere.shape[0])
    rows = (
        [f"{azimuth:.4f}", f"{elevation:.4f}", str(count)]
        for elevation, line in zip(np.degrees(elevations), coverage.sphere, strict=True)
        for azimuth, count in zip(np.degrees(azimuths), line, strict=True)
    )
    _write(path, ["azimuth_deg", "elevation_deg", "rays"], rows)


def rig_facts(rig: Rig) -> list[tuple[str, str]]:
    """Rows of the table that describes a rig."""
    camera, port, water = rig.camera, rig.port, rig.water
    facts = [
        ("Camera", f"{camera.model}, {camera.width_px} × {camera.height_px} px, f = {camera.fx_px:g} px"),
        ("Port", "none" if port.shape == "none" else f"{port.shape}, {port.material}, {port.thickness_mm:g} mm thick"),
        (
            "Water",
            f"Jerlov {water.jerlov_type}, {water.salinity_ppt:g} ppt, {water.temperature_celsius:g} °C",
        ),
    ]
    for name, mirror in (("Fold mirror M1", rig.fold_mirror), ("Gaze mirror M2", rig.gaze_mirror)):
        if mirror is not None:
            size = f"{mirror.width_mm:g} × {mirror.height_mm:g} × {mirror.thickness_mm:g} mm"
            facts.append((name, f"{size}, {mirror.distance_mm:g} mm along the axis"))
    if rig.joints is not None:
        for name, joint in (("Pan q1", rig.joints.pan), ("Tilt q2", rig.joints.tilt)):
            facts.append((name, f"{joint.min_deg:g} to {joint.max_deg:g}°"))
    if rig.servos is not None:
        facts.append(("Servos", f"pan {rig.servos.pan.name}, tilt {rig.servos.tilt.name}"))
    return facts


def _write(path: Path, header: list[str], rows: Iterable[list[str]]) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    write_text(path, text.getvalue())
