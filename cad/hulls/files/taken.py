"""What a hull's file is taken for: its unit, its axes and where it lies, each with the reason, and the rig's table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import cast

import numpy as np
from scipy.spatial.transform import Rotation

from cad.hulls.files.axes import HullAxes, axis_problems, choose_axes
from cad.hulls.files.found import EXPORT_AGAIN, FoundCamera, FoundHull
from cad.hulls.files.openings import Openings, openings
from cad.hulls.files.units import MILLIMETRES, check_size, length_text, plausible_units
from optics.kernels.arrays import FloatArray
from rigs import FileHull, Unit
from rigs.files import FIXED_UNIT_SUFFIXES

USUAL_MM = (200.0, 4000.0)
"""Most vehicles; among units that make a plausible one, mm or m that makes a usual one is taken."""
USUAL_UNITS = ("mm", "m")
DIGITS_MM = 3
CAMERA_DIGITS = 1
"""Of a camera's millimetres and degrees."""


@dataclass(frozen=True, kw_only=True)
class TakenHull:
    """A hull's file and what it is taken for.

    Attributes
    ----------
    found : FoundHull
        What it holds.
    unit : str or None
        Unit of its numbers; None when the file says that itself.
    unit_because : str
        The reason.
    axes : HullAxes
        Forward and up, with the reasons.
    """

    found: FoundHull
    unit: Unit | None
    unit_because: str
    axes: HullAxes

    @property
    def unit_mm(self) -> float:
        """Millimetres in one of the file's numbers."""
        return MILLIMETRES[self.unit] if self.unit is not None else float(self.found.unit_mm or 1.0)

    @property
    def size_mm(self) -> FloatArray:
        """Length, width and height in the body's axes, shape (3,)."""
        return np.asarray(np.abs(self.axes.body_from_file @ self.found.size)) * self.unit_mm

    @property
    def position_mm(self) -> tuple[float, float, float]:
        """Where the file's origin lies in the body: the middle of a mesh, a robot's base link, is the body's origin."""
        if self.found.has_frame:
            return (0.0, 0.0, 0.0)
        middle = self.axes.body_from_file @ self.found.box.mean(axis=0) * self.unit_mm
        x, y, z = (float(value) for value in np.round(-middle, DIGITS_MM) + 0.0)
        return x, y, z

    def pinhole_mm(self, camera: FoundCamera) -> tuple[float, float, float]:
        """Where a camera of the file is in the body."""
        place = self.axes.body_from_file @ camera.position_mm + self.position_mm
        x, y, z = (np.round(place, CAMERA_DIGITS) + 0.0).tolist()
        return x, y, z

    def view_deg(self, camera: FoundCamera) -> tuple[float, float, float]:
        """Yaw to the left, pitch up and roll clockwise of a camera of the file in the body, degrees."""
        look, top = self.axes.body_from_file @ camera.look, self.axes.body_from_file @ camera.top
        level = float(np.hypot(look[0], look[1]))
        # Straight up or down there is no yaw: all of the turn is roll.
        yaw = float(np.arctan2(look[1], look[0])) if level > 1e-6 else 0.0
        upright = np.array([-look[2] * np.cos(yaw), -look[2] * np.sin(yaw), level])
        roll = np.arctan2(top @ np.cross(look, upright), top @ upright)
        angles = np.degrees([yaw, np.arctan2(look[2], level), roll])
        first, second, third = (np.round(angles, CAMERA_DIGITS) + 0.0).tolist()
        return first, second, third

    def section(self, file: Path | None = None) -> FileHull:
        """The rig's table `hull`, with the file as the rig shall name it."""
        yaw, pitch, roll = turn_deg(self.axes.body_from_file)
        return FileHull(
            shape="file",
            file=file or self.found.file,
            unit=self.unit,
            position_mm=self.position_mm,
            yaw_deg=yaw,
            pitch_deg=pitch,
            roll_deg=roll,
        )

    def describe(self) -> str:
        """What was found and what it is taken for, in lines."""
        return "\n".join([f"{self.found.file.name}: {found_text(self.found)}", *self._lines()])

    def _lines(self) -> Iterator[str]:
        found, axes, sides = self.found, self.axes, " x ".join(f"{side:.0f}" for side in self.size_mm)
        yield f"  unit: {self.unit_because}"
        yield f"  forward is {axes.forward}: {axes.forward_because}"
        yield f"  up is {axes.up}: {axes.up_because}"
        origin = "the base link's" if found.has_frame else "in the middle of it"
        yield f"  length x width x height {sides} mm, the body's origin {origin}"
        yield f"  surface: {openings_text(openings(found), self.unit_mm)}"
        if found.mass_kg is not None:
            yield f"  mass: {found.mass_kg:.4g} kg in all links"
        for camera in found.cameras:
            x, y, z = self.pinhole_mm(camera)
            yield f"  camera {camera.name} at {x:.0f}, {y:.0f}, {z:.0f} mm, {view_text(self.view_deg(camera))}"


def take_hull(
    found: FoundHull, *, unit: str | None = None, forward: str | None = None, up: str | None = None
) -> TakenHull:
    """Decide what a hull's file is taken for; what is given counts.

    Raises
    ------
    ValueError
        When the unit is not said and the size leaves doubt, what comes out is no vehicle by its size, or what is given
        does not go together; the message names the file and what to say.
    """
    try:
        problems = option_problems(found.file, unit=unit, forward=forward, up=up)
        if problems:
            raise ValueError("; ".join(problems))
        if np.sort(found.size)[1] <= 0:
            raise ValueError(f"expected a surface, got triangles on a line; {EXPORT_AGAIN}")
        chosen, because = _choose_unit(found, unit)
        taken = TakenHull(
            found=found, unit=chosen, unit_because=because, axes=choose_axes(found, forward=forward, up=up)
        )
        _check_size(taken)
    except ValueError as error:
        raise ValueError(f"{found.file}: {error}") from None
    return taken


