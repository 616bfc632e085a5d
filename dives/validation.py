"""The dive that a design is validated with: the preset `spiral`, at a distance and for a size that fit the rig."""

from __future__ import annotations

import math

import numpy as np

from cad.assembly.meshes import rig_meshes
from dives.dive import Dive
from dives.target_size import least_area_px
from dives.trajectories.motions import Spiral
from optics.mesh import Role, merge
from rigs import Rig
from scenes.stage.targets import Ball

PRESET = "spiral"

OFF_THE_HULL_M = 0.5
"""Of the ball's centre, at its nearest: the robot sways, and the ball has a radius."""


def validation_dive(rig: Rig) -> Dive:
    """The preset `spiral` for a rig.

    The ball starts farther off where the hull is large, and the least area of a blob is that of most of the ball at the
    path's end: who built the target knows its size, and on a reef it is the size that tells it from red corals.

    Raises
    ------
    ValueError
        For a rig without mirrors or servos, or one whose camera does not see the gaze mirror at a level gaze.
    """
    dive = Dive.load(PRESET)
    path, shape = dive.target.path, dive.target.load_shape()
    assert isinstance(path, Spiral) and isinstance(shape, Ball)  # the preset is ours
    path = path.model_copy(update={"start_radius_m": max(path.start_radius_m, _hull_radius_m(rig) + OFF_THE_HULL_M)})
    lasting = dive.duration_s - path.wait_s
    farthest = math.hypot(
        path.start_radius_m + path.receding_m_per_s * lasting, path.start_height_m + path.rising_m_per_s * lasting
    )
    return dive.model_copy(
        update={
            "rig": rig.name,
            "target": dive.target.model_copy(update={"path": path}),
            "detector": dive.detector.model_copy(update={"area_min_px": least_area_px(rig, shape, farthest)}),
        }
    )


def _hull_radius_m(rig: Rig) -> float:
    """Horizontal distance of the hull's farthest point from the body's origin; 0 without a hull."""
    hull = [part for part in rig_meshes(rig) if part.role == Role.HULL]
    return float(np.linalg.norm(merge(hull)[0][:, :2], axis=1).max()) if hull else 0.0
