"""Dimensions of the gimbal that follow from the mirror, the servos and the mount's walls and clearances.

Everything is in millimetres; heights are along z of the gimbal's frame, whose origin is where the joint axes cross.
The tilt servo is on the +y side of the pan frame, the pivot on the -y side.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

from cad.mirrors import FIT_MM, LIP_THICKNESS_MM, tray_depth_mm, tray_foot_mm
from cad.servo import EAR_LENGTH_MM, HORN_HEIGHT_MM, case_bottom, case_ends, ear_levels
from rigs import GazeMirror, Mount, Rig, Servos

CHEEK_RADIUS_MM = 10.0
PIN_RADIUS_MM = 3.0
THRUST_GAP_MM = 0.6
"""Between cheek and pivot arm: room for a washer."""
SMALLEST_ARM_MM = 4.0
SMALLEST_CHEEK_MM = 3.0
"""More than the tray's rim, which must not touch the servo's horn."""
EAR_MARGIN_MM = 2.0
PIVOT_RADIUS_MM = 8.0


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
        if rig.gaze_mirror is None or rig.servos is None or rig.mount is None:
            raise ValueError(f"expected a rig with mirrors, got {rig.name!r}, which has none")
        return cls(mirror=rig.gaze_mirror, servos=rig.servos, mount=rig.mount)

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
        depth = tray_depth_mm(self.mirror, self.mount.wall_mm)
        front = FIT_MM + LIP_THICKNESS_MM
        return max(hypot(tray_foot_mm(self.mirror), max(depth, front)), CHEEK_RADIUS_MM)

    @property
    def holder_reach_mm(self) -> float:
        """Radius of the cylinder about the pan axis that the mirror holder sweeps."""
        return hypot(self.holder_radius_mm, self.cheek_outer_mm)

    @property
    def pivot_inner_mm(self) -> float:
        """Inner face of the pivot arm: distance from the pan axis towards -y."""
        return self.cheek_outer_mm + THRUST_GAP_MM

    @property
    def pivot_outer_mm(self) -> float:
        """Outer face of the pivot arm: distance from the pan axis towards -y."""
        return self.pivot_inner_mm + self.arm_thickness_mm

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
        """Radius of the cylinder about the pan axis that yoke and tilt servo sweep."""
        case_end = self.tilt_horn_mm - case_bottom(self.servos.tilt)
        return max(
            hypot(case_end, self.servos.tilt.size_mm[1] / 2),
            hypot(max(self.servo_arm_outer_mm, self.pivot_outer_mm), self.arm_half_width_mm),
        )

    @property
    def yoke_floor_mm(self) -> float:
        """Upper face of the yoke's plate: below everything that turns about the tilt axis."""
        servo_end = -case_ends(self.servos.tilt)[0] + EAR_LENGTH_MM
        return -max(self.holder_radius_mm, servo_end) - self.mount.clearance_mm

    @property
    def yoke_bottom_mm(self) -> float:
        """Lower face of the yoke's plate, which is screwed to the pan servo's horn."""
        return self.yoke_floor_mm - self.arm_thickness_mm

    @property
    def pan_horn_mm(self) -> float:
        """Upper face of the pan servo's horn."""
        return self.yoke_bottom_mm - FIT_MM

    @property
    def foot_top_mm(self) -> float:
        """Upper face of the gimbal base's foot, on which the pan servo's ears lie."""
        return self.pan_horn_mm + ear_levels(self.servos.pan)[0] - FIT_MM
