"""Water: what it absorbs and scatters, and the light that is left at depth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, cast, get_args

import typer

from mirrorgaze.options import JsonOption
from mirrorgaze.output import print_json, print_table

if TYPE_CHECKING:
    from optics.water.inherent_optics import InherentOptics
    from optics.water.radiative_transfer import RadianceField
    from rigs import JerlovType, Water, WaterSource

STEP_NM = 25
DEPTHS_M = (1.0, 5.0, 10.0)
MEAN_COSINE_DEPTH_M = 5.0
NARROW_DEG = 1.0

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
LIGHT_COLUMNS = {
    "wavelength_nm": ("nm", ".0f"),
    "kd_austin_petzold_per_m": ("Kd A&P 1986", ".4f"),
    "kd_jerlov_per_m": ("Kd Jerlov 1976", ".4f"),
    **{f"kd_{depth:g}_m_per_m": (f"Kd {depth:g} m", ".4f") for depth in DEPTHS_M},
    "mean_cosine_down": ("mean cos down", ".3f"),
    "mean_cosine_up": ("up", ".3f"),
    "irradiance_ratio": ("Eu/Ed", ".4f"),
}
"""Columns of the two tables: name among the numbers, heading, format."""


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
    import numpy as np

    from optics.water.inherent_optics import inherent_optics

    chosen = _water(of, source)
    optics = inherent_optics(chosen, np.arange(400.0, 701.0, STEP_NM))
    columns = _coefficients(optics) | _tabulated_attenuation(chosen, optics) | _solved_light(optics, sun_elevation_deg)
    phase = {
        "phase_function": chosen.phase_function,
        "mean_cosine": optics.phase.mean_cosine,
        "backscattered_fraction": optics.phase.backscattered_fraction,
        "scattered_within_1_deg": float(optics.phase.fraction_within(math.radians(NARROW_DEG))),
    }
    note = _gap_note(chosen)
    if json:
        print_json(
            {
                **_description(chosen),
                "sun_elevation_deg": sun_elevation_deg,
                "particles": phase,
                "note": note,
                **columns,
            }
        )
        return
    typer.echo(_title(chosen))
    if note:
        typer.echo(note)
    if (optics.molecular_fraction < 1).any():
        typer.echo(
            f"particles: {phase['phase_function']}, mean cosine {phase['mean_cosine']:.4f}, "
            f"{phase['backscattered_fraction']:.4f} scattered back, "
            f"{phase['scattered_within_1_deg']:.3f} within {NARROW_DEG:g} degree"
        )
    typer.echo()
    for names in (COEFFICIENT_COLUMNS, LIGHT_COLUMNS):
        _print_columns(columns, names)
    typer.echo(
        f"Kd solved for the sun at {sun_elevation_deg:g} degrees elevation; mean cosines at {MEAN_COSINE_DEPTH_M:g} m."
    )


def _water(of: str, source: str | None) -> Water:
    from mirrorgaze.loading import load_usable_rig
    from rigs import JerlovType, Water
    from rigs.water import TYPES_OF_SOURCE, check_type_of_source

    if source is not None and source not in TYPES_OF_SOURCE:
        raise ValueError(f"--source {source}: expected {' or '.join(TYPES_OF_SOURCE)}")
    if of == "pure":
        if source is not None:
            raise ValueError(f"--source {source}: expected with a Jerlov type only, got pure water")
        return Water(source="pure")
    named = cast("WaterSource | None", source)
    if of in get_args(JerlovType):
        check_type_of_source(of, source or "williamson-hollins")
        return Water().of_type(cast("JerlovType", of), named)
    own = load_usable_rig(of).water
    if named is None:
        return own
    if own.iop_file is not None or own.source == "pure":
        raise ValueError(f"--source {source}: expected a rig whose water is a Jerlov type, got {own.label}")
    return own.of_type(own.jerlov_type, named)


def _coefficients(optics: InherentOptics) -> dict[str, list[float]]:
    import numpy as np

    c = optics.beam_attenuation
    return {
        "wavelength_nm": optics.wavelength_nm.tolist(),
        "a_per_m": optics.absorption.tolist(),
        "b_per_m": optics.scattering.tolist(),
        "c_per_m": c.tolist(),
        "visibility_scale_m": np.divide(1.0, c, out=np.full_like(c, np.inf), where=c > 0).tolist(),
        "albedo": optics.albedo.tolist(),
        "molecular_fraction": optics.molecular_fraction.tolist(),
        "mean_cosine": optics.mean_cosine.tolist(),
        "backscattered_fraction": optics.backscattered_fraction.tolist(),
        "n_water": optics.n_water.tolist(),
    }


def _tabulated_attenuation(water: Water, optics: InherentOptics) -> dict[str, list[float]]:
    """Kd of the water's type by the campaigns that tabulate it."""
    from optics.water.water import ATTENUATION_FILES, attenuation_types, tabulated_diffuse_attenuation

    if water.iop_file is not None:
        return {}
    # Austin & Petzold's type I is pure sea water.
    jerlov_type: JerlovType = "I" if water.source == "pure" else water.jerlov_type
    return {
        f"kd_{source.replace('-', '_')}_per_m": tabulated_diffuse_attenuation(
            jerlov_type, optics.wavelength_nm, source
        ).tolist()
        for source in ATTENUATION_FILES
        if jerlov_type in attenuation_types(source)
    }


