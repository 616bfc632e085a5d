"""Water: what it absorbs and scatters, and the light that is left at depth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from mirrorgaze.options import JsonOption
from mirrorgaze.output import print_json, print_table

if TYPE_CHECKING:
    from reports.studies.water_properties import WaterProperties

COEFFICIENT_COLUMNS = {
    "wavelength_nm": ("nm", ".0f"),
    "a_per_m": ("a 1/m", ".4f"),
    "b_per_m": ("b 1/m", ".4f"),
    "c_per_m": ("c 1/m", ".4f"),
    "visibility_scale_m": ("1/c m", ".2f"),
    "albedo": ("b/c", ".3f"),
    "molecular_fraction": ("molecular", ".4f"),
    "mean_cosine": ("mean cos", ".4f"),
    "backscattered_fraction": ("back", ".4f"),
    "n_water": ("index", ".5f"),
}
"""Columns of the first table: name among the numbers, heading, format."""


def water(
    of: Annotated[
        str, typer.Argument(metavar="RIG|TYPE", help="Preset name, rig file, Jerlov type (I to 9C), or pure.")
    ],
    source: Annotated[
        str | None,
        typer.Option(
            metavar="SOURCE",
            help="Source of a type's coefficients: williamson-hollins or solonenko-mobley.",
            show_default="the rig's, or williamson-hollins",
        ),
    ] = None,
    sun_elevation_deg: Annotated[
        float, typer.Option(help="Sun elevation above the horizon for the light at depth, in degrees.")
    ] = 60.0,
    json: JsonOption = False,
) -> None:
    """Tabulate absorption, scattering and light at depth.

    Kd, the diffuse attenuation of downwelling light, is solved for at three depths under a flat surface and stands
    beside the tables of two campaigns.

    \b
    Example:
      mirrorgaze water aqua2
      mirrorgaze water III --source solonenko-mobley
    """
    from mirrorgaze.loading import load_water
    from reports.studies.water_properties import MEAN_COSINE_DEPTH_M, water_properties

    found = water_properties(load_water(of, source), sun_elevation_deg=sun_elevation_deg)
    if json:
        print_json(found.as_dict())
        return
    typer.echo(_title(found))
    if found.note:
        typer.echo(found.note)
    if found.has_particles:
        particles = found.particles
        typer.echo(
            f"particles: {particles.phase_function}, mean cosine {particles.mean_cosine:.4f}, "
            f"{particles.backscattered_fraction:.4f} scattered back, "
            f"{particles.scattered_within_1_deg:.3f} within 1 degree"
        )
    typer.echo()
    for names in (COEFFICIENT_COLUMNS, _light_columns()):
        _print_columns(found.columns, names)
    typer.echo(
        f"Kd solved for the sun at {sun_elevation_deg:g} degrees elevation; mean cosines at {MEAN_COSINE_DEPTH_M:g} m."
    )


def _light_columns() -> dict[str, tuple[str, str]]:
    from reports.studies.water_properties import DEPTHS_M

    return {
        "wavelength_nm": ("nm", ".0f"),
        "kd_austin_petzold_per_m": ("Kd A&P 1986", ".4f"),
        "kd_jerlov_per_m": ("Kd Jerlov 1976", ".4f"),
        **{f"kd_{depth:g}_m_per_m": (f"Kd {depth:g} m", ".4f") for depth in DEPTHS_M},
        "mean_cosine_down": ("mean cos down", ".3f"),
        "mean_cosine_up": ("up", ".3f"),
        "irradiance_ratio": ("Eu/Ed", ".4f"),
    }


def _title(found: WaterProperties) -> str:
    from reports.studies.water_properties import is_jerlov_type

    water = found.water
    by = f" by {water.source}" if is_jerlov_type(water) else ""
    return f"{water.label}{by}, {water.salinity_ppt:g} ppt, {water.temperature_celsius:g} degrees Celsius"


def _print_columns(columns: dict[str, list[float]], names: dict[str, tuple[str, str]]) -> None:
    present = [name for name in names if name in columns]
    rows: list[Sequence[str]] = [[names[name][0] for name in present]]
    rows += [
        [format(value, names[name][1]) for name, value in zip(present, row, strict=True)]
        for row in zip(*(columns[name] for name in present), strict=True)
    ]
    print_table(rows)
    typer.echo()
