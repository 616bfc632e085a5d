"""The `mirrorgaze` command.

To add a command: write a function in a module of `mirrorgaze.commands` (its name is the command's, its docstring the
help: a summary that begins with a verb, what is written, an example), import what is heavy inside it, and add it to
`COMMANDS`. It raises on bad input; the wrapping here turns that into a sentence and an exit status.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from typing import Annotated

import typer

from mirrorgaze.commands.calibration import calibrate, calibrate_port, calibrate_study
from mirrorgaze.commands.design import compare_designs, coverage, design, search, share, size, tolerance
from mirrorgaze.commands.dives import (
    angular_speed,
    arena,
    bag,
    corners,
    dive,
    ensemble,
    env,
    evaluate_detector,
    redetect,
    track,
)
from mirrorgaze.commands.images import compare, dataset, render
from mirrorgaze.commands.maintenance import cache, doctor
from mirrorgaze.commands.mount import export, loads, place
from mirrorgaze.commands.optics import export_camera, gaze, port, virtual_camera, water
from mirrorgaze.commands.rig_files import check, presets, schema, show, studio
from mirrorgaze.errors import with_exit_status
from mirrorgaze.help import SectionedCommand, SectionedGroup
from mirrorgaze.option_groups import with_option_groups
from mirrorgaze.waiting import with_clock

COMMANDS: dict[str, tuple[Callable[..., None], ...]] = {
    "Rig files": (presets.rigs, presets.new, check.check, show.show, studio.studio, schema.schema),
    "Design": (
        design.design,
        size.size,
        coverage.coverage,
        tolerance.tolerance,
        search.search,
        compare_designs.compare_designs,
        share.share,
    ),
    "Mount": (place.place, export.export, loads.loads),
    "Optics": (
        gaze.gaze,
        virtual_camera.virtual_camera,
        export_camera.export_camera,
        port.port,
        water.water,
    ),
    "Images": (render.render, compare.compare, dataset.dataset),
    "Dives and tracking": (
        dive.dive,
        ensemble.ensemble,
        arena.arena,
        track.track,
        redetect.redetect,
        evaluate_detector.evaluate_detector,
        angular_speed.angular_speed,
        corners.corners,
        env.env,
        bag.bag,
    ),
    "Calibration": (
        calibrate.calibrate,
        calibrate_port.calibrate_port,
        calibrate_study.calibrate_study,
    ),
    "Maintenance": (doctor.doctor, cache.cache),
}
"""Every command, under the headings and in the order in which `mirrorgaze --help` shows them."""

EXAMPLES = {
    "Rig files": "mirrorgaze new my-auv --hull hull.stl --unit mm",
    "Design": "mirrorgaze design my-auv.toml -o out/my-auv --open",
    "Mount": "mirrorgaze export my-auv.toml -o out/mount",
    "Optics": "mirrorgaze gaze my-auv.toml --q1-deg 30 --q2-deg 10",
    "Images": "mirrorgaze render my-auv.toml --q1-deg 30 -o view.png",
    "Dives and tracking": "mirrorgaze dive spiral -o out/spiral --no-video",
    "Calibration": "mirrorgaze calibrate my-auv.toml points.csv -o built.toml",
    "Maintenance": "mirrorgaze doctor",
}
"""Of each heading, one line to try; shown below its commands."""


class Commands(SectionedGroup):
    """Every command of `mirrorgaze`."""

    examples = EXAMPLES


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        typer.echo(f"mirrorgaze {version('mirrorgaze')}")
        raise typer.Exit


app = typer.Typer(
    name="mirrorgaze",
    cls=Commands,
    help="Design, check and fly two-mirror gaze systems for the fixed cameras of underwater robots.",
    epilog="Exit status: 0 success, 1 failure, 2 bad input. 'mirrorgaze COMMAND --help' shows an example.",
    no_args_is_help=True,
    rich_markup_mode=None,  # help as plain text: it is instant, and examples keep their lines
    pretty_exceptions_enable=False,
)
for heading, commands in COMMANDS.items():
    for command in commands:
        app.command(cls=SectionedCommand, rich_help_panel=heading)(
            with_exit_status(with_clock(with_option_groups(command)))
        )


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_print_version, help="Show the version and exit.")
    ] = False,
) -> None:
    """Take what stands before a command."""


def main() -> None:
    """Run the command line."""
    # Before anybody loads NumPy. Matrices are small here: threads that wait for each other only take processor time.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # What takes long and is not a result is logged: people see it on stderr.
    logging.basicConfig(format="%(message)s", level=logging.WARNING)
    for package in ("optics", "scenes"):
        logging.getLogger(package).setLevel(logging.INFO)
    app()
