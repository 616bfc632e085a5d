"""What a slicer makes of a part: printing time, plastic, supports and its warnings, by PrusaSlicer when it is there."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from cad.assembly.print_pose import print_pose
from cad.finding import Finding, Sense
from optics.kernels.arrays import FloatArray
from optics.kernels.cache import load_or_make, result_key
from optics.kernels.child_programs import ENDS_WITH_US
from optics.mesh import PartMesh
from rigs import Mount, Problem
from rigs.catalogue import MATERIALS

CHECK = "slicer"
PROGRAM = "prusa-slicer"
NO_SLICER = f"not run: no {PROGRAM} on the PATH"
PROFILE: Mapping[str, str] = {
    "layer_height": "0.2",
    "first_layer_height": "0.2",
    "perimeters": "3",
    "top_solid_layers": "5",
    "bottom_solid_layers": "4",
    "fill_density": "30%",
    "fill_pattern": "gyroid",
    "support_material": "1",
    "support_material_auto": "1",
    "support_material_threshold": "40",
    "support_material_buildplate_only": "0",
    "brim_width": "4",
    "filament_diameter": "1.75",
    "gcode_comments": "0",
}
"""Settings that are not the slicer's own; nozzle, bed, density and temperatures come from the rig.

Faces at 45 degrees print without support (`cad.checks.printing.orientation`): M1's cell, on its roof, is at 45 degrees
exactly. The slicer, told 45, supports them."""
FILAMENTS: Mapping[str, Mapping[str, str]] = {
    material: {
        "filament_type": kind,
        "temperature": str(nozzle),
        "first_layer_temperature": str(first_nozzle),
        "bed_temperature": str(bed),
        "first_layer_bed_temperature": str(first_bed),
    }
    for material, (kind, nozzle, first_nozzle, bed, first_bed) in {
        "abs": ("ABS", 255, 255, 110, 100),
        "petg": ("PETG", 240, 230, 90, 85),
        "pla": ("PLA", 210, 215, 60, 60),
        "nylon": ("PA", 265, 265, 110, 105),
    }.items()
}
"""Temperatures in degrees Celsius of the generic ABS, PETG and PLA and Fiberlogy's PA12 of PrusaSlicer's own profiles
(PrusaResearch.ini), as the densities of `rigs.catalogue.MATERIALS`."""
TIMEOUT_S = 300
STATUS_LINE = re.compile(r"^(\d+ => |Slicing result|\[\d{4}-)")
WARNING = "print warning:"

SLICE_VERSION = 1
"""Raised when the slicer's words are read as another `Slice`."""


@dataclass(frozen=True, kw_only=True)
class Slice:
    """What the slicer said.

    Attributes
    ----------
    time_s : float
        Estimated printing time.
    mass_g : float
        Plastic with supports and brim.
    support_layers : int
        How many stretches of support the file has; 0 when it prints without.
    warnings : tuple of str
        In the slicer's words.
    """

    time_s: float
    mass_g: float
    support_layers: int
    warnings: tuple[str, ...]


def slicer_path() -> str | None:
    """Path of the slicer; None when this machine has none."""
    return shutil.which(PROGRAM)


def slice_finding(mesh: PartMesh, mount: Mount) -> Finding:
    """What the slicer makes of a printed part in its print orientation."""
    program = slicer_path()
    if program is None:
        return Finding(check=CHECK, subject=mesh.name, note=NO_SLICER, ran=False)
    pose = print_pose(mesh, mount)
    vertices = pose.bed_from_part.apply(1000 * mesh.vertices_m)
    surface = trimesh.Trimesh(vertices - vertices.min(axis=0), mesh.faces, process=False)
    return judged(mesh.name, slice_stl(program, surface.export(file_type="stl"), mount), vertices)


def judged(name: str, found: Slice, vertices_mm: FloatArray) -> Finding:
    """A slice as a finding: the figure is the number of warnings."""
    supports = f"supports in {found.support_layers} places" if found.support_layers else "no supports"
    height = float(vertices_mm[:, 2].max() - vertices_mm[:, 2].min())
    problem = Problem(
        place=name, value="; ".join(found.warnings), expected=f"a part that {PROGRAM} slices without warnings"
    )
    return Finding(
        check=CHECK,
        subject=name,
        figure=float(len(found.warnings)),
        unit="warnings",
        limit=0.0,
        sense=Sense.AT_MOST,
        place=f"upright {height:.0f} mm",
        note=f"{duration(found.time_s)}, {found.mass_g:.0f} g, {supports}",
        problem=problem if found.warnings else None,
    )


def duration(time_s: float) -> str:
    """Time in hours and minutes."""
    minutes = round(time_s / 60)
    return f"{minutes // 60} h {minutes % 60:02d} min"


def slice_stl(program: str, stl: bytes, mount: Mount) -> Slice:
    """Slice an STL that stands as it is printed; the answer for the same bytes and settings comes from the cache.

    Raises
    ------
    OSError
        When the slicer fails.
    """
    settings = _settings(mount)
    key = result_key("slice", SLICE_VERSION, _version(program), settings, stl)
    return load_or_make("slice", key, lambda: _sliced(program, stl, settings), pack=_packed, unpack=_unpacked)


