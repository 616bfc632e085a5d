"""What the robot occludes from the water around it: its shadow in the light that is scattered into a line of sight.

Open water shines by light from everywhere. Near the robot hull and mount occlude some of that light and send less
of their own. The difference is scattered once: from points along lines of sight the robot is looked at, and what it
shows there instead of open water, and instead of the sun, is scattered into the view,

    D(w, r) = int_0^r exp(-c s) b int p(w, w') (L(w') - F(w')) dw' ds.

Found once, for the robot in its pose with its joints at zero, for lines that begin at the port, on the fold mirror and
at the gaze mirror's centre. The table holds it as a share of the radiance of open water, by direction in the body
frame and length.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import FloatArray
from optics.kernels.packing import halves_of
from scenes.baking.ambient import cached
from scenes.baking.robot_light import RobotLight
from scenes.kernels.direction_grid import node_directions
from scenes.kernels.veiling_light import AZIMUTHS, ELEVATIONS, ROW, SEGMENTS, lengths_m
from scenes.stage.records import MirrorPlate

FARTHEST_M = 10.0
"""Beyond, the robot fills too little of the view to matter."""

LEAST_COSINE = 1e-3
"""Between a line of sight and the normal of the mirror that it leaves."""


def shadow_in_water(around: RobotLight, world_from_body: RigidTransform, begins_m: FloatArray) -> Any:
    """Share of open water's radiance that the robot occludes, a row per segment of a line of sight.

    Parameters
    ----------
    around : RobotLight
        What the robot changes of the light.
    world_from_body : RigidTransform
        Its pose.
    begins_m : array, shape (e, ELEVATIONS * AZIMUTHS, 3)
        Where lines of sight of the table's directions begin, body frame.
    """
    places = (world_from_body.as_matrix(), begins_m)
    shares = cached(
        around.robot,
        around.light,
        around.quality,
        "shadow of the robot in the water",
        lambda: _shares(around, world_from_body, begins_m),
        places=places,
    )
    return halves_of(shares[..., :-1, :], shares[..., 1:, :], ROW)


def folded_begins(eye: FloatArray, mirror: MirrorPlate) -> FloatArray:
    """Where lines from an eye that a mirror folds begin on it, for the table's directions, shape (nodes, 3).

    Behind a mirror stands the eye's image, and lines from there hit the mirror each at a place of its own; the nearest
    one of the mirror for those that would miss it. The mirror is in the eye's frame.
    """
    centre, normal = mirror.centre, np.cross(mirror.x, mirror.y)
    image = eye - 2 * ((eye - centre) @ normal) * normal
    directions = node_directions(AZIMUTHS, ELEVATIONS)
    outwards = np.maximum(directions @ normal, LEAST_COSINE)
    hit = image + directions * (((centre - image) @ normal) / outwards)[:, np.newaxis]
    x, y = mirror.outline.drawn_in(*((hit - centre) @ axis for axis in (mirror.x, mirror.y)))
    return np.asarray(centre + x[:, np.newaxis] * mirror.x + y[:, np.newaxis] * mirror.y)


def _shares(around: RobotLight, world_from_body: RigidTransform, begins_m: FloatArray) -> FloatArray:
    """Shares at the segments' ends, shape (eyes, elevations, azimuths, SEGMENTS + 1, 3)."""
    directions = world_from_body.rotation.apply(node_directions(AZIMUTHS, ELEVATIONS))
    nodes = lengths_m()
    near, far = nodes[:-1][nodes[1:] <= FARTHEST_M], nodes[1:][nodes[1:] <= FARTHEST_M]
    points = around.quality.line_points
    width = (far - near) / points
    distance = near[:, np.newaxis] + width[:, np.newaxis] * (np.arange(points) + 0.5)
    result = []
    for begins in begins_m:
        eyes = world_from_body.apply(begins)
        lines, places = np.repeat(np.arange(len(eyes)), distance.size), np.tile(distance.ravel(), len(eyes))
        per_metre = around.missing_from_lines(eyes[lines], directions[lines], places)
        segments = per_metre.reshape(len(eyes), *distance.shape, 3).sum(axis=2) * width[:, np.newaxis]
        missing = np.zeros((len(eyes), SEGMENTS + 1, 3))
        missing[:, 1 : len(width) + 1] = np.cumsum(segments, axis=1)
        missing[:, len(width) + 1 :] = missing[:, [len(width)]]
        result.append(missing / around.open_water(eyes, directions)[:, np.newaxis])
    return np.stack(result).reshape(len(begins_m), ELEVATIONS, AZIMUTHS, SEGMENTS + 1, 3)
