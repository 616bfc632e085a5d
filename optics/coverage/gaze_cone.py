"""A cone around all that M2 can show at any pose: what lies outside of it need not be looked at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.train import OpticalTrain

CONE_GRID = 64
"""Rays along each side of the image from which the cone around the gaze is found."""


@dataclass(frozen=True, kw_only=True)
class Cone:
    """All directions in the water behind the port whose rays can reach M2 at some pose: camera frame, radians."""

    axis: FloatArray
    half_angle: float


def gaze_cone(train: OpticalTrain, layout: Layout) -> Cone | None:
    """A cone around all rays behind the port that can reach M2, whatever its pose; None when none can.

    M2 turns about its centre, so that it stays in a ball. Unfolded over M1, that ball is where the camera sees it.
    Rays of a grid over the image that pass within a ball, larger by the spacing of neighbouring rays there, lie in the
    cone; the rays between them do when it is opened by that spacing.
    """
    camera = train.camera
    u = np.linspace(-0.5, camera.width_px - 0.5, CONE_GRID)
    v = np.linspace(-0.5, camera.height_px - 0.5, CONE_GRID)
    pixels = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    rays = train.without_mirrors().unbounded().trace(pixels)
    origin, direction = (
        np.where(rays.passed[:, np.newaxis], values, np.nan).reshape(CONE_GRID, CONE_GRID, 3)
        for values in (rays.origin_m, rays.direction)
    )
    turn, shift = _spacing(direction), _spacing(origin)
    ball = train.mirrors[0].reflection.apply(layout.camera_from_gimbal.translation)
    outline = train.mirrors[1].outline
    radius = np.inf if outline is None else outline.radius_m
    to_ball = ball - origin
    along = np.maximum((to_ball * direction).sum(axis=-1), 0)
    miss = np.linalg.norm(to_ball - along[..., np.newaxis] * direction, axis=-1)
    near = miss <= radius + shift + turn * (np.linalg.norm(to_ball, axis=-1) + radius)
    if not near.any():
        return None
    axis = direction[near].mean(axis=0)
    axis = axis / np.linalg.norm(axis)
    half_angle = np.arccos(np.clip(direction[near] @ axis, -1, 1)).max() + turn
    return Cone(axis=axis, half_angle=float(half_angle))


def _spacing(vectors: FloatArray) -> float:
    """Largest distance between neighbours on a grid, over a corner too."""
    steps = [vectors[1:, 1:] - vectors[:-1, :-1], vectors[1:, :-1] - vectors[:-1, 1:]]
    lengths = np.linalg.norm(steps, axis=-1)
    return float(np.nanmax(lengths, initial=0.0))
