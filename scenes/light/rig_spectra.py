"""The spectra that a rig names, of its water and its camera, read before anything is made with them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from rigs import Problem, Rig


def spectrum_problems(rig: Rig) -> list[Problem]:
    """What is wrong with the files of a rig's inherent optical properties and of its camera's response."""
    iop, response = rig.water.iop_file, rig.camera.response_file
    problems = []
    if response is not None:
        problems += _problems("camera.response_file", response, lambda: _bands(rig))
    if iop is not None:
        # At the wavelengths of the camera, or, where those are not known, of the nominal one.
        nominal = rig.camera.model_copy(update={"response_file": None})
        camera = rig if not problems else rig.model_copy(update={"camera": nominal})
        problems += _problems("water.iop_file", iop, lambda: _inherent_optics(camera))
    return problems


def _problems(place: str, file: Path, read: Callable[[], Any]) -> list[Problem]:
    try:
        read()
    except ValueError as error:
        what = str(error).removeprefix(f"{file}: ")
        several = what.partition("\n")[0].endswith(("problem", "problems"))
        expected = f"spectra, got a file with {what}" if several else what.removeprefix("expected ")
        return [Problem(place=place, value=file.name, expected=expected)]
    return []


def _bands(rig: Rig) -> Any:
    # Rigs that name no spectra need no quadrature.
    from scenes.light.spectrum import bands_of_camera  # noqa: PLC0415

    return bands_of_camera(rig.camera)


def _inherent_optics(rig: Rig) -> Any:
    from optics.water.inherent_optics import inherent_optics  # noqa: PLC0415

    return inherent_optics(rig.water, _bands(rig).wavelength_nm)
