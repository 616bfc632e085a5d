"""What is made of a sizing: outlines and the trade-off over the mirrors' distances as files, sizes in the rig file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from cad.assembly.hull_surface import file_hull_distance
from cad.checks.rig_problems import rig_problems
from cad.parts.mirror_sides import smallest_side_mm
from optics.camera import camera_from_spec
from optics.mesh import Role
from optics.sizing.drivers import SideDriver, side_drivers
from optics.sizing.gaze_range import GazeRange
from optics.sizing.limits import Request
from optics.sizing.sizing import Sizing, size_mirrors
from optics.sizing.trade_off import trade_off
from optics.sizing.window import fraction_window
from reports.figures.sizing import (
    outlines_as_data,
    outlines_figure,
    save_figure,
    trade_off_figure,
    write_outlines,
    write_trade_off,
)
from reports.pages.sizing import SizedMirror, SizingResults
from reports.progress import Log
from rigs import Rig, RigError, load_document, save_document

USUAL_WINDOW = 0.2
"""Share of the image's sides that is to see every gaze, where nothing else is asked for."""

DISTANCE_FACTORS = (0.7, 0.85, 1.0, 1.15, 1.3, 1.45, 1.6)
"""Of the rig's own d1 and d2, over which the trade-off is drawn."""

CUTTING_MM = 1.5
"""How far a side that a shop cuts may be off."""


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


def usual_request(rig: Rig) -> Request:
    """What `mirrorgaze size` asks for without options."""
    window = fraction_window(camera_from_spec(rig.camera), USUAL_WINDOW)
    return Request(window=window, gaze=GazeRange.about_view(rig.camera))


def sizing_results(rig: Rig, folder: Path) -> tuple[SizingResults, list[Path]]:
    """Sizing of a rig for the usual request, for a report: its figure in the report's folder, and that file."""
    request = usual_request(rig)
    sizing = mountable(size_mirrors(rig, request, file_hull_distance(rig)))
    figure = folder / "sizing" / "outlines.png"
    figure.parent.mkdir(parents=True, exist_ok=True)
    save_figure(outlines_figure(sizing), figure)
    needed = (None, None) if sizing.rig is None else _sizes(sizing.rig)
    mirrors = tuple(
        SizedMirror(name=name, present=present, needed=size)
        for name, present, size in zip(("M1", "M2"), _sizes(rig), needed, strict=True)
    )
    left, right, low, high = (math.degrees(end) for end in (*request.gaze.first, *request.gaze.second))
    width, height = request.window.size_px
    results = SizingResults(
        view=f"a window of {width:.0f} x {height:.0f} px in the middle of the image at every gaze of azimuth {left:g} "
        f"to {right:g}° and elevation {low:g} to {high:g}°",
        passed_fraction=sizing.passed_now,
        mirrors=mirrors,
        drivers=tuple(driver_sentence(driver, request.gaze.names) for driver in side_drivers(rig, request)),
        obstacles=tuple(f"{each.constraint}: {each.message}" for each in sizing.bindings),
        purchase="" if sizing.bindings else purchase(sizing),
        figure=figure.relative_to(folder).as_posix(),
    )
    return results, [figure]


def _sizes(rig: Rig) -> tuple[str, str]:
    gaze = rig.require_gaze()
    return gaze.fold_mirror.size, gaze.gaze_mirror.size


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
        for key in ("width_mm", "height_mm", "outline"):
            if key != "outline" or document[name].get(key, "rectangle") != plate.outline:
                document[name][key] = getattr(plate, key)
    changed = Rig.parse(tomlkit.dumps(document), source=str(file), folder=file.parent)
    problems = rig_problems(changed)
    if problems:
        raise RigError(str(file), problems)
    save_document(document, file)


def mountable(sizing: Sizing) -> Sizing:
    """The sizing with mirrors that are at least as large as their cells need."""
    if sizing.rig is None:
        return sizing
    sides = {}
    for name in ("fold_mirror", "gaze_mirror"):
        plate = getattr(sizing.rig.require_gaze(), name)
        least = smallest_side_mm(plate)
        sides[name] = {key: max(getattr(plate, key), least) for key in ("width_mm", "height_mm")}
    return replace(sizing, rig=sizing.rig.with_gaze(**sides))


