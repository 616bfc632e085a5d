"""Tolerances: the gaze error of a built rig, and what to make better first."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from mirrorgaze.options import JsonOption, RigArgument, SeedOption, TablesOption
from mirrorgaze.output import print_json, print_step, print_table


def tolerance(
    rig: RigArgument,
    samples: Annotated[
        int, typer.Option(metavar="N", help="Number of built rigs to simulate.", min=1, max=1_000_000)
    ] = 10_000,
    seed: SeedOption = 0,
    output: TablesOption = None,
    json: JsonOption = False,
) -> None:
    """Estimate the gaze error of a built rig.

    Simulates rigs that are built with nominal tolerances, in nine poses, as built and with their joint offsets
    calibrated, and ranks the tolerances by what each contributes.

    \b
    Example:
      mirrorgaze tolerance aqua2 --samples 10000 -o out/tolerance
    """
    from mirrorgaze.loading import load_usable_rig
    from optics.tolerance.tolerance import tolerance_study
    from reports.figures.tolerance import percentile_rows, ranking_rows, write_tolerances

    loaded = load_usable_rig(rig)
    loaded.require_gaze()
    print_step("rigs as they are built ...")
    study = tolerance_study(loaded, samples=samples, seed=seed)
    files = write_tolerances(study, output) if output is not None else []
    ranking, percentiles = ranking_rows(study), percentile_rows(study)
    if json:
        summary: dict[str, Any] = {"rig": loaded.name, "samples": samples, "seed": seed}
        print_json({**summary, "ranking": ranking, "percentiles": percentiles, "files": [str(file) for file in files]})
        return
    typer.echo(f"{rig}: {samples} rigs built, {len(study.q_deg)} poses")
    print_table(_error_rows(percentiles))
    typer.echo("share of the mean squared gaze error: to first order, and without the tolerance")
    print_table(
        [
            (
                f"  {row['tolerance']} {row['value']:g}",
                f"{100 * row['gaze_share']:5.1f} %",
                f"{100 * row['gaze_share_frozen']:5.1f} %",
                f"{row['gaze_rms_deg']:.3f} deg",
                f"{row['image_rms_px']:.2f} px",
            )
            for row in ranking
        ]
    )
    for file in files:
        typer.echo(str(file))


def _error_rows(percentiles: list[dict[str, Any]]) -> list[tuple[str, ...]]:
    whole = [row for row in percentiles if row["q1_deg"] is None]
    names = [key.rpartition("_p")[2] for key in whole[0] if key.startswith("gaze_deg_p")]
    rows = [("  percentile", *names)]
    for row in whole:
        rows.append((f"  {row['rig']}, gaze (deg)", *(f"{row[f'gaze_deg_p{name}']:.2f}" for name in names)))
        rows.append((f"  {row['rig']}, image (px)", *(f"{row[f'image_px_p{name}']:.1f}" for name in names)))
    return rows
