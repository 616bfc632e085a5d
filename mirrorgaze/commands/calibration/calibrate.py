"""Calibration of a built rig: joint offsets and signs, mirrors, axes and port, from images."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mirrorgaze.options import JsonOption, RigArgument
from mirrorgaze.output import print_json, print_progress, print_step, print_table

if TYPE_CHECKING:
    from dives.calibration.session_study import SessionStudy
    from dives.calibration.simulation import Remaining
    from rigs import Rig
    from tracking.calibration.summary import CalibrationSummary


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
    _print(summary)
    if output is not None:
        typer.echo(str(output))


def _read(rig: Rig, observations: Path | None, edges: Path | None) -> tuple[Any, Any]:
    """Both files, or every problem of both."""
    from tracking.calibration.observation_files import read_observations
    from tracking.calibration.observations import edge_problems
    from tracking.perception.corner_samples import CornerSamples

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


def _print(found: CalibrationSummary) -> None:
    doubt = "" if found.signs_decided else " (unobservable; as in the rig file)"
    typer.echo(f"signs: pan {found.pan_sign:+d}, tilt {found.tilt_sign:+d}{doubt}")
    rows = [["parameter", "estimate", "std. dev.", "from the images alone", "tolerance", ""]]
    for row in found.perturbations:
        numbers = (row.value, row.standard_deviation, row.standard_deviation_from_data, row.tolerance)
        digits = 5 if row.unit == "" else 3
        rows.append([row.parameter, *(f"{number:.{digits}f}" for number in numbers), row.unit])
    print_table(rows)
    if found.unobservable:
        kept = "keep their prior" if found.prior else "are unknown"
        typer.echo(f"unobservable combinations, which {kept}:")
        for combination in found.unobservable:
            typer.echo(f"  {combination}")
    typer.echo(f"residual: {found.residual_px:.2f} px rms, {found.outliers} outliers, {found.missing} missing")
    if found.residual_width > 1:
        typer.echo(
            f"that is {found.residual_width:.2f} times the noise given; all standard deviations are scaled by it"
        )
    if not found.converged:
        typer.echo("the solver did not converge: these numbers are a start, not a result")
    typer.echo(f"gaze: standard deviation {found.gaze_deviation_deg:.3f} deg over the joints' range")
    typer.echo(
        f"nearest rig file: joints.pan.offset_deg = {found.pan_offset_deg:.3f}, "
        f"joints.tilt.offset_deg = {found.tilt_offset_deg:.3f}"
    )


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
    _print_study(study)


def _print_study(study: SessionStudy) -> None:
    from itertools import groupby

    head = ("session", "poses", "gaze (deg)", "worst rig", "worst pose", "expected", "image (px)", "worst rig")
    rows = [(*head, "corners (px)", "worst rig"), _study_row("nominal rig, before", "-", study.before, "-")]
    for (name, count), group in groupby(study.outcomes, key=lambda each: (each.session.name, each.pose_count)):
        outcomes = list(group)
        expected = f"{median(outcome.gaze_expected_deg for outcome in outcomes):.3f}"
        rows.append(_study_row(name, str(count), [outcome.after for outcome in outcomes], expected))
    print_table(rows)
    typer.echo(
        f"rigs built with perturbations of 1 mm and 1 degree: {len(study.before)}. Root mean squares over the joints' "
        "range, median of the rigs;\nimage: of points 3 m away, corners: of the gaze mirror; expected: what the "
        "covariance says of the gaze"
    )


def _study_row(name: str, poses: str, rigs: Sequence[Remaining], expected: str) -> tuple[str, ...]:
    gaze, image, corners = ([getattr(each, key) for each in rigs] for key in ("gaze_deg", "image_px", "corners_px"))
    worst_pose = f"{max(each.gaze_worst_deg for each in rigs):.3f}"
    of_gaze = (f"{median(gaze):.3f}", f"{max(gaze):.3f}", worst_pose, expected)
    in_pixels = (f"{value:.2f}" for values in (image, corners) for value in (median(values), max(values)))
    return (name, poses, *of_gaze, *in_pixels)
