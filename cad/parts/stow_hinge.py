"""The hinge that swings M1 out of the camera's view: where its axis is, and how far its parts reach.

The axis runs across, over the upper edge of M1's cell and above the roof, so that an upward swing takes everything away
from the view and from M2. In use, a bar of the arm lies against the front of the deck: that stop defines M1's place,
whatever holds it there. All numbers are in the fold frame (`cad.parts.bracket.bracket_placement`), millimetres.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, cos, hypot, sin, sqrt

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from cad.parts.bracket.bracket_placement import ALIGNMENT_MM, BracketPlacement, bracket_placement
from cad.parts.mirrors import FIT_MM, LIP_THICKNESS_MM, tray_foot_mm
from cad.parts.servo import EAR_LENGTH_MM, case_bottom, case_ends, ear_levels
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import Rig, Servo

LUG_RADIUS_MM = 14.0
SMALLEST_LUG_MM = 5.0
"""An M4 insert and its relief."""
LARGEST_SERVO_LUG_MM = 8.0
"""Between a servo's ears and the top of its case."""
GAP_MM = 0.3
"""Between lugs and arm, and between what turns and what does not."""
EAR_MARGIN_MM = 2.5
BAR_MM = 8.0
"""Depth of the bar that lies against the deck."""
SMALLEST_TONGUE_MM = 14.0

Point = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class StowHinge:
    """Numbers of a hinge.

    Attributes
    ----------
    placement : BracketPlacement
    max_deg : float
        Angle at which M1 is stowed.
    servo : Servo or None
        What turns it; None for by hand, with a locking screw.
    """

    placement: BracketPlacement
    max_deg: float
    servo: Servo | None

    @property
    def lug_mm(self) -> float:
        """Thickness of lugs and of the arm's plates."""
        return max(self.placement.wall_mm, SMALLEST_LUG_MM)

    @property
    def arm_mm(self) -> tuple[float, float]:
        """Inner and outer face of the arm's plates: distance from the middle."""
        outer = self.placement.tray_half_width_mm
        return outer - self.lug_mm, outer

    @property
    def lug_limits_mm(self) -> tuple[float, float]:
        """Inner and outer face of a lug with a pivot: distance from the middle."""
        outer = self.arm_mm[0] - GAP_MM
        return outer - self.lug_mm, outer

    @property
    def horn_mm(self) -> float:
        """Outer face of the servo's horn: distance from the middle towards +y."""
        return self.arm_mm[0] - FIT_MM

    @property
    def servo_lug_limits_mm(self) -> tuple[float, float]:
        """Inner face of the lug against which the servo's ears lie, and its outer face: distance from the middle."""
        assert self.servo is not None
        inner = self.horn_mm + ear_levels(self.servo)[1] + FIT_MM
        return inner, inner + min(self.lug_mm, LARGEST_SERVO_LUG_MM)

    @property
    def servo_lug_ends_mm(self) -> tuple[float, float, float]:
        """Rear end, front end and half height of the servo's lug, from the axis."""
        assert self.servo is not None
        far, near = case_ends(self.servo)
        margin = EAR_LENGTH_MM + EAR_MARGIN_MM
        return far - margin, near + margin, self.servo.size_mm[1] / 2 + FIT_MM + EAR_MARGIN_MM

    @property
    def rise_mm(self) -> float:
        """From the roof's outer face up to the axis: a lug stays above the inner face, a servo above the outer."""
        lug = LUG_RADIUS_MM - self.placement.wall_mm
        return max(lug, self.servo_lug_ends_mm[2] if self.servo else 0.0, 4.0)

    @property
    def axis_mm(self) -> Point:
        """The axis, as (x, z)."""
        placement = self.placement
        front = placement.in_side_view(tray_foot_mm(placement.mirror), LIP_THICKNESS_MM)
        return min(front[0], placement.upper_mm[0]) - GAP_MM, placement.roof_mm + self.rise_mm

    @property
    def fixed_radius_mm(self) -> float:
        """Radius about the axis within which everything of the deck is that stands over it."""
        radius = max(LUG_RADIUS_MM, hypot(0.7 * LUG_RADIUS_MM, self.rise_mm))
        if self.servo:
            _, front, half = self.servo_lug_ends_mm
            radius = max(radius, hypot(front, max(half, self.rise_mm)))
        return radius

    @property
    def stop_mm(self) -> float:
        """Where the deck's front is along x, against which the arm's bar lies in use."""
        reach = sqrt(max((self.fixed_radius_mm + GAP_MM) ** 2 - self.rise_mm**2, 0.0))
        return self.axis_mm[0] + max(reach, LUG_RADIUS_MM * 0.7 + 1)

    @property
    def rear_mm(self) -> float:
        """Rear end of what turns in use."""
        return self.axis_mm[0] - LUG_RADIUS_MM

    def on_lug(self, corner: Point, *, side: int) -> Point:
        """Where a tangent from a corner touches the lug's circle; `side` 1 left of the way to the axis, -1 right."""
        x, z = self.axis_mm
        dx, dz = corner[0] - x, corner[1] - z
        distance = hypot(dx, dz)
        half = -side * acos(LUG_RADIUS_MM / distance)
        unit = (dx / distance, dz / distance)
        turned = (unit[0] * cos(half) - unit[1] * sin(half), unit[0] * sin(half) + unit[1] * cos(half))
        return x + LUG_RADIUS_MM * turned[0], z + LUG_RADIUS_MM * turned[1]

    def body_from_stowing(self, angle_rad: float) -> RigidTransform:
        """What the hinge does to parts given in the body frame in use, at a joint value from 0 to its maximum."""
        x, z = self.axis_mm
        pivot = np.array([x, self.placement.y_mm, z]) / 1000
        # From x towards z: about -y.
        turn = Rotation.from_rotvec([0.0, -angle_rad, 0.0])
        in_fold = RigidTransform.from_components(pivot - turn.apply(pivot), turn)
        return self.placement.body_from_fold * in_fold * self.placement.body_from_fold.inv()

    def axis_in_body(self) -> tuple[FloatArray, FloatArray]:
        """A point of the axis, metres, and its direction, about which stowing is positive; body frame."""
        x, z = self.axis_mm
        point = self.placement.body_from_fold.apply(np.array([x, self.placement.y_mm, z]) / 1000)
        return np.asarray(point), np.asarray(self.placement.body_from_fold.rotation.apply([0.0, -1.0, 0.0]))


