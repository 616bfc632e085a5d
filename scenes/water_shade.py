"""What the robot keeps from the water around it: its shadow in the light that is scattered into a line of sight.

Open water shines by light from everywhere. Near the robot some of that light is kept by hull and mount, which send less
of their own. The difference is scattered once: from points along lines of sight the robot is looked at, and what it
shows there instead of open water, and instead of the sun, is scattered into the view,

    D(w, r) = int_0^r exp(-c s) b int p(w, w') (L(w') - F(w')) dw' ds.

Found once, for the robot as it hangs with its joints at zero, from three places: port, fold mirror and gaze mirror. It
is kept as a share of the radiance of open water, by direction in the body frame and length.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from scenes.ambient import cached
from scenes.group_mesh import GroupMesh
from scenes.light import Light
from scenes.packing import halves_of
from scenes.robot_light import RobotLight
from scenes.veil import AZIMUTHS, ELEVATIONS, PIECES, ROW, lengths_m, node_directions

FloatArray = NDArray[np.float64]

FARTHEST_M = 10.0
"""Beyond, the robot fills too little of the view to matter."""

POINTS = 2
"""On a line of sight from one node to the next."""


def water_shade(robot: GroupMesh, world_from_body: RigidTransform, eyes_m: FloatArray, light: Light) -> Any:
    """Share of open water's radiance that the robot keeps, a row for each piece of the lines of `scenes.veil`.

    Parameters
    ----------
    robot : GroupMesh
        All parts in the world frame, lit (`scenes.ambient`).
    world_from_body : RigidTransform
        Where it hangs.
    eyes_m : array, shape (e, 3)
        Where lines of sight begin, body frame.
    light : Light
    """
    places = (world_from_body.as_matrix(), eyes_m)
    shares = cached(
        robot,
        light,
        "shadow of the robot in the water",
        lambda: _shares(robot, world_from_body, eyes_m, light),
        places=places,
    )
    return halves_of(shares[..., :-1, :], shares[..., 1:, :], ROW)


def _shares(robot: GroupMesh, world_from_body: RigidTransform, eyes_m: FloatArray, light: Light) -> FloatArray:
    """Shares at the pieces' ends, shape (eyes, elevations, azimuths, PIECES + 1, 3)."""
    directions = world_from_body.rotation.apply(node_directions(AZIMUTHS, ELEVATIONS))
    around = RobotLight(robot, light)
    nodes = lengths_m()
    result = []
    for eye in world_from_body.apply(eyes_m):
        missing = [np.zeros((len(directions), 3))]
        for near, far in pairwise(nodes):
            if far > FARTHEST_M:
                missing.append(missing[-1])
                continue
            width = (far - near) / POINTS
            middles = near + width * (np.arange(POINTS) + 0.5)
            pieces = [around.missing_from_line(eye, directions, float(middle)) for middle in middles]
            missing.append(missing[-1] + np.sum(pieces, axis=0) * width)
        open_water = around.open_water(eye, directions)
        result.append(np.stack(missing, axis=1) / open_water[:, np.newaxis])
    return np.stack(result).reshape(len(eyes_m), ELEVATIONS, AZIMUTHS, PIECES + 1, 3)
