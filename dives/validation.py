"""The dive that a design is validated with: the preset `spiral`, at a distance that fits the rig."""

from __future__ import annotations

import numpy as np

from cad.assembly.meshes import rig_meshes
from dives.dive import Dive
from dives.trajectories.motions import Spiral
from optics.mesh import Role, merge
from rigs import Rig

PRESET = "spiral"

OFF_THE_HULL_M = 0.5
"""Of the ball's centre, at its nearest: the robot sways, and the ball has a radius."""


def validation_dive(rig: Rig) -> Dive:
    """The preset `spiral` for a rig: the ball starts farther off where the hull is large."""
    dive = Dive.load(PRESET)
    path = dive.target.path
    assert isinstance(path, Spiral)  # the preset is ours
    path = path.model_copy(update={"start_radius_m": max(path.start_radius_m, _hull_radius_m(rig) + OFF_THE_HULL_M)})
    return dive.model_copy(update={"rig": rig.name, "target": dive.target.model_copy(update={"path": path})})


def _hull_radius_m(rig: Rig) -> float:
    """Horizontal distance of the hull's farthest point from the body's origin; 0 without a hull."""
    hull = [part for part in rig_meshes(rig) if part.role == Role.HULL]
    return float(np.linalg.norm(merge(hull)[0][:, :2], axis=1).max()) if hull else 0.0
