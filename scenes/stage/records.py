"""What kernels know of a state: where everything is, as seen from the body.

The same classes hold arrays on the host, whose first axis are the states of a batch, and Dr.Jit's numbers in a kernel.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.kernels.backend import Array3f32, dr
from optics.mirror_outline import Centred
from scenes.light.sea import SeaState

WORLD, TARGET, SNOW = "world", "target", "snow"
"""Groups of triangles beside those of the rig (`optics.mesh.Group`)."""


def decoy_group(number: int) -> str:
    """Name of the group of a decoy."""
    return f"decoy {number}"


def is_target_or_decoy(group: str) -> bool:
    """Whether a group is a thing that swims: none of the robot, of the world or of the snow."""
    return group == TARGET or group.startswith("decoy ")


@dataclass(frozen=True, kw_only=True)
class Pose:
    """Rotation, shape (..., 3, 3), and translation, shape (..., 3), into a frame."""

    rotation: Any
    translation: Any

    @classmethod
    def of(cls, matrix: FloatArray) -> Pose:
        """Pose of a homogeneous matrix, shape (..., 4, 4)."""
        return cls(rotation=matrix[..., :3, :3], translation=matrix[..., :3, 3])

    def turn(self, direction: Any) -> Any:
        """Kernel: rotate a vector into the frame."""
        return Array3f32(*(dr.dot(Array3f32(*row), direction) for row in self.rotation))

    def turn_back(self, direction: Any) -> Any:
        """Kernel: rotate a vector out of the frame."""
        first, second, third = (Array3f32(*row) for row in self.rotation)
        return first * direction.x + second * direction.y + third * direction.z

    def move(self, point: Any) -> Any:
        """Kernel: carry a point into the frame."""
        return self.turn(point) + Array3f32(*self.translation)


@dataclass(frozen=True, kw_only=True)
class MirrorPlate:
    """A flat mirror: centre, unit vectors along its sides, and its outline in them."""

    centre: Any
    x: Any
    y: Any
    outline: Centred

    @property
    def normal(self) -> Any:
        """Kernel: unit normal of the reflecting side."""
        return dr.cross(Array3f32(*self.x), Array3f32(*self.y))

    def __getitem__(self, number: int) -> MirrorPlate:
        """One of a batch."""
        sides = {name: values[number] for name, values in vars(self.outline).items()}
        return MirrorPlate(
            centre=self.centre[number], x=self.x[number], y=self.y[number], outline=replace(self.outline, **sides)
        )


@dataclass(frozen=True, kw_only=True)
class BallRecord:
    """A spherical target, of radius zero when there is none: body frame; its material and its instance."""

    centre: Any
    radius: Any
    material: Any
    instance: Any


@dataclass(frozen=True, kw_only=True)
class StateRecord:
    """Numbers of a state.

    Attributes
    ----------
    poses : dict of Pose
        From the body frame into that of each group of triangles that is not fixed to it, by the group's name.
    mirrors : dict of MirrorPlate
        Body frame, by the name of their front (`scenes.kernels.tracing.Primitive`).
    towards_sun : shape (..., 3)
        Refracted sun, body frame.
    clearance_m
        Nothing of the world is nearer to the body's origin.
    ball : BallRecord
    sea : SeaState, optional
        None under a flat sea.
    """

    poses: dict[str, Pose]
    mirrors: dict[str, MirrorPlate]
    towards_sun: Any
    clearance_m: Any
    ball: BallRecord
    sea: SeaState | None = None

    @property
    def world(self) -> Pose:
        """Pose of the body in the world: from the body frame into the world's."""
        return self.poses[WORLD]


NO_BALL = BallRecord(centre=np.zeros(3), radius=0.0, material=0.0, instance=0.0)
