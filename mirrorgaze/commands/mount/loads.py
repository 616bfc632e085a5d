"""Loads: what the mount weighs in the water, how it trims the vehicle, and whether its servos are strong enough."""

from __future__ import annotations

import typer

from mirrorgaze.options import JsonOption, RigArgument, TablesOption
from mirrorgaze.output import print_json, print_step, print_table


def loads(
    rig: RigArgument,
    output: TablesOption = None,
    json: JsonOption = False,
) -> None:
    """Weigh the mount, trim the vehicle, check the servos.

    Prints the weight of each part in air and water, the ballast that trims the vehicle, and each servo's torque beside
    what it turns against. Exit status 2 when a servo is too weak for its mirror.

    \b
    Example:
      mirrorgaze loads aqua2 -o out/loads
    """
    from cad.loads.study import load_study
    from mirrorgaze.loading import load_usable_rig
    from reports.figures.load import load_lines, load_summary, mass_rows, torque_rows, write_loads
    from rigs import RigError

    print_step("loads ...")
    study = load_study(load_usable_rig(rig))
    files = write_loads(study, output) if output is not None else []
    if json:
        print_json({**load_summary(study), "files": [str(file) for file in files]})
    else:
        print_table(
            [
                ("part", "mass (g)", "volume (cm3)", "in water (N)"),
                *(
                    (row["part"], f"{row['mass_g']:.1f}", f"{row['volume_cm3']:.1f}", f"{row['weight_in_water_n']:.3f}")
                    for row in mass_rows(study)
                ),
            ]
        )
        for line in load_lines(study):
            typer.echo(line)
        print_table(
            [
                ("servo (N m)", "weight", "turning", "flow", "needed", "rated", "margin"),
                *(
                    (
                        row["servo"],
                        *(f"{row[key + '_n_m']:.3f}" for key in ("off_balance_water", "turning", "flow")),
                        *(f"{row[key + '_n_m']:.3f}" for key in ("needed", "rated")),
                        f"{row['margin']:.1f}",
                    )
                    for row in torque_rows(study)
                ),
            ]
        )
        for file in files:
            typer.echo(str(file))
    if study.problems:
        raise RigError(rig, study.problems)
