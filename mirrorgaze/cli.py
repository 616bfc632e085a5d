"""The `mirrorgaze` command.

To add a command: write a function in a module of `mirrorgaze.commands` (its name is the command's, its docstring the
help, with an example), import what is heavy inside it, and add it to `COMMANDS`. It raises on bad input; the
wrapping here turns that into a sentence and an exit status.
"""

from __future__ import annotations

import logging

import typer

from mirrorgaze.commands import (
    angular_speed,
    bag,
    calibrate,
    calibration,
    compare,
    corners,
    coverage,
    design,
    detector_trial,
    dive,
    doctor,
    ensemble,
    gaze,
    loads,
    ports,
    redetect,
    render,
    rig_files,
    search,
    sizing,
    tolerance,
    track,
    water,
)
from mirrorgaze.errors import with_exit_status

COMMANDS = (
    design.design,
    design.export,
    rig_files.rigs,
    rig_files.new,
    rig_files.check,
    rig_files.schema,
    sizing.size,
    render.render,
    compare.compare,
    coverage.coverage,
    gaze.gaze,
    gaze.virtual_camera,
    water.water,
    ports.port,
    corners.corners,
    detector_trial.detector_trial,
    calibrate.calibrate,
    calibration.calibrate_study,
    tolerance.tolerance,
    search.search,
    loads.loads,
    dive.dive,
    ensemble.ensemble,
    redetect.redetect,
    angular_speed.angular_speed,
    bag.bag,
    track.track,
    doctor.doctor,
)
"""Every command, in the order in which `mirrorgaze --help` shows them."""

app = typer.Typer(
    name="mirrorgaze",
    help="Design, check and fly two-mirror gaze systems for the fixed cameras of underwater robots.",
    epilog="Exit status: 0 good, 1 failed, 2 bad input. 'mirrorgaze COMMAND --help' shows an example.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,  # help as plain text: it is instant, and examples keep their lines
    pretty_exceptions_enable=False,
)
for command in COMMANDS:
    app.command()(with_exit_status(command))


def main() -> None:
    """Run the command line; the entry point of the installed `mirrorgaze`."""
    # What takes long and is not a result is logged: people see it on stderr.
    logging.basicConfig(format="%(message)s", level=logging.WARNING)
    logging.getLogger("scenes").setLevel(logging.INFO)
    app()


if __name__ == "__main__":
    main()
