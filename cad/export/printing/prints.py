"""What is printed: for each part its plate, hours, plastic and which way up; for each plate what the slicer says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cad.assembly.print_pose import print_pose
from cad.checks.printing.print_estimate import estimated_slice
from cad.checks.printing.slicer import slice_stl, slicer_path
from cad.export.printing.plates import plate_stl, print_plates
from optics.mesh import PartMesh
from rigs import Rig


@dataclass(frozen=True, kw_only=True)
class PartPrint:
    """One printed part.

    Attributes
    ----------
    name : str
    plate : int
        Counted from 1.
    time_s, plastic_g : float
        Its share of the plate's, supports included.
    size_mm : tuple of float
        As it stands on the bed.
    turn_deg : tuple of float
        Rotation vector from its own frame to the bed's, degrees.
    """

    name: str
    plate: int
    time_s: float
    plastic_g: float
    size_mm: tuple[float, float, float]
    turn_deg: tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class PlatePrint:
    """One plate: its parts, hours, plastic with supports, and the slicer's warnings."""

    parts: tuple[str, ...]
    time_s: float
    plastic_g: float
    warnings: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Prints:
    """All that is printed; `sliced` says whether a slicer was asked or the times are estimates."""

    sliced: bool
    parts: tuple[PartPrint, ...]
    plates: tuple[PlatePrint, ...]

    @property
    def time_s(self) -> float:
        """Time of all plates."""
        return sum(plate.time_s for plate in self.plates)

    @property
    def plastic_g(self) -> float:
        """Plastic of all plates, supports included."""
        return sum(plate.plastic_g for plate in self.plates)


def prints(rig: Rig, meshes: Sequence[PartMesh], *, slicing: bool = True) -> Prints:
    """What is printed of a rig.

    Parameters
    ----------
    rig : Rig
        With a mount.
    meshes : sequence of PartMesh
        Printed parts.
    slicing : bool
        Whether the plates are sliced where there is a slicer: seconds each the first time. A plate's time and plastic
        are then shared among its parts as their estimates are, which are all there is without a slicer.
    """
    mount, program = rig.require_gaze().mount, slicer_path() if slicing else None
    poses = {mesh.name: print_pose(mesh, mount) for mesh in meshes}
    estimates = {mesh.name: estimated_slice(mesh, poses[mesh.name], mount) for mesh in meshes}
    parts, plates = [], []
    for number, plate in enumerate(print_plates(rig, meshes), 1):
        names = tuple(mesh.name for mesh in plate)
        estimated = [estimates[name] for name in names]
        time_s, plastic_g = (sum(getattr(each, key) for each in estimated) for key in ("time_s", "mass_g"))
        found = None if program is None else slice_stl(program, plate_stl(plate), mount)
        slower, heavier = (1.0, 1.0) if found is None else (found.time_s / time_s, found.mass_g / plastic_g)
        plates.append(
            PlatePrint(
                parts=names,
                time_s=slower * time_s,
                plastic_g=heavier * plastic_g,
                warnings=() if found is None else found.warnings,
            )
        )
        for name, each in zip(names, estimated, strict=True):
            x, y, z = poses[name].size_mm.tolist()
            # Adding zero turns the -0 of rounding into 0.
            turn = np.round(poses[name].bed_from_part.as_rotvec(degrees=True), 1) + 0.0
            parts.append(
                PartPrint(
                    name=name,
                    plate=number,
                    time_s=slower * each.time_s,
                    plastic_g=heavier * each.mass_g,
                    size_mm=(x, y, z),
                    turn_deg=(float(turn[0]), float(turn[1]), float(turn[2])),
                )
            )
    return Prints(sliced=program is not None, parts=tuple(parts), plates=tuple(plates))