def _solved_light(optics: InherentOptics, sun_elevation_deg: float) -> dict[str, list[float]]:
    """Kd, mean cosines and Eu/Ed of the radiative-transfer solution."""
    field = _radiance_field(optics, sun_elevation_deg)
    columns = {f"kd_{depth:g}_m_per_m": _at_depth(field, field.diffuse_attenuation, depth) for depth in DEPTHS_M}
    for name, values in (
        ("mean_cosine_down", field.mean_cosine_down),
        ("mean_cosine_up", field.mean_cosine_up),
        ("irradiance_ratio", field.upwelling / field.downwelling),
    ):
        columns[name] = _at_depth(field, values, MEAN_COSINE_DEPTH_M)
    return columns


def _radiance_field(optics: InherentOptics, sun_elevation_deg: float) -> RadianceField:
    """Light under the standard sun and an evenly bright sky."""
    import numpy as np

    from optics.water.radiative_transfer import radiance_field
    from scenes.light.spectrum import sun_irradiance

    if not 0 < sun_elevation_deg <= 90:
        raise ValueError(f"--sun-elevation-deg {sun_elevation_deg:g}: expected above 0 and at most 90")
    sun, sky = sun_irradiance(optics.wavelength_nm)
    return radiance_field(
        optics,
        sun_cosine_air=math.sin(math.radians(sun_elevation_deg)),
        sun_irradiance=sun,
        sky_radiance=lambda cosine: np.repeat(sky[:, np.newaxis] / np.pi, len(cosine), axis=1),
    )


def _at_depth(field: RadianceField, values: Any, depth_m: float) -> list[float]:
    import numpy as np

    return [float(np.interp(depth_m, field.depth_m, row)) for row in values]


def _title(water: Water) -> str:
    by = f" by {water.source}" if water.iop_file is None and water.source != "pure" else ""
    return f"{water.label}{by}, {water.salinity_ppt:g} ppt, {water.temperature_celsius:g} degrees Celsius"


def _description(water: Water) -> dict[str, Any]:
    typed = water.iop_file is None and water.source != "pure"
    return {
        "water": water.label,
        "source": water.source if water.iop_file is None else str(water.iop_file),
        "jerlov_type": water.jerlov_type if typed else None,
        "salinity_ppt": water.salinity_ppt,
        "temperature_celsius": water.temperature_celsius,
    }


def _gap_note(water: Water) -> str | None:
    from optics.water.water import filled_wavelengths_nm

    if water.iop_file is not None:
        return None
    gaps = filled_wavelengths_nm(water.jerlov_type, water.source)
    if len(gaps) == 0:
        return None
    listed = ", ".join(f"{gap:g}" for gap in gaps)
    return f"a at {listed} nm is interpolated between the neighbouring types: the source misprints it"


def _print_columns(columns: dict[str, list[float]], names: dict[str, tuple[str, str]]) -> None:
    present = [name for name in names if name in columns]
    rows: list[Sequence[str]] = [[names[name][0] for name in present]]
    rows += [
        [format(value, names[name][1]) for name, value in zip(present, row, strict=True)]
        for row in zip(*(columns[name] for name in present), strict=True)
    ]
    print_table(rows)
    typer.echo()