def option_problems(file: Path, *, unit: str | None, forward: str | None, up: str | None) -> list[str]:
    """What is wrong with what is said about a hull's file, each in a sentence; the file is not opened."""
    wrong = []
    if unit is not None and unit not in MILLIMETRES:
        wrong.append(f"--unit {unit}: expected {', '.join(MILLIMETRES)}")
    elif unit is not None and file.suffix.lower() in FIXED_UNIT_SUFFIXES:
        wrong.append(f"--unit {unit}: expected none; a {file.suffix} file says what its numbers mean")
    return wrong + axis_problems(forward, up)


def found_text(found: FoundHull) -> str:
    """Bodies and triangles of what was found."""
    count, names = len(found.bodies), list(dict.fromkeys(body.name for body in found.bodies if body.name))
    named = f" ({', '.join(names[:4])}{', ...' if len(names) > 4 else ''})" if names and count > 1 else ""
    return f"{count} bod{'y' if count == 1 else 'ies'}{named}, {len(found.faces):,} triangles"


def sizes_text(found: FoundHull) -> str:
    """The longest side in each unit, of what does not say what its numbers mean."""
    longest = float(found.size.max())
    return f"longest side {_number(longest)}: {_in_units(longest, list(MILLIMETRES))}"


def openings_text(found: Openings, unit_mm: float) -> str:
    """Pieces and holes of a surface in words."""
    said = [f"{found.pieces} piece{'' if found.pieces == 1 else 's'}"]
    if found.holes:
        length = length_text(found.open_length * unit_mm)
        said.append(f"{found.holes} hole{'' if found.holes == 1 else 's'} with {length} of open edge")
    if found.crowded_edges:
        said.append(f"{found.crowded_edges} edges with more than two triangles")
    return ", ".join([*said, "closed"] if found.closed else said)


def view_text(angles_deg: tuple[float, float, float]) -> str:
    """Where a camera looks in words, by its yaw, pitch and roll in the body."""
    turned = [f"{name} {angle:g}" for name, angle in zip(("yaw", "pitch", "roll"), angles_deg, strict=True) if angle]
    return f"{', '.join(turned)} degrees" if turned else "looking ahead"


def turn_deg(body_from_file: FloatArray) -> tuple[float, float, float]:
    """Yaw, pitch and roll of a rotation that takes axes to axes, degrees, as the rig's table has them."""
    for roll, pitch, yaw in product((0.0, 90.0, 180.0, -90.0), (0.0, 90.0, -90.0), (0.0, 90.0, 180.0, -90.0)):
        turn = Rotation.from_euler("ZYX", [yaw, -pitch, roll], degrees=True).as_matrix()
        if np.allclose(turn, body_from_file, atol=1e-9):
            return yaw, pitch, roll
    raise ValueError(f"expected a rotation that takes axes to axes, got {body_from_file.tolist()}")


def _check_size(taken: TakenHull) -> None:
    """Refuse what is no vehicle by its size; of a file that may say its unit wrong, with the units that make it one."""
    try:
        check_size(taken.size_mm, taken.unit)
    except ValueError as error:
        longest = float(taken.found.size.max())
        better = plausible_units(longest)
        if taken.unit is not None or not better or taken.found.file.suffix.lower() in FIXED_UNIT_SUFFIXES:
            raise
        would = _in_units(longest, better)
        raise ValueError(f"{error}; if that is wrong, say --unit {' or '.join(better)}: {would}") from None


def _choose_unit(found: FoundHull, unit: str | None) -> tuple[Unit | None, str]:
    if unit is not None:
        return cast("Unit", unit), f"{unit}, as given"
    if found.unit_mm is not None:
        known = {millimetres: name for name, millimetres in MILLIMETRES.items()}
        return None, f"{known.get(found.unit_mm, f'{found.unit_mm:g} mm')}, as the format has it or the file says"
    longest = float(found.size.max())
    better = plausible_units(longest)
    if len(better) == 1:
        return better[0], f"{better[0]}, the only one that makes it a vehicle; {sizes_text(found)}"
    usual = [name for name in better if USUAL_MM[0] <= longest * MILLIMETRES[name] <= USUAL_MM[1]]
    if len(usual) == 1 and usual[0] in USUAL_UNITS:
        return usual[0], f"{usual[0]}, which makes it of a usual size; --unit overrules; {sizes_text(found)}"
    if not better:
        raise ValueError(f"expected a vehicle of 100 mm to 20 m, got {sizes_text(found)}; scale it, or say --unit")
    raise ValueError(
        f"expected --unit {' or '.join(better)}: the file does not say what its numbers mean, and its longest side "
        f"{_number(longest)} would be {_in_units(longest, better)}"
    )


def _number(value: float) -> str:
    """Three digits, and of thousands all that stand before the point."""
    return f"{value:.0f}" if 1000 <= value < 1e6 else f"{value:.3g}"


def _in_units(longest: float, units: list[Unit]) -> str:
    words = [f"{length_text(longest * MILLIMETRES[name])} with {name}" for name in units]
    return " or ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
