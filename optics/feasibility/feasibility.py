"""Rigs that no workshop can make work: mirrors inside the hull, views that never reach them, joints no servo turns.

What is tested here follows from the rig's numbers alone; whether the printed parts clear each other is tested on
their solids. A user's own hull file is not looked at: its numbers say nothing about its shape.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from optics.feasibility.envelope import (
    box_distance,
    hull_distance,
    hull_half_size,
    plate_points,
    port_distance,
    sphere_distance,
    window_centre,
)
from optics.gaze.kinematics import faces_light
from optics.kernels.arrays import FloatArray
from optics.layout import Layout, camera_pose, fold_mirror_pose
from optics.train import OpticalTrain, pixel_grid
from rigs import BoxHull, FileHull, Gaze, GazeMirror, Joint, ParametricHull, Problem, Rig, Servo, TorpedoHull

VIEW_COLUMNS, VIEW_ROWS = 64, 48
"""Pixels that stand for the view: a mirror that none of them reaches is useless."""

JOINT_SAMPLES = 25
"""Joint values over each range at which the gaze mirror's plate is placed."""

LARGEST_CAMERA_GAP_M = 0.15
"""A camera may be strapped to the outside of a hull; further away than this its position is a mistake."""

LARGEST_ANCHOR_GAP_M = 0.005
"""An anchor further from the hull's surface than this has nothing to be bolted to."""

ROUNDING_M = 1e-9
"""Touching counts as clear: a millimetre written in a rig file must survive its conversion to metres."""


def feasibility_problems(rig: Rig) -> list[Problem]:
    """Everything that makes a rig impossible or useless.

    Parameters
    ----------
    rig : Rig
        A valid rig, with or without mirrors.

    Returns
    -------
    list of Problem
        With the dotted key of the number to change first; empty for a rig that can work.
    """
    problems = list(_blind_camera(rig))
    if rig.gaze is not None:
        layout = Layout.from_rig(rig)
        for check in (_thick_plates, _joint_ranges, _fold_mirror_at_port, _swept_gaze_mirror, _hull, _unseen_mirrors):
            problems.extend(check(rig, rig.gaze, layout))
    return problems


def _blind_camera(rig: Rig) -> Iterator[Problem]:
    if not _any_seen(OpticalTrain.bare(rig)) and rig.port.shape != "none":
        yield Problem(
            place="port.aperture_diameter_mm",
            value=rig.port.aperture_diameter_mm,
            expected="an aperture through which at least one pixel of the camera sees the water",
        )


def _thick_plates(rig: Rig, gaze: Gaze, layout: Layout) -> Iterator[Problem]:
    for name, plate in (("fold_mirror", gaze.fold_mirror), ("gaze_mirror", gaze.gaze_mirror)):
        limit = min(plate.width_mm, plate.height_mm) / 2
        if plate.thickness_mm >= limit:
            yield Problem(
                place=f"{name}.thickness_mm",
                value=plate.thickness_mm,
                expected=f"less than {limit:g}, half the shorter side of the plate",
            )


def _joint_ranges(rig: Rig, gaze: Gaze, layout: Layout) -> Iterator[Problem]:
    for name in ("pan", "tilt"):
        yield from _joint_range(name, getattr(gaze.joints, name), getattr(gaze.servos, name))
    yield from _gaze_mirror_turned_away(gaze.joints.tilt, layout)
    stow, servo = gaze.joints.stow, gaze.servos.stow
    if servo and stow is None:
        yield Problem(place="servos.stow", value=servo.name, expected="no servo, as there is no hinge joints.stow")
    elif servo and stow and stow.max_deg > servo.travel_deg:
        expected = f"at most {servo.travel_deg:g}, the travel of servos.stow"
        yield Problem(place="joints.stow.max_deg", value=stow.max_deg, expected=expected)


