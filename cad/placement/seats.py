"""Seats: places on a hull where a flange finds surface under the whole of it, smooth enough, and the normal there."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import trimesh
from scipy.spatial.transform import RigidTransform, Rotation

from cad.hulls.anchors import Anchor
from cad.parts.contact import surface_contact, surface_heights
from cad.parts.flange import FLANGE_LENGTH_MM, FLANGE_WIDTH_MM
from cad.placement.hull_field import HullField
from optics.kernels.arrays import FloatArray

STATION_MM = 12.0
"""Seats are tried this far apart."""
HEADROOM_MM = 45.0
"""Free water over a seat: flange, screws' heads and a key."""
NO_HULL = "hull under the whole flange"
FIT_STEPS = 7
"""Heights along each side of the footprint by which the normal is found."""
NEAR_MM = 60.0
"""Half the side of the piece of hull that is looked at for a seat."""


@dataclass(kw_only=True)
class SeatFinder:
    """Looks for seats on a hull and remembers what it found.

    Attributes
    ----------
    solid : Trimesh
        Closed hull, millimetres.
    space : HullField
        The same, as distances.
    pinned : mapping of int to Anchor
        The only seat on a side, up (1) or down (-1), where the user has chosen it.
    lean_deg : float
        Between z of the frame and the body's: the slope that level decks of the robot have here.
    """

    solid: trimesh.Trimesh
    space: HullField
    pinned: Mapping[int, Anchor] = field(default_factory=dict)
    lean_deg: float = 0.0
    found: dict[tuple[float, float, float, int], Anchor | str] = field(default_factory=dict)
    refused: list[tuple[tuple[float, float, float], float, str]] = field(default_factory=list)

    def places(self, y_mm: float, side: int, low_x_mm: float, high_x_mm: float) -> list[FloatArray]:
        """Points near the surface where it faces up (side = 1) or down (-1) with headroom, along a line of one y."""
        if side in self.pinned:
            return [np.array(self.pinned[side].point_mm)]
        row, levels = self.space.index(1, y_mm), self.space.axis(2)
        first, last = (self.space.index(0, x) for x in (low_x_mm, high_x_mm))
        stride = max(1, round(STATION_MM / self.space.step_mm))
        room = max(1, round(HEADROOM_MM / self.space.step_mm))
        points = []
        for column in range(last, first - 1, -stride):
            filled = self.space.inside[column, row]
            edges = np.flatnonzero(filled[:-1] & ~filled[1:] if side > 0 else filled[1:] & ~filled[:-1])
            for edge in edges:
                beyond = filled[edge + 1 : edge + 1 + room] if side > 0 else filled[max(edge + 1 - room, 0) : edge + 1]
                if not beyond.any():
                    x = float(self.space.axis(0)[column])
                    points.append(np.array([x, y_mm, float(levels[edge] + self.space.step_mm / 2)]))
        return points

    def seat(self, point_mm: FloatArray, side: int, steepest_deg: float) -> Anchor | str:
        """Anchor and normal of a flange above or below a point near the surface, or why none holds there."""
        if side in self.pinned:
            return self.pinned[side]
        x, y, z = (float(value) for value in point_mm)
        key = (x, y, z, side)
        if key not in self.found:
            self.found[key] = self._seat(point_mm, side, steepest_deg)
        seat = self.found[key]
        return seat if isinstance(seat, str) else self._refusal(seat) or seat

    def refuse(self, point_mm: tuple[float, float, float], why: str, within_mm: float = 0.0) -> None:
        """Give out no more the seat at a point, and those within a distance of it, for a reason; pinned ones stay."""
        self.refused.append((point_mm, within_mm, why))

    def _refusal(self, seat: Anchor) -> str:
        reasons = (why for point, within, why in self.refused if math.dist(point, seat.point_mm) <= within)
        return next(reasons, "")

    def _seat(self, near_mm: FloatArray, side: int, steepest_deg: float) -> Anchor | str:
        piece, upright = self._piece(near_mm), np.array([0.0, 0.0, float(side)])
        height = surface_heights(_moved(piece, _pose(near_mm, upright)), np.zeros((1, 2)))[0]
        if not np.isfinite(height):
            return NO_HULL
        point = np.round(near_mm + height * upright, 1)
        # The normal of a plane through the heights, then that of one through the heights along this normal.
        normal = upright
        for _ in range(2):
            pose = _pose(point, normal)
            tilt = _plane_normal(_moved(piece, pose))
            if tilt is None:
                return NO_HULL
            normal = pose.rotation.apply(tilt)
        if np.degrees(np.arccos(np.clip(side * normal[2], -1, 1))) > steepest_deg:
            return f"a hull within {steepest_deg:g} degrees of level"
        normal = np.round(normal, 4)
        try:
            surface_contact(_moved(piece, _pose(point, normal)), FLANGE_LENGTH_MM, FLANGE_WIDTH_MM, "seat")
        except ValueError as error:
            return NO_HULL if "none under" in str(error) else "a smooth hull under the flange"
        (x, y, z), (nx, ny, nz) = point.tolist(), normal.tolist()
        return Anchor(point_mm=(x, y, z), normal=(nx, ny, nz))

    @cached_property
    def _corners_mm(self) -> FloatArray:
        """Corners of each triangle, in the order of their lowest x, shape (m, 3, 3)."""
        corners = np.asarray(self.solid.triangles)
        return np.asarray(corners[np.argsort(corners[:, :, 0].min(axis=1))])

    @cached_property
    def _limits_mm(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest coordinates of each triangle."""
        return self._corners_mm.min(axis=1), self._corners_mm.max(axis=1)

    def _piece(self, point_mm: FloatArray) -> trimesh.Trimesh:
        """Triangles within `NEAR_MM` of a point along each axis; of large hulls that is a small part."""
        low, high = self._limits_mm
        last = np.searchsorted(low[:, 0], point_mm[0] + NEAR_MM, side="right")
        near = ((low[:last] <= point_mm + NEAR_MM) & (high[:last] >= point_mm - NEAR_MM)).all(axis=1)
        corners = self._corners_mm[:last][near].reshape(-1, 3)
        return trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)


def flange_points_mm(seat: Anchor) -> FloatArray:
    """Points of the plane under a flange, in the frame that the seat is given in, shape (n, 3)."""
    sides = [np.linspace(-size / 2, size / 2, FIT_STEPS) for size in (FLANGE_LENGTH_MM, FLANGE_WIDTH_MM)]
    points = np.stack(np.meshgrid(*sides, [0.0]), axis=-1).reshape(-1, 3)
    return np.asarray(1000 * _pose(np.array(seat.point_mm), np.array(seat.normal)).apply(points / 1000))


def _plane_normal(local: trimesh.Trimesh) -> FloatArray | None:
    """Normal of a plane through the heights under a flange; None where some are missing."""
    sides = [np.linspace(-size / 2, size / 2, FIT_STEPS) for size in (FLANGE_LENGTH_MM, FLANGE_WIDTH_MM)]
    x, y = (values.ravel() for values in np.meshgrid(*sides, indexing="ij"))
    heights = surface_heights(local, np.column_stack([x, y]))
    if not np.isfinite(heights).all():
        return None
    slope_x, slope_y, _ = np.linalg.lstsq(np.column_stack([x, y, np.ones_like(x)]), heights, rcond=None)[0]
    normal = np.array([-slope_x, -slope_y, 1.0])
    return np.asarray(normal / np.linalg.norm(normal))


def _pose(point_mm: FloatArray, normal: FloatArray) -> RigidTransform:
    """Frame of a seat: z along the normal, x as far forward as that lets it."""
    z = normal / np.linalg.norm(normal)
    x = np.array([1.0, 0.0, 0.0]) - z[0] * z
    x /= np.linalg.norm(x)
    axes = np.column_stack([x, np.cross(z, x), z])
    return RigidTransform.from_components(point_mm / 1000, Rotation.from_matrix(axes))


def _moved(piece: trimesh.Trimesh, pose: RigidTransform) -> trimesh.Trimesh:
    vertices = 1000 * pose.inv().apply(np.asarray(piece.vertices) / 1000)
    return trimesh.Trimesh(vertices, piece.faces, process=False)