def stow_hinge(rig: Rig, layout: Layout) -> StowHinge | None:
    """Hinge of a rig; None for one whose fold mirror is fixed.

    Raises
    ------
    ValueError
        When there is no room for the hinge between flange and M1 or between the cell's sides, or the flange is beside
        the camera's vertical plane.
    """
    gaze = rig.require_gaze()
    if gaze.joints.stow is None:
        return None
    hinge = StowHinge(
        placement=bracket_placement(rig, layout), max_deg=gaze.joints.stow.max_deg, servo=gaze.servos.stow
    )
    placement = hinge.placement
    place, (x, y, z) = f"mount.fold_anchor_mm = {gaze.mount.fold_anchor_mm}", placement.anchor_mm.tolist()
    if abs(y - placement.y_mm) > ALIGNMENT_MM:
        raise ValueError(
            f"{place}: expected an anchor such as {placement.in_words(x, placement.y_mm, z)} for joints.stow, in the "
            f"plane of the camera's view and its fold, not {abs(y - placement.y_mm):.1f} mm beside it"
        )
    beyond = placement.pedestal_mm[0][1] - (hinge.rear_mm - GAP_MM)
    if beyond > 0:
        raise ValueError(
            f"{place}: expected an anchor such as {placement.in_words(x - beyond, y, z)}, so that the flange ends "
            f"behind the hinge of joints.stow; it reaches {beyond:.1f} mm too far"
        )
    _check_width(hinge)
    return hinge


def _check_width(hinge: StowHinge) -> None:
    inner = -hinge.lug_limits_mm[0]
    needed = SMALLEST_TONGUE_MM / 2 - hinge.lug_limits_mm[1]
    if hinge.servo:
        needed = max(needed, (inner + GAP_MM) - (hinge.horn_mm + case_bottom(hinge.servo)))
    if needed > 0:
        raise ValueError(
            f"fold_mirror.width_mm = {hinge.placement.mirror.width_mm:g}: expected at least "
            f"{hinge.placement.mirror.width_mm + (1 if hinge.servo else 2) * needed:.0f}, so that the hinge of "
            f"joints.stow {'and its servo fit' if hinge.servo else 'fits'} behind M1"
        )
