"""Dimensions of the gimbal that follow from the mirror, the servos and the mount's walls and clearances.

Everything is in millimetres; heights are along z of the gimbal's frame, whose origin is where the joint axes cross.
The tilt servo is on the +y side of the pan frame, the pivot on the -y side.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

from cad.parts.hardware import Bushing, head_height_mm, insert
from cad.parts.mirrors import FIT_MM, cell_radius_mm
from cad.parts.servo import EAR_LENGTH_MM, HORN_HEIGHT_MM, case_bottom, case_ends, ear_levels
from rigs import GazeMirror, Mount, Rig, Servo, Servos

CHEEK_RADIUS_MM = 11.0
SMALLEST_ARM_MM = 5.0
"""The insert for an ear's screw and a floor under it."""
SMALLEST_CHEEK_MM = 4.5
"""The insert of the pivot's screw; more than the tray's rim, which must not touch the servo's horn."""
EAR_MARGIN_MM = 2.0

THRUST_GAP_MM = 0.2
"""Between the flange of a bushing and what turns on it."""
PIVOT_BUSHING = Bushing(bore_mm=6.0, outer_mm=8.0, flange_mm=12.0, flange_thickness_mm=1.0, length_mm=6.0)
PIVOT_SLEEVE_MM = 8.0
PIVOT_RADIUS_MM = 9.0
PIVOT_WASHER_MM = 0.9
"""Thickness of the large M3 washer (the table's upper limit) that keeps the pivot's arm on its sleeve."""
PIVOT_WASHER_RADIUS_MM = 4.5

PAN_BUSHING = Bushing(bore_mm=30.0, outer_mm=34.0, flange_mm=42.0, flange_thickness_mm=2.0, length_mm=16.0)
"""Around the pan servo's horn: it takes the bending that the servo's own shaft would else have to take."""
HUB_SKIRT_MM = 4.0
"""How far the yoke's hub reaches down beside the horn, short of the servo's case."""
CASE_OVER_FOOT_MM = 1.0


@dataclass(frozen=True, kw_only=True)
class FootDimensions:
    """What of the dimensions shapes the gimbal's base: no mirror of another width does.

    Attributes
    ----------
    servo : Servo
        That of the pan axis.
    wall_mm : float
        Wall of the mount.
    pan_horn_mm, pan_ledge_mm, pan_bushing_seat_mm, foot_top_mm : float
        As `GimbalDimensions` has them.
    """

    servo: Servo
    wall_mm: float
    pan_horn_mm: float
    pan_ledge_mm: float
    pan_bushing_seat_mm: float
    foot_top_mm: float


