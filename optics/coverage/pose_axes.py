"""How the moving groups stand in many poses: the only thing that changes from pose to pose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from optics.kernels.arrays import FloatArray, to_columns
from optics.kernels.backend import Array3f32, Array3f64, dr
from optics.layout import Layout
from optics.mesh import Group
from optics.mirror import MirrorPlane

Progress = Callable[[int, int], None]
"""Called with the number of poses done and their total."""


@dataclass(frozen=True, kw_only=True)
class PoseAxes:
    """Rotations of the moving groups in n poses.

    Attributes
    ----------
    turns : dict of arrays, shape (n, 3, 3)
        Columns: axes of each moving group's frame, in the body frame.
    """

    turns: dict[Group, FloatArray]

    @classmethod
    def of(cls, layout: Layout, q1: FloatArray, q2: FloatArray) -> PoseAxes:
        """At joint values, shape (n,), radians."""
        pan, tilt = layout.moving_frames(q1, q2)
        return cls(turns={Group.PAN: pan[:, :3, :3], Group.TILT: tilt[:, :3, :3]})

    def __len__(self) -> int:
        return len(self.turns[Group.TILT])

    def kernel(self, some: slice) -> dict[Group, list[Any]]:
        """Axes of some poses for the kernels: x, y and z of each group."""
        return {
            group: [Array3f64(*to_columns(turn[some, :, k])) for k in range(3)] for group, turn in self.turns.items()
        }


def gaze_mirror_at(parameters: dict[str, Any], poses: dict[Group, Any], pose: Any) -> MirrorPlane:
    """Kernel: M2 of each lane in the body frame: its centre is `gimbal`, where the joint axes cross."""
    x, y, normal = (dr.gather(Array3f64, axis, pose) for axis in poses[Group.TILT])
    return MirrorPlane(point=parameters["gimbal"], x=x, y=y, normal=normal, outline=parameters["m2_outline"])


def axes_at(poses: dict[Group, Any], pose: Any) -> dict[Group, Any]:
    """Kernel: axes of the moving groups of each lane, in the precision in which rays hit triangles."""
    return {group: [Array3f32(dr.gather(Array3f64, axis, pose)) for axis in axes] for group, axes in poses.items()}