def _joint_range(name: str, joint: Joint, servo: Servo) -> Iterator[Problem]:
    if joint.max_deg - joint.min_deg > servo.travel_deg:
        yield Problem(
            place=f"joints.{name}.max_deg",
            value=joint.max_deg,
            expected=f"at most {joint.min_deg + servo.travel_deg:g}: the travel of servos.{name} is "
            f"{servo.travel_deg:g} deg and min_deg is {joint.min_deg:g}",
        )
    for key, beyond in (("min_deg", joint.min_deg > 0), ("max_deg", joint.max_deg < 0)):
        if beyond:
            side = "at most" if key == "min_deg" else "at least"
            yield Problem(
                place=f"joints.{name}.{key}",
                value=getattr(joint, key),
                expected=f"{side} 0: the joint's range has to hold q = 0, where it rests",
            )


def _gaze_mirror_turned_away(joint: Joint, layout: Layout) -> Iterator[Problem]:
    """The folded axis comes along the gimbal's z: M2 shows it its face while its normal is on that side."""
    for key in ("min_deg", "max_deg"):
        value = getattr(joint, key)
        if not faces_light(layout, np.radians(value)):
            angle = joint.sign * value + joint.offset_deg
            shown = "-45 and 135" if joint.sign == layout.tilt.sign else "-135 and 45"
            yield Problem(
                place=f"joints.tilt.{key}",
                value=value,
                expected=f"an optical angle between {shown} deg, not {angle:g}: there M2 turns its back to M1",
            )


def _fold_mirror_at_port(rig: Rig, gaze: Gaze, layout: Layout) -> Iterator[Problem]:
    plate = fold_mirror_pose(gaze.fold_mirror).apply(plate_points(gaze.fold_mirror))
    gap = float(port_distance(rig, plate).min())
    if gap < -ROUNDING_M:
        yield Problem(
            place="fold_mirror.distance_mm",
            value=gaze.fold_mirror.distance_mm,
            expected=f"M1 in the water in front of the port; its plate reaches {_mm(-gap)} mm into it",
        )


def _swept_gaze_mirror(rig: Rig, gaze: Gaze, layout: Layout) -> Iterator[Problem]:
    """M2's plate turns within a sphere around the centre of its face."""
    radius = float(np.linalg.norm(plate_points(gaze.gaze_mirror), axis=1).max())
    centre = layout.camera_from_gimbal.translation
    fold_plate = layout.camera_from_m1.apply(plate_points(gaze.fold_mirror))
    gaps = {
        "M1": float(sphere_distance(fold_plate, centre, radius).min()),
        "the port": float(port_distance(rig, centre)) - radius,
    }
    for name, gap in gaps.items():
        if gap < -ROUNDING_M:
            yield Problem(
                place="gaze_mirror.distance_mm",
                value=gaze.gaze_mirror.distance_mm,
                expected=f"room to turn: the sphere of {_mm(radius)} mm radius in which M2's plate turns "
                f"reaches {_mm(-gap)} mm into {name}",
            )


def _hull(rig: Rig, gaze: Gaze, layout: Layout) -> Iterator[Problem]:
    if isinstance(gaze.hull, BoxHull | TorpedoHull):
        yield from _closed_hull(rig, gaze)
    if isinstance(gaze.hull, FileHull):
        return
    yield from _camera_far_from_hull(rig, gaze.hull)
    fold_plate = layout.body_from_m1.apply(plate_points(gaze.fold_mirror))
    gap = float(hull_distance(rig, fold_plate).min())
    if gap < -ROUNDING_M:
        yield Problem(
            place="fold_mirror.distance_mm",
            value=gaze.fold_mirror.distance_mm,
            expected=f"M1 outside the hull; its plate reaches {_mm(-gap)} mm into it",
        )
    gap, q1, q2 = _closest_gaze_mirror(rig, gaze.gaze_mirror, layout)
    if gap < -ROUNDING_M:
        yield Problem(
            place="gaze_mirror.distance_mm",
            value=gaze.gaze_mirror.distance_mm,
            expected=f"M2 outside the hull at all joint values; at q1 = {np.degrees(q1):g} and "
            f"q2 = {np.degrees(q2):g} deg its plate reaches {_mm(-gap)} mm into it",
        )