@dataclass(frozen=True, kw_only=True)
class GimbalDimensions:
    """Where the faces of the gimbal's parts are.

    Attributes
    ----------
    mirror, servos, mount
        The sections of the rig that the rest follows from.
    """

    mirror: GazeMirror
    servos: Servos
    mount: Mount

    @classmethod
    def from_rig(cls, rig: Rig) -> GimbalDimensions:
        """Dimensions for a rig; raises `ValueError` for one without mirrors."""
        gaze = rig.require_gaze()
        return cls(mirror=gaze.gaze_mirror, servos=gaze.servos, mount=gaze.mount)

    @property
    def arm_thickness_mm(self) -> float:
        """Thickness of the yoke's arms and plate."""
        return max(self.mount.wall_mm, SMALLEST_ARM_MM)

    @property
    def cheek_inner_mm(self) -> float:
        """From the middle of the mirror to the inside of the holder's cheeks, along the tilt axis."""
        return self.mirror.width_mm / 2 + FIT_MM

    @property
    def cheek_outer_mm(self) -> float:
        """From the middle of the mirror to the outside of the holder's cheeks, along the tilt axis."""
        return self.cheek_inner_mm + max(self.mount.wall_mm, SMALLEST_CHEEK_MM)

    @property
    def holder_radius_mm(self) -> float:
        """Radius of the cylinder about the tilt axis that the mirror holder sweeps."""
        return max(cell_radius_mm(self.mirror, self.mount.wall_mm, self.mount.mirror_fixing), CHEEK_RADIUS_MM)

    @property
    def holder_reach_mm(self) -> float:
        """Radius of the cylinder about the pan axis that the mirror holder sweeps."""
        return hypot(self.holder_radius_mm, self.cheek_outer_mm)

    @property
    def pivot_inner_mm(self) -> float:
        """Inner face of the pivot arm, with the bushing's flange before it: distance from the pan axis towards -y."""
        return self.cheek_outer_mm + THRUST_GAP_MM + PIVOT_BUSHING.flange_thickness_mm

    @property
    def pivot_sleeve_end_mm(self) -> float:
        """Outer end of the sleeve that turns in the pivot's bushing: distance from the pan axis towards -y."""
        return self.cheek_outer_mm + PIVOT_SLEEVE_MM

    @property
    def pivot_seat_mm(self) -> float:
        """Outer face of the pivot's boss, under the washer: distance from the pan axis towards -y."""
        return self.pivot_sleeve_end_mm - THRUST_GAP_MM

    @property
    def pivot_outer_mm(self) -> float:
        """Outer face of the pivot arm: distance from the pan axis towards -y."""
        return self.pivot_inner_mm + self.arm_thickness_mm

    @property
    def pivot_screw_end_mm(self) -> float:
        """Outer end of the pivot's screw head: distance from the pan axis towards -y."""
        return self.pivot_sleeve_end_mm + PIVOT_WASHER_MM + head_height_mm("M3")

    @property
    def tilt_horn_mm(self) -> float:
        """Outer face of the tilt servo's horn: distance from the pan axis towards +y."""
        return self.cheek_outer_mm + FIT_MM

    @property
    def servo_arm_outer_mm(self) -> float:
        """Outer face of the servo's arm, on which the ears lie: distance from the pan axis towards +y."""
        return self.tilt_horn_mm - ear_levels(self.servos.tilt)[1] - FIT_MM

    @property
    def servo_arm_inner_mm(self) -> float:
        """Inner face of the servo's arm, not beyond the case's top: distance from the pan axis towards +y."""
        return max(self.servo_arm_outer_mm - self.arm_thickness_mm, self.tilt_horn_mm + HORN_HEIGHT_MM)

    @property
    def arm_half_width_mm(self) -> float:
        """Half of the yoke's width, across the tilt axis."""
        return self.servos.tilt.size_mm[1] / 2 + FIT_MM + self.arm_thickness_mm

    @property
    def servo_arm_top_mm(self) -> float:
        """Top of the servo's arm."""
        return case_ends(self.servos.tilt)[1] + EAR_LENGTH_MM + EAR_MARGIN_MM

    @property
    def yoke_radius_mm(self) -> float:
        """Radius of the cylinder about the pan axis that yoke, tilt servo and their screws sweep."""
        case_end = self.tilt_horn_mm - case_bottom(self.servos.tilt)
        return max(
            hypot(case_end, self.servos.tilt.size_mm[1] / 2),
            hypot(max(self.servo_arm_outer_mm, self.pivot_outer_mm), self.arm_half_width_mm),
            hypot(self.pivot_screw_end_mm, PIVOT_WASHER_RADIUS_MM),
        )

    @property
    def yoke_floor_mm(self) -> float:
        """Upper face of the yoke's plate: below everything that turns about the tilt axis."""
        servo_end = -case_ends(self.servos.tilt)[0] + EAR_LENGTH_MM
        return -max(self.holder_radius_mm, servo_end) - self.mount.clearance_mm

    @property
    def yoke_bottom_mm(self) -> float:
        """Lower face of the yoke's plate, which turns on the flange of the pan axis's bushing."""
        return self.yoke_floor_mm - self.arm_thickness_mm

    @property
    def pan_bushing_seat_mm(self) -> float:
        """Underside of the pan bushing's flange: top of its housing on the gimbal's base."""
        return self.yoke_bottom_mm - THRUST_GAP_MM - PAN_BUSHING.flange_thickness_mm

    @property
    def pan_bushing_end_mm(self) -> float:
        """Lower end of the pan axis's bushing, and of the yoke's hub in it."""
        return self.yoke_bottom_mm - THRUST_GAP_MM - PAN_BUSHING.length_mm

    @property
    def pan_horn_mm(self) -> float:
        """Upper face of the pan servo's horn, in the yoke's hub."""
        return self.pan_bushing_end_mm + HUB_SKIRT_MM

    @property
    def pan_ledge_mm(self) -> float:
        """Underside of the foot's ledge, against which the pan servo's ears are screwed from below."""
        return self.pan_horn_mm + ear_levels(self.servos.pan)[1] + FIT_MM

    @property
    def foot_top_mm(self) -> float:
        """Upper face of the gimbal base's foot, a little below the top of the pan servo's case.

        At least an insert and its relief above the ledge, whatever the servo.
        """
        level = self.pan_horn_mm - HORN_HEIGHT_MM - CASE_OVER_FOOT_MM
        return max(level, self.pan_ledge_mm + insert(self.servos.pan.ear_screw).length_mm + 1.0)

    @property
    def foot(self) -> FootDimensions:
        """What shapes the gimbal's base."""
        return FootDimensions(
            servo=self.servos.pan,
            wall_mm=self.mount.wall_mm,
            pan_horn_mm=self.pan_horn_mm,
            pan_ledge_mm=self.pan_ledge_mm,
            pan_bushing_seat_mm=self.pan_bushing_seat_mm,
            foot_top_mm=self.foot_top_mm,
        )
