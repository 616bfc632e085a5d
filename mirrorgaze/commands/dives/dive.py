"""Rendered dives: the loop closed in simulation."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mirrorgaze.errors import FAILED
from mirrorgaze.options import DiveArgument, JsonOption, LightOption
from mirrorgaze.output import print_json, print_progress, print_step, print_table

if TYPE_CHECKING:
    from dives import Dive


def dive(
    dive_file: DiveArgument,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Write into this folder.", show_default="out/DIVE"),
    ] = None,
    variant: Annotated[
        str | None,
        typer.Option(help="Variant of the loop: default, paper, paper-literal.", show_default="the dive's"),
    ] = None,
    changed: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Give a key of the dive file another value; repeat for more."),
    ] = None,
    frames: Annotated[int | None, typer.Option(metavar="N", help="Stop after this number of frames.", min=1)] = None,
    no_video: Annotated[
        bool, typer.Option("--no-video", help="Write no video; render only what the loop looks at.")
    ] = False,
    plan: Annotated[
        bool, typer.Option("--plan", help="Only say and draw where the target goes and what shows it; render nothing.")
    ] = False,
    check: Annotated[
        bool,
        typer.Option(
            "--check/--no-check",
            help="Move the servos for 3 s before looking; without it, the dive begins where that ends.",
        ),
    ] = True,
    light: LightOption = "full",
    require: Annotated[bool, typer.Option("--require", help="Exit with 1 when the dive fails.")] = False,
    bag: Annotated[bool, typer.Option("--bag", help="Write a ROS 2 bag (MCAP) as well.")] = False,
    json: JsonOption = False,
) -> None:
    """Simulate a dive that tracks a target.

    Renders what the camera sees, runs the tracking loop on it, and compares the loop with ground truth. Writes
    log.parquet (one row per frame, units in its columns), the camera's video, what the loop saw (overlay.mp4), plots
    (errors.png, commands.png, gaze_error.png), metrics.json and dive.toml. The same command continues a dive that was
    stopped. Presets: dark, prediction, spiral, sunlit, wide-hue.

    --plan writes plan.png and plan.json and ends: how long the target is available, what hides it and when, how fast
    it is beside the servos. `mirrorgaze new NAME --dive` writes a dive file to begin with.

    Ends with PASS or FAIL against the [limits] of the dive file, and says what a dive that fails was due to.

    \b
    Example:
      mirrorgaze dive spiral -o out/spiral
      mirrorgaze dive my-dive.toml --plan
      mirrorgaze dive my-dive.toml -o out/mine --variant paper --bag
      mirrorgaze dive spiral -o out/fast --no-video
      mirrorgaze dive spiral -o out/right --set world=blue --set target.start.azimuth_deg=52
    """
    from dives import run_dive
    from dives.dive import loaded_with, varied
    from dives.ensembles.members import parsed_setting
    from dives.files import read_metrics
    from dives.known_target import not_looked_for
    from dives.metrics.headlines import headline_rows
    from dives.metrics.verdict import dive_verdict
    from mirrorgaze.loading import load_usable_rig
    from scenes.baking.light_quality import LightQuality

    loaded = loaded_with(dive_file, dict(map(parsed_setting, changed or ())))
    chosen = varied(loaded, variant=variant, frames=frames, video=not no_video, functional_check=check)
    if bag and chosen.video == "none":
        raise ValueError(
            "--bag: expected a dive with a video, since a bag holds the images; leave --no-video or --bag out"
        )
    load_usable_rig(chosen.rig)
    if told := not_looked_for(chosen):
        print_step(told)
    folder = output or Path("out") / chosen.name
    if plan:
        _plan(chosen, folder, json=json)
        return
    print_step("dive ...")
    run_dive(
        chosen,
        folder,
        quality=LightQuality.named(light),
        log=print_step,
        progress=partial(print_progress, chosen.name),
    )
    print_step("figures ...")
    from reports.figures.dive import write_dive_figures
    from tracking.log import read_log

    write_dive_figures(read_log(folder), folder)
    if bag:
        print_step("bag ...")
        from dives.bags import write_bag

        write_bag(folder, chosen.load_rig(), folder / "bag")
    metrics = read_metrics(folder)
    verdict = dive_verdict(metrics, chosen.limits, chosen.load_rig())
    failed = require and not verdict.passed
    if json:
        print_json({"passed": verdict.passed, "verdict": verdict.line, **metrics, "folder": str(folder)})
        raise typer.Exit(FAILED if failed else 0)
    files = sorted(path.name for path in folder.iterdir() if path.is_file()) + ["bag/"] * bag
    typer.echo(f"{folder}: {', '.join(files)}" + (" (draft, in rough light)" if light == "draft" else ""))
    print_table(headline_rows(metrics))
    typer.echo(verdict.line)
    if failed:
        raise typer.Exit(FAILED)


def _plan(dive: Dive, folder: Path, *, json: bool) -> None:
    from dives.known_target import with_known_target, without_colour
    from dives.metrics.headlines import PLANNED, headline_rows
    from reports.studies.dive_report import write_dive_plan

    print_step("plan ...")
    if told := without_colour(with_known_target(dive, dive.load_rig())):
        print_step(told)
    plan = write_dive_plan(dive, folder)
    numbers = plan.numbers()
    if json:
        print_json({**numbers, "folder": str(folder)})
        return
    typer.echo(f"{folder}: plan.png, plan.json")
    print_table(headline_rows(numbers, PLANNED))
    for gap in plan.gaps:
        typer.echo(f"  {gap.from_s:.2f} to {gap.to_s:.2f} s: {gap.reason}")
