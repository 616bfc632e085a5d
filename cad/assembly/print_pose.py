"""Which way up a part is printed: little to support, not tall, standing firmly, within the printer's volume."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from optics.kernels.arrays import FloatArray
from optics.mesh import PartMesh, double_area_vectors
from rigs import Mount

OVERHANG_DEG = 45.0
"""Faces that lean further out than this from the vertical need support; the usual rule for molten plastic."""
ON_BED_MM = 0.05
"""What is this near to the bed lies on it: a quarter of a layer."""
CANDIDATE_DIRECTIONS = 40
"""Facets of the convex hull that are tried, the largest first: a part stands on a facet of its hull."""
SAME_DIRECTION = 1e-3
"""Normals nearer than this (radians) are one facet: 0.1 mm over a part of 100 mm."""
SMALLEST_BASE_FRACTION = 0.1
"""Of the footprint's hull; a part that touches the bed with less comes loose or needs a raft."""
HEIGHT_COST_MM2 = 200.0
"""A millimetre of height costs the time of this many cubic millimetres of support."""


@dataclass(frozen=True, kw_only=True)
class PrintPose:
    """One way to lay a part on the bed.

    Attributes
    ----------
    bed_from_part : Rotation
        Turns the part so that z is up and the longer side of its footprint runs along the bed's x (or y, when it fits
        only so).
    size_mm : array, shape (3,)
        Extent along the bed's axes.
    overhang_mm2 : float
        Area that leans out by more than 45 degrees and does not lie on the bed.
    support_mm3 : float
        Room between the overhangs and the bed, which support fills.
    base_mm2 : float
        Area that lies on the bed.
    footprint_mm2 : float
        Area of the convex hull of the part seen from above.
    fits : bool
        Whether it is within the printer's volume.
    """

    bed_from_part: Rotation
    size_mm: FloatArray
    overhang_mm2: float
    support_mm3: float
    base_mm2: float
    footprint_mm2: float
    fits: bool

    @property
    def firm(self) -> bool:
        """Whether enough of it lies on the bed."""
        return self.base_mm2 >= SMALLEST_BASE_FRACTION * self.footprint_mm2

    @property
    def cost_mm3(self) -> float:
        """What the choice minimises among poses that fit and stand firmly."""
        return self.support_mm3 + HEIGHT_COST_MM2 * float(self.size_mm[2])


def print_orientation(mesh: PartMesh, mount: Mount) -> Rotation:
    """Rotation of a part from its own frame to the printer's, z up; its lower corner then goes to the bed."""
    return print_pose(mesh, mount).bed_from_part


def print_pose(mesh: PartMesh, mount: Mount) -> PrintPose:
    """Best way to lay a part on the bed.

    Parameters
    ----------
    mesh : PartMesh
        Closed surface, metres.
    mount : Mount
        For the printer's volume.

    Returns
    -------
    PrintPose
        Of the poses on the facets of the convex hull, one that fits and stands firmly with the least support and
        height; when none does, the best of the others.
    """
    vertices = 1000 * mesh.vertices_m
    hull = ConvexHull(vertices)
    # What is outermost decides about footprint, height and fit: the hull's corners are a tenth of the vertices.
    corners = vertices[hull.vertices]
    poses = [_pose(mesh, _laid(corners, down, mount.printer_bed_mm), down) for down in _directions(hull)]
    # Rounded, so that ties are broken by the order of the facets and not by the last bit.
    return min(poses, key=lambda pose: (not pose.fits, not pose.firm, round(pose.cost_mm3, 0)))


def fits_printer(mesh: PartMesh, mount: Mount) -> bool:
    """Whether a part, a closed surface in metres, fits the printer in any of the poses of `print_pose`."""
    hull = ConvexHull(1000 * mesh.vertices_m)
    corners = hull.points[hull.vertices]
    return any(_laid(corners, down, mount.printer_bed_mm).fits for down in _directions(hull))


def _directions(hull: ConvexHull) -> list[FloatArray]:
    """Normals of the largest facets of a convex hull, outwards, and the six axis directions."""
    corners = hull.points[hull.simplices]
    areas = np.linalg.norm(double_area_vectors(corners), axis=1) / 2
    normals = hull.equations[:, :3]
    found: list[FloatArray] = []
    sizes: list[float] = []
    left = np.ones(len(normals), dtype=bool)
    while left.any():
        normal = normals[np.flatnonzero(left)[areas[left].argmax()]]
        same = left & (np.linalg.norm(normals - normal, axis=1) < SAME_DIRECTION)
        found.append(normal)
        sizes.append(float(areas[same].sum()))
        left &= ~same
    largest = np.argsort(-np.round(sizes, 3), kind="stable")[:CANDIDATE_DIRECTIONS]
    axes = [sign * axis for axis in np.eye(3) for sign in (-1.0, 1.0)]
    return axes + [found[position] for position in largest]


