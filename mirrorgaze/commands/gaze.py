"""Gaze: where the mirrors look for joint values, which joint values look there, and the camera that this makes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mirrorgaze.output import JsonOption, RigArgument, print_json, print_table

if TYPE_CHECKING:
    from optics.mirror_edges import MirrorEdge
    from optics.virtual_pinhole import VirtualPinhole
    from rigs import Rig

EDGES = ("bottom", "right", "top", "left")
"""Of M2, in its own frame, in the order of `optics.mirror_edges`."""


def gaze(
    rig: RigArgument,
    azimuth: Annotated[float | None, typer.Option(help="Wanted, degrees, 0 ahead, left positive.")] = None,
    elevation: Annotated[float | None, typer.Option(help="Wanted, degrees, up positive.")] = None,
    q1: Annotated[float, typer.Option(help="Pan joint, degrees; with a wanted gaze, where it starts.")] = 0.0,
    q2: Annotated[float, typer.Option(help="Tilt joint, degrees; with a wanted gaze, where it starts.")] = 0.0,
    json: JsonOption = False,
) -> None:
    """Say where joint values look, or which joint values look somewhere.

    With --azimuth and --elevation all joint values that look there are listed, and the one reached first from --q1 and
    --q2 (at rest: 0, 0) is chosen; without, the gaze of --q1 and --q2 is printed.

    \b
    Example:
      mirrorgaze gaze aqua2 --azimuth 150 --elevation 20
      mirrorgaze gaze aqua2 --q1 30 --q2 -10
    """
    from mirrorgaze.loading import load_usable_rig
    from optics.gaze_summary import gaze_at, gaze_towards

    loaded = load_usable_rig(rig)
    if (azimuth is None) != (elevation is None):
        raise ValueError(f"expected both --azimuth and --elevation or neither, got {azimuth} and {elevation}")
    if azimuth is None or elevation is None:
        report = gaze_at(loaded, q1_deg=q1, q2_deg=q2)
    else:
        report = gaze_towards(loaded, azimuth_deg=azimuth, elevation_deg=elevation, q1_deg=q1, q2_deg=q2)
    if json:
        print_json({"rig": loaded.name, **report})
        return
    rows = [
        (f"q1 = {row['q1_deg']:.2f}, q2 = {row['q2_deg']:.2f} deg", f"{row['time_s']:.2f} s")
        for row in report.get("solutions", ())
    ]
    if rows:
        typer.echo("all joint values that look there, and the time to get there:")
        print_table(rows)
    print_table(_pose_lines(report))


def virtual_camera(
    rig: RigArgument,
    q1: Annotated[float, typer.Option(help="Pan joint, degrees.")] = 0.0,
    q2: Annotated[float, typer.Option(help="Tilt joint, degrees.")] = 0.0,
    distances: Annotated[
        str, typer.Option(metavar="M,M,...", help="Behind the gaze mirror, where the pinhole is fitted.")
    ] = "0.5,1,2,5,10",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="DIR", help="Folder for the OpenCV and the ROS file.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Fit a pinhole to what the gaze mirror shows, for OpenCV and ROS, and say how good it is.

    \b
    Example:
      mirrorgaze virtual-camera aqua2 --q1 30 --q2 -10 -o out/camera
    """
    import numpy as np

    from mirrorgaze.loading import load_usable_rig
    from optics.camera_files import write_camera_files
    from optics.mirror_edges import mirror_edges
    from optics.virtual_pinhole import fit_virtual_pinhole

    loaded = load_usable_rig(rig)
    pan, tilt = float(np.radians(q1)), float(np.radians(q2))
    virtual = fit_virtual_pinhole(loaded, q1=pan, q2=tilt, distances_m=_numbers(distances))
    edges = mirror_edges(loaded, q1=pan, q2=tilt)
    files = write_camera_files(virtual, f"{loaded.name}_virtual", output) if output is not None else []
    if json:
        print_json(_virtual_as_json(loaded, virtual, edges, files))
        return
    _print_virtual(virtual, edges)
    for file in files:
        typer.echo(str(file))


