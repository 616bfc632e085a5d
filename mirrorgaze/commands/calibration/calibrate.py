"""Calibration of a built rig: joint offsets and signs, mirrors, axes and port, from images."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mirrorgaze.options import JsonOption, RigArgument
from mirrorgaze.output import print_json, print_progress, print_step, print_table

if TYPE_CHECKING:
    from rigs import Rig


def calibrate(
    rig: RigArgument,
    observations: Annotated[
        Path | None, typer.Argument(metavar="OBSERVATIONS", help="CSV of a target's points in images.")
    ] = None,
    edges: Annotated[
        Path | None, typer.Option(metavar="CORNERS", help="CSV of the gaze mirror's corners in images.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Write the calibration to this file (TOML).")
    ] = None,
    noise_px: Annotated[float, typer.Option(help="Standard deviation of the image points, in pixels.")] = 0.3,
    backlash_deg: Annotated[
        float, typer.Option(help="Standard deviation of the joint angles from pose to pose, in degrees.")
    ] = 0.0,
    prior: Annotated[
        bool, typer.Option("--prior/--no-prior", help="Use print tolerances of 1 mm and 1 degree as a prior.")
    ] = True,
    simulate: Annotated[
        bool, typer.Option("--simulate", help="Simulate sessions in a tank, and print what they would give.")
    ] = False,
    rigs: Annotated[int, typer.Option(metavar="N", help="Number of rigs to simulate.", min=1)] = 1,
    seed: Annotated[int, typer.Option(metavar="N", help="Random seed of the first simulated rig.", min=0)] = 0,
    json: JsonOption = False,
) -> None:
    """Calibrate a built rig from images.

    Estimates joint offsets and signs, mirrors, axes and port from images of a board, of the gaze mirror's corners, or
    both. OBSERVATIONS has the columns q1_deg, q2_deg (empty: seen past the mirrors), u_px, v_px and body_x_mm,
    body_y_mm, body_z_mm, or board_x_mm, board_y_mm and board where the boards' places are not known.

    \b
    Example:
      mirrorgaze calibrate aqua2 --simulate --rigs 3
      mirrorgaze calibrate my-auv.toml observations.csv --edges corners.csv -o my-auv-calibration.toml
    """
    from mirrorgaze.loading import load_usable_rig

    loaded = load_usable_rig(rig)
    loaded.require_gaze()
    if simulate:
        if observations is not None or edges is not None or output is not None:
            raise ValueError("expected --simulate alone: it makes its own observations and writes no calibration")
        _simulate(loaded, range(seed, seed + rigs), noise_px=noise_px, backlash_deg=backlash_deg, json=json)
        return
    from tracking.calibration.estimate import calibrate as estimate
    from tracking.calibration.summary import calibration_summary

    target, corners = _read(loaded, observations, edges)
    found = estimate(
        loaded,
        target=target,
        edges=corners,
        prior=prior,
        noise_px=noise_px,
        edge_noise_px=noise_px,
        backlash_deg=backlash_deg,
    )
    if output is not None:
        found.calibrated.save(output)
    summary = calibration_summary(found)
    if json:
        print_json({**summary.as_dict(), "file": None if output is None else str(output)})
        return
    typer.echo(summary.signs)
    print_table(summary.table())
    for line in summary.findings():
        typer.echo(line)
    if output is not None:
        typer.echo(str(output))


def _read(rig: Rig, observations: Path | None, edges: Path | None) -> tuple[Any, Any]:
    """Both files, or every problem of both."""
    from tracking.calibration.observation_files import read_observations
    from tracking.calibration.observations import edge_problems
    from tracking.perception.corners.samples import CornerSamples

    if observations is None and edges is None:
        raise ValueError("expected OBSERVATIONS, --edges CORNERS, or --simulate, got none of them")
    problems, target, corners = [], None, None
    try:
        target = None if observations is None else read_observations(observations, rig)
    except ValueError as error:
        problems.append(str(error))
    try:
        corners = None if edges is None else CornerSamples.from_csv(edges)
    except ValueError as error:
        problems.append(str(error))
    if corners is not None:
        problems += [f"{edges}: {problem}" for problem in edge_problems(rig, corners)]
    if problems:
        raise ValueError("\n".join(problems))
    return target, corners


def _simulate(rig: Rig, seeds: range, *, noise_px: float, backlash_deg: float, json: bool) -> None:
    from dives.calibration.session_study import session_study

    print_step("sessions ...")
    study = session_study(
        rig,
        seeds=seeds,
        noise_px=noise_px,
        backlash_deg=backlash_deg,
        progress=partial(print_progress, "calibrate: session"),
    )
    if json:
        from dataclasses import asdict

        print_json({"rig": rig.name, "seeds": list(seeds), **asdict(study)})
        return
    print_table(study.table())
    typer.echo(
        f"rigs built with perturbations of 1 mm and 1 degree: {len(study.before)}. Root mean squares over the joints' "
        "range, median of the rigs;\nimage: of points 3 m away, corners: of the gaze mirror; expected: what the "
        "covariance says of the gaze"
    )