@dataclass(frozen=True)
class _Laid:
    """How a part lies on the bed: its turn from its own frame, its extent along the bed, its footprint."""

    bed_from_part: Rotation
    size_mm: FloatArray
    footprint_mm2: float
    fits: bool


def _laid(corners_mm: FloatArray, down: FloatArray, bed_mm: tuple[float, float, float]) -> _Laid:
    upright = Rotation.align_vectors([[0.0, 0.0, -1.0]], [down])[0]
    corners = upright.apply(corners_mm)
    footprint = ConvexHull(corners[:, :2])
    turn, fits = _turned_to_bed(float(np.ptp(corners[:, 2])), corners[footprint.vertices, :2], bed_mm)
    return _Laid(
        bed_from_part=turn * upright,
        size_mm=np.ptp(turn.apply(corners), axis=0),
        footprint_mm2=float(footprint.volume),
        fits=fits,
    )


def _pose(mesh: PartMesh, laid: _Laid, down: FloatArray) -> PrintPose:
    overhang, base, support = overhang_base_support(1000 * mesh.vertices_m, mesh.faces, down)
    return PrintPose(
        bed_from_part=laid.bed_from_part,
        size_mm=laid.size_mm,
        overhang_mm2=overhang,
        support_mm3=support,
        base_mm2=base,
        footprint_mm2=laid.footprint_mm2,
        fits=laid.fits,
    )


def overhang_base_support(
    vertices_mm: FloatArray, faces: NDArray[np.int32], down: FloatArray
) -> tuple[float, float, float]:
    """Area that leans out by more than 45 degrees off the bed, area on the bed, and room under the former.

    `down` is a unit vector; square and cubic millimetres.
    """
    corners = vertices_mm[faces]
    doubled = double_area_vectors(corners)
    areas, flat = np.linalg.norm(doubled, axis=1) / 2, doubled @ down / 2
    # A face that leans out by 45 degrees exactly prints: the sine of the lean, with room for rounding.
    leaning = flat > (np.sin(np.radians(OVERHANG_DEG)) + 1e-6) * areas
    heights = -(vertices_mm @ down)
    height = (heights - heights.min())[faces]
    on_bed = height.max(axis=1) < ON_BED_MM
    hanging = leaning & ~on_bed
    support = float((flat * height.mean(axis=1))[hanging].sum())
    return float(areas[hanging].sum()), float(areas[leaning & on_bed].sum()), support


def _turned_to_bed(height: float, outline: FloatArray, bed_mm: tuple[float, float, float]) -> tuple[Rotation, bool]:
    """Turn about z that lays the smallest rectangle around the footprint along the bed's sides, and whether it fits."""
    edges = np.roll(outline, -1, axis=0) - outline
    angles = np.unique(np.round(np.arctan2(edges[:, 1], edges[:, 0]) % (np.pi / 2), 9))
    cosine, sine = np.cos(angles)[:, np.newaxis], np.sin(angles)[:, np.newaxis]
    x, y = outline.T
    sizes = np.stack([np.ptp(cosine * x + sine * y, axis=1), np.ptp(cosine * y - sine * x, axis=1)], axis=-1)
    order = np.argsort(np.round(sizes.prod(axis=1), 3), kind="stable")
    upright = sizes[:, 0] < sizes[:, 1]
    along = np.where(upright, np.pi / 2, 0.0) - angles
    # Each rectangle with its longer side along the bed's x, then, a quarter turn more, along its y.
    length = np.stack([sizes.max(axis=1), sizes.min(axis=1)], axis=-1)[order].ravel()
    width = np.stack([sizes.min(axis=1), sizes.max(axis=1)], axis=-1)[order].ravel()
    turns = np.stack([along, along + np.pi / 2], axis=-1)[order].ravel()
    fitting = np.flatnonzero((length <= bed_mm[0]) & (width <= bed_mm[1]) & (height <= bed_mm[2]))
    chosen = fitting[0] if len(fitting) else 0
    return Rotation.from_euler("z", turns[chosen]), bool(len(fitting))
