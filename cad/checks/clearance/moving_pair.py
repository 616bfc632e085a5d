"""Two bodies that move against each other: which joints matter, how far each reaches, and the gap at joint values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from cad.checks.clearance.bodies import Body, distances_mm
from cad.checks.clearance.gap_search import Cell, SmallestGap, smallest_gap
from optics.kernels.arrays import FloatArray
from optics.layout import Layout, pan_from_m2
from optics.mesh import Group

PAN_AXIS = np.array([0.0, 0.0, 1.0])
"""In the gimbal and the pan frame; it goes through their origin."""
TILT_AXIS = {Group.PAN: np.array([0.0, 1.0, 0.0]), Group.TILT: np.array([1.0, 0.0, 0.0])}
"""In the pan and the m2 frame; it goes through their common origin."""
ORDER = {Group.FIXED: 0, Group.PAN: 1, Group.TILT: 2}


@dataclass(frozen=True, kw_only=True)
class MovingPair:
    """A body and one that it moves against.

    Attributes
    ----------
    moving : Body
        Further along the chain fixed, pan, tilt than the other.
    other : Body
    layout : Layout
        Frames and joint limits.
    """

    moving: Body
    other: Body
    layout: Layout

    @property
    def joints(self) -> tuple[bool, bool]:
        """Whether pan and tilt move them against each other."""
        return self.other.group is Group.FIXED, self.moving.group is Group.TILT

    def gap_mm(self, q: FloatArray) -> float:
        """Gap at joint values (q1, q2), radians, millimetres."""
        return self.moving.gap_mm(self.other, *self.moving_from_other(float(q[0]), float(q[1])))

    def moving_from_other(self, q1: float, q2: float) -> tuple[FloatArray, FloatArray]:
        """Rotation matrix and translation (millimetres) of the other body in the frame of the moving one.

        It is asked for thousands of times, so the joints' turns are written out.
        """
        pan, tilt = self.joints
        turn, shift = np.eye(3), np.zeros(3)
        if pan:
            gimbal = self._gimbal_from_body
            angle = -self.layout.pan.angle(q1)
            turn = _about_z(angle) @ gimbal[0]
            shift = _about_z(angle) @ gimbal[1]
        if tilt:
            # Positive tilt raises the normal: a turn by the negative angle about y.
            m2_from_pan = self._m2_from_pan @ _about_y(self.layout.tilt.angle(q2))
            turn, shift = m2_from_pan @ turn, m2_from_pan @ shift
        return turn, shift

    @cached_property
    def _gimbal_from_body(self) -> tuple[FloatArray, FloatArray]:
        inverse = self.layout.body_from_gimbal.inv()
        return inverse.rotation.as_matrix(), 1000 * inverse.translation

    @cached_property
    def _m2_from_pan(self) -> FloatArray:
        return np.asarray(pan_from_m2(0.0).inv().rotation.as_matrix())

    def reach_mm(self) -> FloatArray:
        """How far a turn of each joint by one radian moves one body against the other at most, shape (2,), millimetres.

        It is the same whether the one turns or, seen from it, the other: the smaller reach of the two counts.
        """
        pan, tilt = self.joints
        return np.array([self._pan_reach() if pan else 0.0, self._tilt_reach() if tilt else 0.0])

    def pieces(self) -> list[MovingPair]:
        """The pair, with the body that reaches less far from a lone joint's axis in shells around that axis."""
        pan, tilt = self.joints
        if pan and tilt:
            return [self]
        bodies = (self.moving, self.other)
        axes = [self._axis(body, pan=pan) for body in bodies]
        reach, other = (distances_mm(body.vertices_mm, *axis).max() for body, axis in zip(bodies, axes, strict=True))
        if reach <= other:
            return [replace(self, moving=shell) for shell in self.moving.shells(*axes[0])]
        return [replace(self, other=shell) for shell in self.other.shells(*axes[1])]

    def smallest_gap(self, limit_mm: float, wanted_mm: float) -> SmallestGap:
        """Smallest gap over both joint ranges, with its bound; the joint that does not matter stays at its middle."""
        found: list[SmallestGap] = [
            smallest_gap(piece.gap_mm, joint_box(self.layout), piece.reach_mm(), limit_mm, wanted_mm)
            for piece in self.pieces()
        ]
        nearest = min(found, key=lambda gap: gap.gap_mm)
        return SmallestGap(
            gap_mm=nearest.gap_mm,
            bound_mm=min(gap.bound_mm for gap in found),
            q=nearest.q,
            poses=sum(gap.poses for gap in found),
        )

    def _pan_reach(self) -> float:
        fixed = distances_mm(self.other.vertices_mm, *self._axis(self.other, pan=True)).max()
        if self.moving.group is Group.PAN:
            turning = distances_mm(self.moving.vertices_mm, *self._axis(self.moving, pan=True)).max()
        else:
            # Whatever the tilt, a point is no further from the pan axis than from where the axes cross.
            turning = np.linalg.norm(self.moving.vertices_mm, axis=1).max()
        return float(min(fixed, turning))

    def _tilt_reach(self) -> float:
        reach = distances_mm(self.moving.vertices_mm, *self._axis(self.moving, pan=False)).max()
        if self.other.group is Group.PAN:
            reach = min(reach, distances_mm(self.other.vertices_mm, *self._axis(self.other, pan=False)).max())
        return float(reach)

    def _axis(self, body: Body, *, pan: bool) -> tuple[FloatArray, FloatArray]:
        """Point and direction of a joint's axis in a body's frame, millimetres."""
        if not pan:
            return np.zeros(3), TILT_AXIS[body.group]
        if body.group is Group.FIXED:
            gimbal = self.layout.body_from_gimbal
            return 1000 * gimbal.translation, gimbal.rotation.apply(PAN_AXIS)
        return np.zeros(3), PAN_AXIS


def _about_z(angle: float) -> FloatArray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _about_y(angle: float) -> FloatArray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def moving_pairs(bodies: Sequence[Body], layout: Layout) -> list[MovingPair]:
    """Every two bodies of different groups."""
    return [
        MovingPair(moving=moving, other=other, layout=layout)
        for moving, other in product(bodies, repeat=2)
        if ORDER[moving.group] > ORDER[other.group]
    ]


def joint_box(layout: Layout) -> Cell:
    """Both joint ranges, radians."""
    limits = np.radians([[joint.min_deg, joint.max_deg] for joint in (layout.pan, layout.tilt)])
    return Cell.between(limits[:, 0], limits[:, 1])
