"""What makes mirrors as large as they are: the gaze and the ray of the window that drive each side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.sizing.footprint import Footprint, fold_footprint, gaze_footprint
from optics.sizing.gaze_range import pairs, pose_grid
from optics.sizing.limits import RAYS_PER_SIDE, Request
from optics.train import OpticalTrain
from rigs import Rig

POSE_STEPS = 31
"""Values of each range; the furthest gaze is named to a step."""

Side = Literal["width", "height"]
SIDES: tuple[Side, Side] = ("width", "height")


@dataclass(frozen=True, kw_only=True)
class SideDriver:
    """What drives a side of a mirror.

    Attributes
    ----------
    mirror : str
        "M1" or "M2".
    side : str
        "width" or "height".
    length_m : float
        The side of a rectangle centred on the mirror's axes that it asks for, margins included.
    pixel : tuple of two floats
        (u, v) of the ray, on the window's boundary.
    gaze : tuple of two floats or None
        The two values of the request's range, radians; None for M1, which is the same for all.
    q1, q2 : float or None
        Joint values of that gaze, radians.
    """

    mirror: str
    side: Side
    length_m: float
    pixel: tuple[float, float]
    gaze: tuple[float, float] | None = None
    q1: float | None = None
    q2: float | None = None


def side_drivers(rig: Rig, request: Request) -> tuple[SideDriver, ...]:
    """What drives the four sides of a request's mirrors; none of a mirror that no ray hits.

    Parameters
    ----------
    rig : Rig
        With mirrors; the sizes it gives them do not matter.
    request : Request
    """
    layout, train = Layout.from_rig(rig), OpticalTrain.bare(rig)
    pixels = request.window.boundary(RAYS_PER_SIDE)
    rays = train.trace(pixels)
    grid = pose_grid(layout, request.gaze, POSE_STEPS)
    if not rays.passed.any() or not grid.reached.any():
        return ()
    pixels, passed = pixels[rays.passed], rays[rays.passed]
    q1, q2 = grid.q1[grid.reached], grid.q2[grid.reached]
    first, second = (values[grid.reached] for values in pairs(grid.first, grid.second))
    found = []
    for side, (_, ray, length) in _longest(fold_footprint(rig, passed), request).items():
        found.append(SideDriver(mirror="M1", side=side, length_m=length, pixel=_pixel(pixels[ray])))
    for side, (pose, ray, length) in _longest(gaze_footprint(rig, passed, q1=q1, q2=q2), request).items():
        found.append(
            SideDriver(
                mirror="M2",
                side=side,
                length_m=length,
                pixel=_pixel(pixels[ray]),
                gaze=(float(first[pose]), float(second[pose])),
                q1=float(q1[pose]),
                q2=float(q2[pose]),
            )
        )
    return tuple(found)


def _longest(footprint: Footprint, request: Request) -> dict[Side, tuple[int, int, float]]:
    """Pose, ray and length of the longest demand on each side; empty where no ray hits the mirror's face."""
    growth = request.margin_m + request.angle_tolerance * footprint.spread_m
    reach = np.where(footprint.front[..., np.newaxis], np.abs(footprint.points_m) + growth[..., np.newaxis], -np.inf)
    reach = reach.reshape(-1, reach.shape[-2], 2)
    if not np.isfinite(reach).any():
        return {}
    found: dict[Side, tuple[int, int, float]] = {}
    for axis, side in enumerate(SIDES):
        pose, ray = np.unravel_index(int(reach[..., axis].argmax()), reach.shape[:2])
        found[side] = int(pose), int(ray), float(2 * reach[pose, ray, axis])
    return found


def _pixel(pixel: FloatArray) -> tuple[float, float]:
    return float(pixel[0]), float(pixel[1])