def _pose_lines(report: dict[str, Any]) -> list[tuple[str, str]]:
    pan_speed, tilt_speed = report["gaze_speed_deg_per_s"]
    lines = [("joints", f"q1 = {report['q1_deg']:.2f}, q2 = {report['q2_deg']:.2f} deg")]
    lines.append(("time to get there", f"{report['time_s']:.2f} s"))
    lines.append(("gaze", f"azimuth {report['azimuth_deg']:.2f}, elevation {report['elevation_deg']:.2f} deg"))
    lines.append(("image roll", f"{report['roll_deg']:.2f} deg"))
    lines.append(("virtual camera", "({:.1f}, {:.1f}, {:.1f}) mm in the body".format(*report["virtual_centre_mm"])))
    lines.append(("fastest gaze", f"{pan_speed:.1f} deg/s by pan, {tilt_speed:.1f} deg/s by tilt"))
    azimuth, elevation = report["jacobian"]
    if azimuth[0] is None:
        lines.append(("Jacobian", "none: azimuth has no meaning here"))
    else:
        text = f"[{azimuth[0]:.4f} {azimuth[1]:.4f}; {elevation[0]:.4f} {elevation[1]:.4f}]"
        lines.append(("Jacobian", f"{text} of (azimuth, elevation) by (q1, q2)"))
    if not report["faces_light"]:
        lines.append(("beware", "the gaze mirror shows its back: nothing is seen there"))
    condition = report["condition"]
    lines.append(("condition", "singular: pan does not turn the gaze" if condition is None else f"{condition:.3g}"))
    return lines


def _numbers(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise ValueError(f"expected --distances as numbers with commas between them, got {text!r}") from None


def _virtual_as_json(
    rig: Rig, virtual: VirtualPinhole, edges: tuple[MirrorEdge, ...], files: list[Path]
) -> dict[str, Any]:
    return {
        "rig": rig.name,
        "camera_matrix": virtual.camera_matrix.tolist(),
        "distortion": list(virtual.camera.distortion),
        "body_from_virtual_camera": virtual.body_from_virtual.as_matrix().tolist(),
        "region_px": list(virtual.region_px),
        "pixel_count": virtual.pixel_count,
        "residuals": [vars(row) for row in virtual.residuals],
        "edge_deviation_px": {
            name: edge.deviation_px if math.isfinite(edge.deviation_px) else None
            for name, edge in zip(EDGES, edges, strict=True)
        },
        "files": [str(file) for file in files],
    }


def _print_virtual(virtual: VirtualPinhole, edges: tuple[MirrorEdge, ...]) -> None:
    camera = virtual.camera
    left, top, right, bottom = virtual.region_px
    print_table(
        [
            ("focal length", f"{camera.fx_px:.3f}, {camera.fy_px:.3f} px"),
            ("principal point", f"{camera.cx_px:.3f}, {camera.cy_px:.3f} px"),
            ("distortion", ", ".join(f"{value:.5f}" for value in camera.distortion)),
            (
                "centre",
                "({:.2f}, {:.2f}, {:.2f}) mm in the body".format(*(1000 * virtual.body_from_virtual.translation)),
            ),
            ("fitted", f"{virtual.pixel_count} pixels in u {left:g} to {right:g}, v {top:g} to {bottom:g}"),
        ]
    )
    typer.echo("off the exact projection, by distance behind the gaze mirror:")
    for row in virtual.residuals:
        u, v = row.worst_px
        typer.echo(
            f"  {row.distance_m:g} m: rms {row.rms_px:.4f} px, at most {row.largest_px:.4f} px at ({u:g}, {v:g})"
        )
    bent = ", ".join(f"{name} {edge.deviation_px:.2f}" for name, edge in zip(EDGES, edges, strict=True))
    typer.echo(f"edges of the gaze mirror off their chords: {bent} px")