def _closed_hull(rig: Rig, gaze: Gaze) -> Iterator[Problem]:
    """What can be said because the hull is closed: its port must look out of it, its anchors lie on its surface."""
    window = camera_pose(rig.camera).apply(window_centre(rig))
    depth = -float(hull_distance(rig, window))
    if depth > ROUNDING_M:
        yield Problem(
            place="camera.position_mm",
            value=rig.camera.position_mm,
            expected=f"a port that looks out of the hull; the middle of its outer face is {_mm(depth)} mm inside",
        )
    for end in ("fold", "base"):
        if getattr(gaze.mount, f"{end}_plane") is not None:
            continue  # dropped onto a plane of the hull, wherever it was
        key = f"{end}_anchor_mm"
        anchor = np.array(getattr(gaze.mount, key)) / 1000
        gap = float(hull_distance(rig, anchor))
        if abs(gap) > LARGEST_ANCHOR_GAP_M:
            where = "outside" if gap > 0 else "inside"
            yield Problem(
                place=f"mount.{key}",
                value=getattr(gaze.mount, key),
                expected=f"a point on the hull's surface; this one is {_mm(abs(gap))} mm {where}",
            )


def _camera_far_from_hull(rig: Rig, hull: ParametricHull) -> Iterator[Problem]:
    pinhole = np.array(rig.camera.position_mm) / 1000
    gap = float(box_distance(pinhole, hull_half_size(hull)))
    if gap > LARGEST_CAMERA_GAP_M:
        yield Problem(
            place="camera.position_mm",
            value=rig.camera.position_mm,
            expected=f"a camera in or at the hull; this one is {_mm(gap)} mm away from it",
        )


def _unseen_mirrors(rig: Rig, gaze: Gaze, layout: Layout) -> Iterator[Problem]:
    """Whether light gets through: rays of the whole view over M1, then over M2 at the corners of the joint ranges."""
    q = layout.joint_grid(3)
    train = OpticalTrain.from_rig(rig, q1=q[0, 0], q2=q[0, 1])
    if not _any_seen(train.without_mirrors()):
        return
    if not _any_seen(replace(train, mirrors=train.mirrors[:1])):
        yield Problem(
            place="fold_mirror.distance_mm",
            value=gaze.fold_mirror.distance_mm,
            expected="M1 in the camera's view; no pixel's ray reaches its face",
        )
        return
    if not train.trace_poses(_view(train), layout.camera_from_m2_at(*q.T)).passed.any():
        yield Problem(
            place="gaze_mirror.distance_mm",
            value=gaze.gaze_mirror.distance_mm,
            expected="M2 where M1 sends the view; at no joint value does a pixel's ray reach its face",
        )


def _any_seen(train: OpticalTrain) -> bool:
    return bool(train.trace(_view(train)).passed.any())


def _view(train: OpticalTrain) -> FloatArray:
    return pixel_grid(train.camera, VIEW_COLUMNS, VIEW_ROWS)


def _closest_gaze_mirror(rig: Rig, mirror: GazeMirror, layout: Layout) -> tuple[float, float, float]:
    """Smallest distance of M2's plate from the hull over the joint ranges, metres, and the joint values there."""
    plate = plate_points(mirror)
    room = float(hull_distance(rig, layout.body_from_gimbal.translation) - np.linalg.norm(plate, axis=1).max())
    if room >= 0:
        # The sphere in which it turns is clear already.
        return room, 0.0, 0.0
    return min(
        (float(hull_distance(rig, layout.body_from_m2(q1, q2).apply(plate)).min()), q1, q2)
        for q1, q2 in layout.joint_grid(JOINT_SAMPLES).tolist()
    )


def _mm(length_m: float) -> str:
    return f"{1000 * length_m:.1f}"
