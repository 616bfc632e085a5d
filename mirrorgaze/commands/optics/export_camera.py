"""The camera as a table of rays, for simulators."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorgaze.options import HeightOption, RigArgument, WidthOption


def export_camera(
    rig: RigArgument,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="FILE", help="Write the table here (.npz, .exr), its reader beside it."),
    ] = Path("camera.npz"),
    width_px: WidthOption = None,
    height_px: HeightOption = None,
) -> None:
    """Write the camera as rays by pixel, for simulators.

    The table has each pixel's ray behind the port with its transmittance, and mirrors and joints as numbers;
    read_camera.py, which needs NumPy alone, reflects the rays for any joint values. Nothing is interpolated. A file
    that ends in .exr has the same as layers, for shaders; read_camera.glsl beside it is one that reflects them.

    \b
    Example:
      mirrorgaze export-camera aqua2 -o out/camera.npz
      mirrorgaze export-camera aqua2 -o out/camera.exr
    """
    from mirrorgaze.loading import load_usable_rig
    from optics.gaze.camera_table import write_camera_table

    for file in write_camera_table(load_usable_rig(rig), output, width_px=width_px, height_px=height_px):
        typer.echo(str(file))
