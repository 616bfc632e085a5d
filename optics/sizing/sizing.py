"""Sizing: the smallest M1 and M2 that pass a window of the image over a range of gazes, or what keeps them from it.

The footprint of the window's boundary is taken over a grid of poses, then over finer and finer grids around the poses
at which it reaches furthest; the outlines hold all of it, grown by what print and alignment may be off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optics.feasibility.envelope import HullDistance
from optics.layout import Layout
from optics.mirror_outline import mirror_outline
from optics.sizing.footprint import Footprint, fold_footprint, gaze_footprint
from optics.sizing.gaze_range import GazeRange, Grid, Interval, pairs, pose_grid
from optics.sizing.limits import (
    RAYS_PER_SIDE,
    Binding,
    Request,
    cut_by_port,
    grazing,
    larger_than_bed,
    largest_window,
    longest_range,
    out_of_reach,
    out_of_room,
    with_mirrors,
)
from optics.sizing.outlines import Outlines, outlines_around
from optics.sizing.window import Window
from optics.train import OpticalTrain, Rays
from rigs import Rig
from rigs.gaze import FlatMirror

POSE_STEPS = 41
"""Values of each range in the first grid."""

ZOOMS, ZOOM_STEPS = 3, 7
"""Each zoom makes the grid three times as fine: 4 degrees become 0.14, at which an arc rises 1e-6 of its radius."""

ZOOM_DIRECTIONS = 16
"""Directions in M2's plane in which the furthest pose is looked for."""

SHARE_CELLS, SHARE_STEPS = (24, 18), 21
"""Cells of the window and values of each range over which the share that given mirrors pass is counted."""


@dataclass(frozen=True, kw_only=True)
class Sizing:
    """The mirrors a request needs.

    Attributes
    ----------
    request : Request
    m1, m2 : Outlines or None
        None where no finite mirror does.
    rig : Rig or None
        The rig with mirrors of these sizes and its own outlines, rounded up to 0.5 mm; None where there are none.
    bindings : tuple of Binding
        What keeps the request from being met; empty when it is met.
    window_factor : float
        Largest factor on the window's sides at which the whole range can be met, 1 when the request is met.
    second_range : (float, float) or None
        Longest part of the second range (elevation or q2), radians, over which the whole window can be met.
    passed_now : float
        Share of window and range that the rig's present mirrors pass, without margins and without occluders.
    """

    request: Request
    m1: Outlines | None
    m2: Outlines | None
    rig: Rig | None
    bindings: tuple[Binding, ...]
    window_factor: float
    second_range: Interval | None
    passed_now: float


def size_mirrors(rig: Rig, request: Request, hull: HullDistance | None = None) -> Sizing:
    """Smallest mirrors for a request.

    Parameters
    ----------
    rig : Rig
        With mirrors; the sizes it gives them do not matter.
    request : Request
    hull : callable, optional
        Distance of points from the rig's hull, as for `optics.feasibility.feasibility.feasibility_problems`.

    Raises
    ------
    ValueError
        For a rig without mirrors or a window beyond the image.
    """
    layout, gaze = Layout.from_rig(rig), rig.require_gaze()
    train = OpticalTrain.bare(rig)
    request.window.check_inside(train.camera)
    grid = pose_grid(layout, request.gaze, POSE_STEPS)
    rays = train.trace(request.window.boundary(RAYS_PER_SIDE))
    passed = rays[rays.passed]
    bindings = out_of_reach(grid, request.gaze) + cut_by_port(train, request.window, rays)
    m1 = m2 = sized = None
    if grid.reached.any() and len(passed.origin_m):
        on_m1 = fold_footprint(rig, passed)
        on_m2 = gaze_footprint(rig, passed, q1=grid.q1[grid.reached], q2=grid.q2[grid.reached])
        runaway = grazing(on_m1, on_m2, request.gaze, grid)
        bindings += runaway
        if not runaway:
            m1 = _outlines([on_m1], request)
            m2 = _outlines([on_m2, *_zoomed(rig, passed, request.gaze, grid, on_m2)], request)
            sized = with_mirrors(rig, m1.sides_m(gaze.fold_mirror.outline), m2.sides_m(gaze.gaze_mirror.outline))
            bindings += larger_than_bed(sized) + out_of_room(sized, hull)
    if sized is None:
        # What is wrong elsewhere in the rig file keeps any window from fitting: it has to be named all the same.
        bindings += [binding for binding in out_of_room(rig, hull) if binding.constraint == "rig file"]
    window_factor = 1.0
    second_range: Interval | None = request.gaze.second
    if any(binding.constraint == "rig file" for binding in bindings):
        # What is wrong elsewhere stays wrong whatever the window.
        window_factor, second_range = 0.0, None
    elif bindings:
        window_factor = largest_window(rig, train, request, grid, hull)
        second_range = longest_range(rig, request, rays if rays.passed.all() else None, grid, hull)
    return Sizing(
        request=request,
        m1=m1,
        m2=m2,
        rig=sized,
        bindings=tuple(bindings),
        window_factor=window_factor,
        second_range=second_range,
        passed_now=passed_share(rig, request.window, request.gaze),
    )