def purchase(sizing: Sizing) -> str:
    """What to buy for a sizing (`mountable`), and why; empty where there are no mirrors to buy.

    Front-surface mirrors on float glass are sold cut to size, to +-1.5 mm (First Surface Mirror LLC, "Glass technical
    specifications", firstsurfacemirror.com); stock sizes are few, and a plate larger than it has to be sweeps more and
    drags more. The coating is the rig's, as the bill of materials names it.
    """
    if sizing.rig is None:
        return ""
    gaze = sizing.rig.require_gaze()
    plates = " and ".join(
        f"{name} {plate.size}" for name, plate in (("M1", gaze.fold_mirror), ("M2", gaze.gaze_mirror))
    )
    coating = gaze.mount.mirror_coating.replace("-", " ")
    spare = 1000 * sizing.request.margin_m - CUTTING_MM / 2
    covered = (
        f"the margin of {1000 * sizing.request.margin_m:g} mm a side covers that"
        if spare >= 0
        else f"ask for less than {CUTTING_MM:g} mm, or size with --margin-mm {CUTTING_MM / 2:g}"
    )
    return (
        f"one order, cut to size from front-surface float glass, {coating}: {plates}, "
        f"+0/-{CUTTING_MM:g} mm ({covered}; a plate that is too large does not enter its tray)"
    )


def driver_sentence(driver: SideDriver, names: tuple[str, str]) -> str:
    """What drives a side, in words; `names` are those of the request's two ranges."""
    u, v = driver.pixel
    if driver.gaze is None or driver.q1 is None or driver.q2 is None:
        where = "at every gaze"
    else:
        gaze = ", ".join(f"{name} {math.degrees(value):.0f}" for name, value in zip(names, driver.gaze, strict=True))
        where = f"at {gaze} (q1 = {math.degrees(driver.q1):.1f}, q2 = {math.degrees(driver.q2):.1f}) degrees"
    return f"{driver.mirror} {driver.side} {1000 * driver.length_m:.1f} mm: {where}, by pixel ({u:.0f}, {v:.0f})"


def asked_for(request: Request) -> str:
    """Window and ranges of a request, in words."""
    width, height = request.window.size_px
    gaze = request.gaze
    ranges = (
        f"{name} {math.degrees(low):g} to {math.degrees(high):g}"
        for name, (low, high) in zip(gaze.names, (gaze.first, gaze.second), strict=True)
    )
    return f"a window of {width:.0f} x {height:.0f} px, {', '.join(ranges)} degrees"


def size_rows(sizing: Sizing) -> list[tuple[str, str, str]]:
    """Mirror and outline, sides and area of every outline that would do."""
    rows = []
    for label, outlines in (("M1", sizing.m1), ("M2", sizing.m2)):
        if outlines is None:
            rows.append((f"  {label}", "no finite mirror", ""))
            continue
        for kind in outlines.kinds:
            width, height = 1000 * np.ptp(outlines.corners_m(kind), axis=0)
            area = f"{1e4 * outlines.area_m2(kind):.1f} cm²"
            rows.append((f"  {label} {kind}", f"{width:.1f} x {height:.1f} mm", area))
    return rows


def would_fit(sizing: Sizing) -> str:
    """How much of a request that cannot be met could be, in words."""
    name = sizing.request.gaze.names[1]
    parts = []
    if sizing.window_factor > 0:
        parts.append(f"{sizing.window_factor:.0%} of the window's sides over the whole range")
    if sizing.second_range is not None:
        low, high = map(math.degrees, sizing.second_range)
        parts.append(f"the whole window for {name} {low:.1f} to {high:.1f} degrees")
    return "; or ".join(parts) or "no window over this range, nor this window anywhere in it"


def sizing_as_dict(sizing: Sizing, drivers: Sequence[SideDriver]) -> dict[str, Any]:
    """Plain values, for JSON."""
    window, gaze = sizing.request.window, sizing.request.gaze
    applied = None
    if sizing.rig is not None:
        mirrors = sizing.rig.require_gaze()
        applied = {
            name: {"outline": plate.outline, "width_mm": plate.width_mm, "height_mm": plate.height_mm}
            for name, plate in (("M1", mirrors.fold_mirror), ("M2", mirrors.gaze_mirror))
        }
    second = sizing.second_range
    return {
        "window_px": [window.left_px, window.top_px, window.right_px, window.bottom_px],
        **{
            f"{name}_deg": [math.degrees(value) for value in interval]
            for name, interval in zip(gaze.names, (gaze.first, gaze.second), strict=True)
        },
        "met": not sizing.bindings,
        "drivers": [
            {
                "mirror": driver.mirror,
                "side": driver.side,
                "length_mm": 1000 * driver.length_m,
                "pixel": list(driver.pixel),
                **{
                    f"{name}_deg": math.degrees(value)
                    for name, value in zip(gaze.names, driver.gaze or (), strict=False)
                },
            }
            for driver in drivers
        ],
        "purchase": purchase(sizing),
        "mirrors": applied,
        "outlines": outlines_as_data(sizing),
        "present_mirrors_pass": sizing.passed_now,
        "bindings": [{"constraint": b.constraint, "message": b.message} for b in sizing.bindings],
        "fits": {
            "window_factor": sizing.window_factor,
            f"{gaze.names[1]}_deg": second and [math.degrees(value) for value in second],
        },
    }
