"""What of a rig its hull takes: a port that looks into it, mirrors that reach into it, anchors beside it.

A hull is known by the distance of points from it alone, so that own shapes and files are judged alike. Every problem
says how far to move what, and which way.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from optics.feasibility.envelope import (
    HullDistance,
    box_distance,
    hull_half_size,
    own_hull_distance,
    plate_points,
    window_centre,
)
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import BoxHull, FileHull, Gaze, GazeMirror, ParametricHull, Problem, Rig, TorpedoHull

JOINT_SAMPLES = 25
"""Joint values over each range at which the gaze mirror's plate is placed."""

COARSE_SAMPLES = 7
"""Points along each side of a plate, at all joint values; at the `CLOSEST_POSES` all points of `plate_points` count."""

BURIED_SAMPLES = 3

CLOSEST_POSES = 8

LARGEST_CAMERA_GAP_M = 0.15
"""A camera may be strapped to the outside of a hull; further away than this its position is a mistake."""

LARGEST_ANCHOR_GAP_M = 0.005
"""An anchor further from the hull's surface than this has nothing to be bolted to."""

ROUNDING_M = 1e-9
"""Touching counts as clear: a millimetre written in a rig file must survive its conversion to metres."""

FURTHEST_M, STEP_M, ACCURACY_M = 1.5, 0.02, 0.001
"""How far a way out of the hull is looked for, in which steps, and to what it is found."""

ADVICE_POSES, ADVICE_SAMPLES = 5, 5
"""Joint values over each range, and points along a plate's sides, for which a way out is looked for."""

NEAREST_STEPS, DIFFERENCE_M = 20, 1e-5
"""Newton steps to the surface, and the distance over which its gradient is taken."""


class Deepest(NamedTuple):
    """Smallest distance of M2's plate from the hull, metres, and the joint values at which it has it, radians."""

    gap_m: float
    q1: float
    q2: float


def hull_problems(rig: Rig, hull: HullDistance | None = None) -> Iterator[Problem]:
    """What is wrong between a rig with mirrors and its hull.

    Parameters
    ----------
    rig : Rig
    hull : callable, optional
        Distance of points from its hull; by default that of its shape. Nothing is said of a file's without one.
    """
    distance = hull or own_hull_distance(rig)
    if distance is None:
        return
    gaze, layout = rig.require_gaze(), Layout.from_rig(rig)
    # What the camera's problem asks for moves the mirrors as well: they are not to be moved twice.
    moved = np.zeros(3)
    if isinstance(gaze.hull, BoxHull | TorpedoHull | FileHull):
        moved = _way_out_of_port(rig, layout, distance)
        yield from _port(rig, layout, distance, moved)
        yield from _anchors(gaze, distance)
    yield from _camera_far_away(rig, gaze, distance)
    yield from _fold_mirror(gaze, layout, distance, moved)
    yield from _gaze_mirror(gaze, layout, distance, moved)


def closest_gaze_mirror(distance: HullDistance, mirror: GazeMirror, layout: Layout) -> Deepest:
    """Where over the joint ranges, their limits included, M2's plate comes nearest to the hull or deepest into it."""
    centre, plate = layout.body_from_gimbal.translation, plate_points(mirror)
    around = float(distance(centre))
    room = around - np.linalg.norm(plate, axis=1).max()
    if room >= 0:
        # The sphere in which it turns is clear already.
        return Deepest(float(room), 0.0, 0.0)
    q = layout.joint_grid(JOINT_SAMPLES)
    # With its middle inside already, how deep its edges are to a few millimetres is all there is to know.
    samples = COARSE_SAMPLES if around > 0 else BURIED_SAMPLES
    coarse = _lowest(distance, plate_points(mirror, samples), layout, q, around)
    closest = q[np.argsort(coarse)[:CLOSEST_POSES]]
    gaps = _lowest(distance, plate, layout, closest, around)
    best = int(gaps.argmin())
    return Deepest(float(gaps[best]), *closest[best].tolist())


