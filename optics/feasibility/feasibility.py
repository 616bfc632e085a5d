"""Rigs that no workshop can make work: mirrors inside the hull, views that never reach them, joints no servo turns.

What is tested here follows from the rig's numbers, and from the distance to its hull; whether the printed parts clear
each other is tested on their solids.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from optics.feasibility.envelope import HullDistance, plate_points, port_distance, sphere_distance
from optics.feasibility.hull_room import ROUNDING_M, hull_problems
from optics.gaze.kinematics import faces_light
from optics.kernels.arrays import FloatArray
from optics.layout import Layout, fold_mirror_pose
from optics.train import OpticalTrain, pixel_grid
from rigs import Gaze, Joint, Problem, Rig, Servo

VIEW_COLUMNS, VIEW_ROWS = 64, 48
"""Pixels that stand for the view: a mirror that none of them reaches is useless."""


def feasibility_problems(rig: Rig, hull: HullDistance | None = None) -> list[Problem]:
    """Everything that makes a rig impossible or useless.

    Parameters
    ----------
    rig : Rig
        A valid rig, with or without mirrors.
    hull : callable, optional
        Distance of points from the rig's hull (`HullDistance`); by default that of its shape. A hull from a file has no
        other: without one nothing is said about it (`cad.hulls.distance.file_hull_distance` gives it).

    Returns
    -------
    list of Problem
        With the dotted key of the number to change first; empty for a rig that can work.
    """
    problems = list(_blind_camera(rig))
    if rig.gaze is not None:
        layout = Layout.from_rig(rig)
        for check in (_thick_plates, _joint_ranges, _fold_mirror_at_port, _swept_gaze_mirror):
            problems.extend(check(rig, rig.gaze, layout))
        problems.extend(hull_problems(rig, hull))
        problems.extend(_unseen_mirrors(rig, rig.gaze, layout))
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


def _mm(length_m: float) -> str:
    return f"{1000 * length_m:.1f}"
