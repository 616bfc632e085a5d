"""The virtual camera: the pinhole that comes closest to what the gaze mirror shows."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mirrorgaze.options import JsonOption, PanOption, RigArgument, TiltOption
from mirrorgaze.output import print_json, print_table

if TYPE_CHECKING:
    from optics.gaze.mirror_edges import MirrorEdge
    from optics.gaze.virtual_pinhole import VirtualPinhole
    from rigs import Rig


def virtual_camera(
    rig: RigArgument,
    q1_deg: PanOption = 0.0,
    q2_deg: TiltOption = 0.0,
    distances_m: Annotated[
        str,
        typer.Option(
            metavar="M,M,...", help="Fit at these distances behind the gaze mirror, in metres, separated by commas."
        ),
    ] = "0.5,1,2,5,10",
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Write calibration files for OpenCV and ROS here."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Fit a pinhole camera to the view over the mirrors.

    Prints its intrinsics and pose, and its residuals against the exact projection.

    \b
    Example:
      mirrorgaze virtual-camera aqua2 --q1-deg 30 --q2-deg -10 -o out/camera
    """
    import numpy as np

    from mirrorgaze.loading import load_usable_rig
    from optics.gaze.camera_files import write_camera_files
    from optics.gaze.mirror_edges import mirror_edges
    from optics.gaze.virtual_pinhole import fit_virtual_pinhole

    loaded = load_usable_rig(rig)
    pan, tilt = float(np.radians(q1_deg)), float(np.radians(q2_deg))
    virtual = fit_virtual_pinhole(loaded, q1=pan, q2=tilt, distances_m=_numbers(distances_m))
    edges = mirror_edges(loaded, q1=pan, q2=tilt)
    files = write_camera_files(virtual, f"{loaded.name}_virtual", output) if output is not None else []
    if json:
        print_json(_virtual_as_json(loaded, virtual, edges, files))
        return
    _print_virtual(virtual, edges)
    for file in files:
        typer.echo(str(file))


def _numbers(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise ValueError(f"expected --distances-m as numbers separated by commas, got {text!r}") from None


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
            edge.name: edge.deviation_px if math.isfinite(edge.deviation_px) else None for edge in edges
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
    typer.echo("residuals against the exact projection, by distance behind the gaze mirror:")
    for row in virtual.residuals:
        u, v = row.worst_px
        typer.echo(
            f"  {row.distance_m:g} m: rms {row.rms_px:.4f} px, at most {row.largest_px:.4f} px at ({u:g}, {v:g})"
        )
    if len(edges) > 1:
        bent = ", ".join(f"{edge.name} {edge.deviation_px:.2f}" for edge in edges)
        typer.echo(f"edges of the gaze mirror off their chords: {bent} px")