def _lowest(distance: HullDistance, plate: FloatArray, layout: Layout, q: FloatArray, around: float) -> FloatArray:
    """Smallest distance of a plate's points from the hull at joint values, shape (n,).

    A point that is nearer to the joint axes' crossing than the hull is clear at all of them, and need not be asked.
    """
    reach = np.linalg.norm(plate, axis=1)
    asked = plate[reach > max(around, 0.0) - ROUNDING_M]
    if not len(asked):
        return np.full(len(q), around - reach.max())
    return np.asarray(distance(_placed(asked, layout, q)).min(axis=1))


def _placed(plate: FloatArray, layout: Layout, q: FloatArray) -> FloatArray:
    """Points of M2's plate at joint values, body frame, shape (n, points, 3)."""
    frames = layout.moving_frames(*q.T)[1]
    return np.asarray(np.einsum("nij,pj->npi", frames[:, :3, :3], plate) + frames[:, np.newaxis, :3, 3])


def _port(rig: Rig, layout: Layout, distance: HullDistance, moved: FloatArray) -> Iterator[Problem]:
    face = layout.body_from_camera.apply(window_centre(rig))
    depth = -float(distance(face))
    if depth <= ROUNDING_M:
        return
    advice = "no place straight ahead of it is outside"
    if moved.any():
        position = np.array(rig.camera.position_mm) + 1000 * moved
        advice = f"{1000 * np.linalg.norm(moved):.0f} mm along its view, at {_point(position)}, it is outside"
    window = (
        ', and hull.window = "cut" or "clear" makes a window of a skin close to it' if rig.file_hull is not None else ""
    )
    yield Problem(
        place="camera.position_mm",
        value=rig.camera.position_mm,
        expected=f"a port that looks out of the hull; the middle of its outer face is {_mm(depth)} mm inside, "
        f"the nearest skin at {_point(1000 * _nearest(distance, face))}; {advice}{window}",
    )


def _way_out_of_port(rig: Rig, layout: Layout, distance: HullDistance) -> FloatArray:
    """How a camera has to be moved along its view for its port to look out of the hull, shape (3,), metres."""
    ahead = layout.body_from_camera.rotation.apply([0.0, 0.0, 1.0])
    face = layout.body_from_camera.apply(window_centre(rig))
    away = _way_out(distance, face[np.newaxis], ahead)
    return np.asarray(ahead * (away or 0.0))


def _anchors(gaze: Gaze, distance: HullDistance) -> Iterator[Problem]:
    for end in ("fold", "base"):
        if getattr(gaze.mount, f"{end}_plane") is not None:
            continue  # dropped onto a plane of the hull, wherever it was
        key = f"{end}_anchor_mm"
        anchor = np.array(getattr(gaze.mount, key)) / 1000
        gap = float(distance(anchor))
        if abs(gap) > LARGEST_ANCHOR_GAP_M:
            where = "outside" if gap > 0 else "inside"
            yield Problem(
                place=f"mount.{key}",
                value=getattr(gaze.mount, key),
                expected=f"a point on the hull's surface; this one is {_mm(abs(gap))} mm {where}, and the surface is "
                f"at {_point(1000 * _nearest(distance, anchor))}",
            )


def _camera_far_away(rig: Rig, gaze: Gaze, distance: HullDistance) -> Iterator[Problem]:
    pinhole = np.array(rig.camera.position_mm) / 1000
    if isinstance(gaze.hull, ParametricHull):
        # An open frame's panels may be far from a camera in the middle of it.
        gap = float(box_distance(pinhole, hull_half_size(gaze.hull)))
    else:
        gap = float(distance(pinhole))
    if gap > LARGEST_CAMERA_GAP_M:
        yield Problem(
            place="camera.position_mm",
            value=rig.camera.position_mm,
            expected=f"a camera in or at the hull; this one is {_mm(gap)} mm away from it",
        )