def passed_share(rig: Rig, window: Window, gaze: GazeRange) -> float:
    """Share of a window and a range (every pixel and pose counting the same) that a rig's mirrors pass, unobstructed.

    Poses out of the joints' reach count as lost.
    """
    mirrors, layout = rig.require_gaze(), Layout.from_rig(rig)
    grid = pose_grid(layout, gaze, SHARE_STEPS)
    rays = OpticalTrain.bare(rig).trace(window.cells(*SHARE_CELLS))
    passed = rays[rays.passed]
    if not grid.reached.any() or not len(passed.origin_m):
        return 0.0
    inside = _inside(fold_footprint(rig, passed), mirrors.fold_mirror)
    on_m2 = gaze_footprint(rig, passed, q1=grid.q1[grid.reached], q2=grid.q2[grid.reached])
    inside = inside & _inside(on_m2, mirrors.gaze_mirror)
    return float(inside.sum() / (len(rays.status) * len(grid.reached)))


def _inside(footprint: Footprint, mirror: FlatMirror) -> NDArray[np.bool_]:
    x, y = footprint.points_m[..., 0], footprint.points_m[..., 1]
    return np.asarray(footprint.front & mirror_outline(mirror).contains(x, y))


def _outlines(footprints: list[Footprint], request: Request) -> Outlines:
    points = np.concatenate([footprint.points_m.reshape(-1, 2) for footprint in footprints])
    spread = np.concatenate([footprint.spread_m.ravel() for footprint in footprints])
    return outlines_around(points, request.margin_m + request.angle_tolerance * spread)


def _zoomed(rig: Rig, passed: Rays, gaze: GazeRange, grid: Grid, on_m2: Footprint) -> list[Footprint]:
    """Footprints on ever finer grids around the poses at which M2 has to reach furthest."""
    layout = Layout.from_rig(rig)
    angles = 2 * np.pi * np.arange(ZOOM_DIRECTIONS) / ZOOM_DIRECTIONS
    directions = np.stack([np.cos(angles), np.sin(angles)])
    first, second = (values[grid.reached] for values in pairs(grid.first, grid.second))
    # At each direction the centre of its own grid, and how wide the steps around it are.
    footprints, step_count = [on_m2], float(POSE_STEPS)
    owners = np.ones((ZOOM_DIRECTIONS, len(first)), dtype=np.bool_)
    for _ in range(ZOOMS):
        reach = (footprints[-1].points_m @ directions).max(axis=1)
        best = np.where(owners, reach.T, -np.inf).argmax(axis=1)
        patches = [pairs(*gaze.around(first[k], second[k], round(step_count), ZOOM_STEPS)) for k in best]
        first, second = (np.concatenate(parts) for parts in zip(*patches, strict=True))
        owners = np.repeat(np.eye(ZOOM_DIRECTIONS, dtype=bool), ZOOM_STEPS**2, axis=1)
        q1, q2 = gaze.poses(layout, first, second)
        reached = np.isfinite(q1)
        first, second, owners = first[reached], second[reached], owners[:, reached]
        footprints.append(gaze_footprint(rig, passed, q1=q1[reached], q2=q2[reached]))
        step_count = (step_count - 1) * (ZOOM_STEPS - 1) / 2 + 1
    return footprints[1:]