def read_slice(said: str, gcode: str) -> Slice:
    """Read what the slicer printed and wrote.

    Raises
    ------
    OSError
        When the file does not tell time and plastic.
    """
    time = re.search(r"estimated printing time \(normal mode\) = (.+)", gcode)
    mass = re.search(r"filament used \[g\] = ([\d.]+)", gcode)
    if time is None or mass is None:
        raise OSError(f"expected printing time and plastic at the end of the file that {PROGRAM} wrote, got neither")
    return Slice(
        time_s=_seconds(time[1]),
        mass_g=float(mass[1]),
        support_layers=gcode.count(";TYPE:Support material\n"),
        warnings=_warnings(said),
    )


def _sliced(program: str, stl: bytes, settings: Sequence[str]) -> Slice:
    with tempfile.TemporaryDirectory() as scratch:
        part, code = Path(scratch) / "part.stl", Path(scratch) / "part.gcode"
        part.write_bytes(stl)
        arguments = [*ENDS_WITH_US, program, "--export-gcode", *settings, "--output", str(code), str(part)]
        done = subprocess.run(
            [*ENDS_WITH_US, *arguments], capture_output=True, text=True, timeout=TIMEOUT_S, check=False
        )
        said = done.stdout + done.stderr
        if done.returncode != 0 or not code.exists():
            raise OSError(f"{PROGRAM} gave up: {said.strip().splitlines()[-1] if said.strip() else done.returncode}")
        return read_slice(said, code.read_text(errors="replace"))


def _packed(found: Slice) -> dict[str, NDArray[Any]]:
    numbers = np.array([found.time_s, found.mass_g, found.support_layers])
    return {"numbers": numbers, "warnings": np.array(found.warnings, dtype=str)}


def _unpacked(stored: Mapping[str, NDArray[Any]]) -> Slice:
    time_s, mass_g, layers = stored["numbers"].tolist()
    warnings = tuple(str(warning) for warning in stored["warnings"])
    return Slice(time_s=time_s, mass_g=mass_g, support_layers=int(layers), warnings=warnings)


def profile(mount: Mount) -> dict[str, str]:
    """Settings by the slicer's own keys, with the printer and the material of a mount."""
    length, width, height = mount.printer_bed_mm
    own = {
        "nozzle_diameter": f"{mount.nozzle_mm:g}",
        "filament_density": f"{MATERIALS[mount.material].density_kg_per_m3 / 1000:g}",
        "bed_shape": f"0x0,{length:g}x0,{length:g}x{width:g},0x{width:g}",
        "max_print_height": f"{height:g}",
    }
    return dict(sorted({**PROFILE, **FILAMENTS[mount.material], **own}.items()))


def named_profile(mount: Mount) -> dict[str, str]:
    """Settings with the names under which PrusaSlicer shows them."""
    length, width, height = mount.printer_bed_mm
    printer = mount.printer or f"{length:g} x {width:g} x {height:g} mm bed, {mount.nozzle_mm:g} mm nozzle"
    return {
        **profile(mount),
        "filament_settings_id": f'"{mount.material.upper()}, mirrorgaze"',
        "print_settings_id": "mirrorgaze",
        "printer_settings_id": printer,
    }


def profile_ini(mount: Mount) -> str:
    """Settings as a file that PrusaSlicer loads: `--load FILE`, or Import Config."""
    return "".join(f"{key} = {value}\n" for key, value in named_profile(mount).items())


def _settings(mount: Mount) -> list[str]:
    length, width, _ = mount.printer_bed_mm
    settings = []
    for key, value in {**profile(mount), "center": f"{length / 2:g},{width / 2:g}"}.items():
        option = f"--{key.replace('_', '-')}"
        # The command line takes switches without a value.
        if value == "1" and key.startswith("support"):
            settings.append(option)
        elif value != "0":
            settings += [option, value]
    return settings


def _version(program: str) -> str:
    said = subprocess.run([program, "--help"], capture_output=True, text=True, timeout=TIMEOUT_S, check=False).stdout
    return next((line for line in said.splitlines() if line.startswith("PrusaSlicer")), program)


def _seconds(words: str) -> float:
    units = {"d": 86400, "h": 3600, "m": 60, "s": 1}
    return float(sum(int(number) * units[unit] for number, unit in re.findall(r"(\d+)([dhms])", words)))


def _warnings(said: str) -> tuple[str, ...]:
    """Each warning as one line; it runs on until the next line of progress."""
    warnings: list[list[str]] = []
    within = False
    for line in said.splitlines():
        if line.startswith(WARNING):
            warnings.append([line.removeprefix(WARNING).strip()])
            within = True
        elif STATUS_LINE.match(line):
            within = False
        elif within and line.strip():
            warnings[-1].append(line.strip())
    return tuple(" ".join(words) for words in warnings)