def _fold_mirror(gaze: Gaze, layout: Layout, distance: HullDistance, moved: FloatArray) -> Iterator[Problem]:
    plate = layout.body_from_m1.apply(plate_points(gaze.fold_mirror))
    gap = float(distance(plate).min())
    if gap < -ROUNDING_M:
        ahead = layout.body_from_camera.rotation.apply([0.0, 0.0, 1.0])
        corners = layout.body_from_m1.apply(plate_points(gaze.fold_mirror, ADVICE_SAMPLES))
        away = _way_out(distance, corners + moved, ahead)
        yield Problem(
            place="fold_mirror.distance_mm",
            value=gaze.fold_mirror.distance_mm,
            expected=f"M1 outside the hull; its plate reaches {_mm(-gap)} mm into it: "
            f"{_advice({'distance_mm': (gaze.fold_mirror.distance_mm, away)}, moved)}",
        )


def _gaze_mirror(gaze: Gaze, layout: Layout, distance: HullDistance, moved: FloatArray) -> Iterator[Problem]:
    gap, q1, q2 = closest_gaze_mirror(distance, gaze.gaze_mirror, layout)
    if gap >= -ROUNDING_M:
        return
    poses = np.vstack([layout.joint_grid(ADVICE_POSES), [(q1, q2)]])
    swept = _placed(plate_points(gaze.gaze_mirror, ADVICE_SAMPLES), layout, poses).reshape(-1, 3) + moved
    directions = {
        "distance_mm": (gaze.gaze_mirror.distance_mm, layout.fold_direction),
        "fold_mirror.distance_mm": (gaze.fold_mirror.distance_mm, np.array([0.0, 0.0, 1.0])),
    }
    ways = {
        key: (present, _way_out(distance, swept, layout.body_from_camera.rotation.apply(direction)))
        for key, (present, direction) in directions.items()
    }
    yield Problem(
        place="gaze_mirror.distance_mm",
        value=gaze.gaze_mirror.distance_mm,
        expected=f"M2 outside the hull at all joint values; at q1 = {np.degrees(q1):g} and "
        f"q2 = {np.degrees(q2):g} deg its plate reaches {_mm(-gap)} mm into it: {_advice(ways, moved)}",
    )


def _advice(ways: dict[str, tuple[float, float | None]], moved: FloatArray) -> str:
    """What clears a mirror: keys with their present value, and how much more of each it takes, metres."""
    after = "moved with the camera, " if moved.any() else ""
    if any(away == 0 for _, away in ways.values()):
        return f"{after}it is clear"
    values = {key: np.ceil(present + 1000 * away) for key, (present, away) in ways.items() if away is not None}
    if not values:
        return f"{after}no {' nor '.join(ways)} clears it; look at the joint limits, the mirror's size or the camera"
    return f"{after}about " + " or ".join(f"{key} = {value:.0f}" for key, value in values.items()) + " clears it"


def _way_out(distance: HullDistance, points: FloatArray, direction: FloatArray) -> float | None:
    """Least distance along a direction that brings points out of the hull, to a millimetre; None when there is none.

    What is so deep has to go that far at least: such steps pass no way out, and those of `STEP_M` only narrow ones.
    """

    def gap(away: float) -> float:
        return float(distance(points + away * direction).min())

    low = high = 0.0
    while (deep := -gap(high)) > ROUNDING_M:
        low, high = high, high + max(deep, STEP_M)
        if high > FURTHEST_M:
            return None
    while high - low > ACCURACY_M:
        middle = (low + high) / 2
        low, high = (low, middle) if gap(middle) >= -ROUNDING_M else (middle, high)
    return high


def _nearest(distance: HullDistance, point: FloatArray) -> FloatArray:
    """Point of the surface near a point, by Newton's method along the distance's gradient."""
    for _ in range(NEAREST_STEPS):
        gap = float(distance(point))
        if abs(gap) < ROUNDING_M:
            break
        steps = DIFFERENCE_M * np.eye(3)
        gradient = (distance(point + steps) - distance(point - steps)) / (2 * DIFFERENCE_M)
        point = point - gap * gradient / max(float(gradient @ gradient), 0.25)
    return point


def _mm(length_m: float) -> str:
    return f"{1000 * length_m:.1f}"


def _point(point_mm: FloatArray) -> str:
    return "[" + ", ".join(f"{value + 0.0:.1f}" for value in np.round(point_mm, 1)) + "]"
