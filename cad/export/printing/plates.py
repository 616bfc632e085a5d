"""Print plates: the printed parts as they are printed, arranged on the rig's printer bed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from cad.assembly.print_pose import print_orientation
from cad.checks.printing.slicer import named_profile
from cad.export.printing.three_mf import PlacedMesh, write_3mf
from optics.mesh import PartMesh, merge
from rigs import Mount, Rig

GAP_MM = 8.0
"""Between parts: room for a brim."""
EDGE_MM = 5.0
"""From the edge of the bed, unless a part needs the whole bed."""


@dataclass(frozen=True, kw_only=True)
class Laid:
    """A part's box on a plate: its size and its lower left corner, millimetres from the bed's corner."""

    mesh: PartMesh
    size_mm: tuple[float, float]
    corner_mm: tuple[float, float] = (0.0, 0.0)

    def placed(self) -> PartMesh:
        """The part in the bed's frame: origin at the bed's corner, z up; metres."""
        shift = np.array([*self.corner_mm, 0.0]) / 1000
        return replace(self.mesh, vertices_m=self.mesh.vertices_m + shift)


def print_plates(rig: Rig, meshes: Sequence[PartMesh]) -> list[list[PartMesh]]:
    """Arrange printed parts on as few plates as rows of boxes allow.

    Parameters
    ----------
    rig : Rig
        For the printer's bed.
    meshes : sequence of PartMesh
        Printed parts, each in the frame of its group.

    Returns
    -------
    list of list of PartMesh
        The parts of each plate in the bed's frame (origin at its corner, z up), metres.

    Raises
    ------
    ValueError
        When a part is larger than the bed.
    """
    gaze = rig.require_gaze()
    bed = gaze.mount.printer_bed_mm
    plates = shelves([_upright(mesh, gaze.mount) for mesh in meshes], (bed[0], bed[1]))
    return [[box.placed() for box in plate] for plate in plates]


def shelves(boxes: Sequence[Laid], bed_mm: tuple[float, float]) -> list[list[Laid]]:
    """Lay boxes in rows on beds, deep ones first: a row is as deep as its first box."""
    for box in boxes:
        if box.size_mm[0] > bed_mm[0] or box.size_mm[1] > bed_mm[1]:
            raise ValueError(
                f"mount.printer_bed_mm = {list(bed_mm)} x height: expected room for {box.mesh.name}, "
                f"which takes {box.size_mm[0]:.0f} x {box.size_mm[1]:.0f} mm"
            )
    left = sorted(boxes, key=lambda box: (-box.size_mm[1], box.mesh.name))
    plates: list[list[Laid]] = []
    while left:
        laid, left = _fill_plate(left, bed_mm)
        plates.append(laid)
    return plates


def write_plates(rig: Rig, meshes: Sequence[PartMesh], folder: Path) -> list[Path]:
    """Write `plate_1.3mf` with its print settings, `plate_1.stl`, ... in the bed's frame, millimetres."""
    written = []
    settings = named_profile(rig.require_gaze().mount)
    for number, plate in enumerate(print_plates(rig, meshes), 1):
        placed = [PlacedMesh(mesh=mesh, pose=RigidTransform.identity()) for mesh in plate]
        title = f"{rig.name}, plate {number}"
        written.append(write_3mf(placed, folder / f"plate_{number}.3mf", title=title, settings=settings))
        written.append(folder / f"plate_{number}.stl")
        written[-1].write_bytes(plate_stl(plate))
    return written


def write_upright(rig: Rig, meshes: Sequence[PartMesh], folder: Path) -> list[Path]:
    """Write each printed part as `NAME.stl` as it stands on the bed, its box in the bed's corner, millimetres."""
    written = []
    for mesh in meshes:
        written.append(folder / f"{mesh.name}.stl")
        written[-1].write_bytes(plate_stl([_upright(mesh, rig.require_gaze().mount).mesh]))
    return written


def plate_stl(plate: Sequence[PartMesh]) -> bytes:
    """A plate as a binary STL in the bed's frame, millimetres."""
    vertices_m, faces, _ = merge(plate)
    content: bytes = trimesh.Trimesh(1000 * vertices_m, faces, process=False).export(file_type="stl")
    return content


def _upright(mesh: PartMesh, mount: Mount) -> Laid:
    """Part in its print orientation, its box in the corner of the bed."""
    vertices: NDArray[np.float64] = print_orientation(mesh, mount).apply(mesh.vertices_m)
    vertices = vertices - vertices.min(axis=0)
    width, depth, _ = 1000 * vertices.max(axis=0)
    return Laid(mesh=replace(mesh, vertices_m=vertices), size_mm=(float(width), float(depth)))


def _fill_plate(boxes: Sequence[Laid], bed_mm: tuple[float, float]) -> tuple[list[Laid], list[Laid]]:
    """Rows from the front to the back; what is laid, and what is left for the next plate."""
    laid: list[Laid] = []
    left = list(boxes)
    y = EDGE_MM
    while left:
        room = bed_mm[1] - EDGE_MM - y
        row, x, depth = [], EDGE_MM, 0.0
        for box in left:
            if box.size_mm[1] <= room and x + box.size_mm[0] <= bed_mm[0] - EDGE_MM:
                row.append(replace(box, corner_mm=(x, y)))
                x += box.size_mm[0] + GAP_MM
                depth = max(depth, box.size_mm[1])
        if not row:
            break
        names = {box.mesh.name for box in row}
        left = [box for box in left if box.mesh.name not in names]
        laid += row
        y += depth + GAP_MM
    if not laid:
        # Too large for the edges that are kept free: alone, in the middle.
        first, *left = left
        laid = [replace(first, corner_mm=((bed_mm[0] - first.size_mm[0]) / 2, (bed_mm[1] - first.size_mm[1]) / 2))]
    return laid, left
