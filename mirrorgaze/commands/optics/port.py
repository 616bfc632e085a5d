"""Ports: what the window between air and water does to the camera."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mirrorgaze.options import JsonOption, RigArgument
from mirrorgaze.output import print_json, print_table

if TYPE_CHECKING:
    from optics.port_analysis.focus import Focus
    from optics.port_analysis.properties import FieldOfView, PortProperties


def port(
    rig: RigArgument,
    distance_mm: Annotated[
        float, typer.Option(help="Distance of an object from the pinhole, in millimetres: where does it appear?")
    ] = 1000.0,
    nearest_focus_mm: Annotated[
        float | None,
        typer.Option(help="Nearest distance at which the lens focuses, from the pinhole, in millimetres."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Show what the port does to the camera.

    Prints focal length, field of view, focus and lateral colour in water.

    \b
    Example:
      mirrorgaze port bluerov2 --nearest-focus-mm 150
    """
    from mirrorgaze.loading import load_usable_rig
    from optics.port_analysis.colour import abbe_number, water_abbe_number
    from optics.port_analysis.properties import port_properties
    from optics.water.materials import PORT_MATERIALS

    loaded = load_usable_rig(rig)
    properties = port_properties(
        loaded,
        object_distance_m=distance_mm / 1000,
        nearest_focus_m=None if nearest_focus_mm is None else nearest_focus_mm / 1000,
    )
    abbe: dict[str, float] = {material: abbe_number(material) for material in PORT_MATERIALS}
    abbe["water"] = water_abbe_number(loaded.water.salinity_ppt, loaded.water.temperature_celsius)
    if json:
        print_json({"rig": loaded.name, **_as_json(properties), "abbe_number": abbe})
        return
    print_table(_lines(properties))
    print_table([("Abbe number", ", ".join(f"{name} {value:.1f}" for name, value in abbe.items()))])


def _as_json(properties: PortProperties) -> dict[str, Any]:
    focus = properties.focus
    return {
        "n_water": properties.n_water,
        "f_water_over_f_air": properties.magnification,
        "f_water_over_f_air_traced": properties.traced_magnification,
        "object_distance_mm": 1000 * properties.object_distance_m,
        "appears_at_mm": 1000 * properties.appears_at_m,
        "infinity_appears_at_mm": 1000 * properties.infinity_appears_at_m,
        "infinity_is_sharp": None if focus is None else focus.infinity_is_sharp,
        "nearest_object_mm": None if focus is None else 1000 * focus.nearest_object_m,
        "field_in_air_deg": _degrees(properties.field_in_air),
        "field_in_water_deg": _degrees(properties.field_in_water),
        "lateral_colour_px": properties.lateral_colour_px,
    }


def _lines(properties: PortProperties) -> list[tuple[str, str]]:
    closed, traced = (_pair(pair) for pair in (properties.magnification, properties.traced_magnification))
    lines = [
        ("f_water / f_air on axis", f"{closed}; traced: {traced}; n_water = {properties.n_water:.5f}"),
        ("infinity appears at", _millimetres(properties.infinity_appears_at_m)),
        (
            f"{_millimetres(properties.object_distance_m)} appears at",
            f"{_millimetres(properties.appears_at_m)} (distances from the pinhole)",
        ),
        ("focus", _focus(properties.focus)),
    ]
    for medium, field in (("air", properties.field_in_air), ("water", properties.field_in_water)):
        angles = _degrees(field)
        lines.append((f"field of view in {medium}", " x ".join(f"{angle:.1f}" for angle in angles.values()) + " deg"))
    lines[-1] = (lines[-1][0], lines[-1][1] + " (horizontal x vertical x diagonal)")
    lines.append(("lateral colour, 656 to 486 nm", f"at most {properties.lateral_colour_px:.2f} px"))
    return lines


def _pair(pair: tuple[float, float]) -> str:
    return " to ".join(dict.fromkeys(f"{value:.5f}" for value in pair))


def _focus(focus: Focus | None) -> str:
    if focus is None:
        return "not computed (give --nearest-focus-mm)"
    if not focus.infinity_is_sharp:
        return "no: all that is in the water appears nearer than the lens can focus"
    return f"yes: sharp from {_millimetres(focus.nearest_object_m)} to infinity"


def _degrees(field: FieldOfView) -> dict[str, float]:
    return {name: math.degrees(getattr(field, name)) for name in ("horizontal", "vertical", "diagonal")}


def _millimetres(metres: float) -> str:
    return "infinity" if math.isinf(metres) else f"{1000 * metres:.1f} mm"
