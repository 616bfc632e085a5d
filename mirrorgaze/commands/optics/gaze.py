"""Gaze: where the mirrors look for joint values, and which joint values look there."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from mirrorgaze.options import JsonOption, PanOption, RigArgument, TiltOption
from mirrorgaze.output import print_json, print_table


def gaze(
    rig: RigArgument,
    azimuth_deg: Annotated[
        float | None, typer.Option(help="Azimuth to look at, in degrees; 0 is ahead, left is positive.")
    ] = None,
    elevation_deg: Annotated[
        float | None, typer.Option(help="Elevation to look at, in degrees; up is positive.")
    ] = None,
    q1_deg: PanOption = 0.0,
    q2_deg: TiltOption = 0.0,
    json: JsonOption = False,
) -> None:
    """Convert joint angles to a gaze direction, or back.

    Prints the gaze of --q1-deg and --q2-deg. With --azimuth-deg and --elevation-deg it lists all joint angles that look
    there, and picks the ones reached first from --q1-deg and --q2-deg.

    \b
    Example:
      mirrorgaze gaze aqua2 --azimuth-deg 150 --elevation-deg 20
      mirrorgaze gaze aqua2 --q1-deg 30 --q2-deg -10
    """
    from mirrorgaze.loading import load_usable_rig
    from optics.gaze.summary import gaze_at, gaze_towards

    loaded = load_usable_rig(rig)
    if (azimuth_deg is None) != (elevation_deg is None):
        raise ValueError(
            f"expected both --azimuth-deg and --elevation-deg or neither, got {azimuth_deg} and {elevation_deg}"
        )
    if azimuth_deg is None or elevation_deg is None:
        report = gaze_at(loaded, q1_deg=q1_deg, q2_deg=q2_deg)
    else:
        report = gaze_towards(
            loaded, azimuth_deg=azimuth_deg, elevation_deg=elevation_deg, q1_deg=q1_deg, q2_deg=q2_deg
        )
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
