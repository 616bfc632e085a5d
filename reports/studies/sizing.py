"""What is made of a sizing: outlines and the trade-off over the mirrors' distances as files, sizes in the rig file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import tomlkit

from cad.assembly.hull_surface import file_hull_distance
from cad.checks.rig_problems import rig_problems
from optics.mesh import Role
from optics.sizing.sizing import Sizing
from optics.sizing.trade_off import trade_off
from reports.figures.sizing import (
    outlines_as_data,
    outlines_figure,
    save_figure,
    trade_off_figure,
    write_outlines,
    write_trade_off,
)
from reports.progress import Log
from rigs import Rig, RigError, load_document, save_document

DISTANCE_FACTORS = (0.7, 0.85, 1.0, 1.15, 1.3, 1.45, 1.6)
"""Of the rig's own d1 and d2, over which the trade-off is drawn."""


def write_sizing(rig: Rig, sizing: Sizing, folder: Path, *, log: Log) -> None:
    """Write outlines as they are, and the trade-off where there is one, as tables and figures."""
    if folder.exists() and not folder.is_dir():
        raise NotADirectoryError(f"{folder}: expected a folder to write into")
    # The hull's solid takes seconds to import, and sizes alone need none.
    from cad.assembly.meshes import rig_meshes  # noqa: PLC0415

    gaze = rig.require_gaze()
    result = None
    if sizing.m2 is not None:
        log("trade-off over d1 and d2 ...")
        hull = [part for part in rig_meshes(rig) if part.role is Role.HULL]
        d1, d2 = ([f * m.distance_mm for f in DISTANCE_FACTORS] for m in (gaze.fold_mirror, gaze.gaze_mirror))
        result = trade_off(rig, sizing.request, hull, d1_mm=d1, d2_mm=d2, distance=file_hull_distance(rig))
    folder.mkdir(parents=True, exist_ok=True)
    write_outlines(sizing, folder / "outlines.json")
    save_figure(outlines_figure(sizing), folder / "outlines.png")
    if result is not None:
        write_trade_off(result, folder / "trade_off.csv")
        save_figure(trade_off_figure(result, rig), folder / "trade_off.png")


def apply_sizes(sizing: Sizing, file: Path) -> None:
    """Write the sizes into a rig file, comments kept, once the result is known to be a good rig.

    Raises
    ------
    RigError
        When the rig with these mirrors is impossible; nothing is written then.
    """
    assert sizing.rig is not None
    document = load_document(file)
    for name in ("fold_mirror", "gaze_mirror"):
        plate = getattr(sizing.rig.require_gaze(), name)
        for key in ("width_mm", "height_mm"):
            document[name][key] = getattr(plate, key)
    changed = Rig.parse(tomlkit.dumps(document), source=str(file), folder=file.parent)
    problems = rig_problems(changed)
    if problems:
        raise RigError(str(file), problems)
    save_document(document, file)


def sizing_as_dict(sizing: Sizing) -> dict[str, Any]:
    """Plain values, for JSON."""
    window, gaze = sizing.request.window, sizing.request.gaze
    applied = None
    if sizing.rig is not None:
        mirrors = sizing.rig.require_gaze()
        plates = {"M1": mirrors.fold_mirror, "M2": mirrors.gaze_mirror}
        applied = {name: [plate.width_mm, plate.height_mm] for name, plate in plates.items()}
    second = sizing.second_range
    return {
        "window_px": [window.left_px, window.top_px, window.right_px, window.bottom_px],
        **{
            f"{name}_deg": [math.degrees(value) for value in interval]
            for name, interval in zip(gaze.names, (gaze.first, gaze.second), strict=True)
        },
        "met": not sizing.bindings,
        "rectangles_mm": applied,
        "outlines": outlines_as_data(sizing),
        "present_mirrors_pass": sizing.passed_now,
        "bindings": [{"constraint": b.constraint, "message": b.message} for b in sizing.bindings],
        "fits": {
            "window_factor": sizing.window_factor,
            f"{gaze.names[1]}_deg": second and [math.degrees(value) for value in second],
        },
    }
