"""The gimbal base: a flange under the hull, a slender column behind the gimbal and a foot with the pan servo.

It is made in the plane that holds the anchor and the pan axis: the base frame has the gimbal's origin, x away from the
anchor and z up, and is turned into place at the end.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, degrees, hypot

import numpy as np
from build123d import Location, Part, Pos, Rot, Solid

from cad.gimbal_dimensions import EAR_MARGIN_MM, GimbalDimensions
from cad.mirrors import FIT_MM
from cad.servo import EAR_LENGTH_MM, case_ends, ear_hole_positions
from cad.shapes import along_x, along_y, box, cylinder, one_solid
from optics.layout import Layout

COLUMN_WIDTH_MM = 14.0
COLUMN_DEPTH_MM = 28.0
FOOT_HEIGHT_MM = 16.0
FLANGE_LENGTH_MM = 50.0
FLANGE_WIDTH_MM = 46.0
FLANGE_HOLES_MM = (18.0, 17.0)
FLANGE_HOLE_DIAMETER_MM = 4.5
"""Clearance for M4."""
EAR_PILOT_DIAMETER_MM = 1.8
GUSSET_MM = 10.0


@dataclass(frozen=True, kw_only=True)
class BaseStance:
    """Where the base stands: heading of its plane, and the anchor seen from the gimbal.

    Attributes
    ----------
    body_from_base : Location
        Pose of the base frame.
    reach_mm : float
        Horizontal distance from the anchor to the pan axis.
    height_mm : float
        Height of the anchor above the gimbal's origin.
    """

    body_from_base: Location
    reach_mm: float
    height_mm: float


def base_stance(dimensions: GimbalDimensions, layout: Layout) -> BaseStance:
    """Stance of the base.

    Raises
    ------
    ValueError
        When the anchor puts column or flange into what yoke and mirror holder sweep, or below the gimbal's foot.
    """
    anchor = np.array(dimensions.mount.base_anchor_mm)
    origin = 1000 * layout.body_from_gimbal.translation
    x, y, height = origin - anchor
    reach, height = hypot(x, y), -height
    clearance = dimensions.mount.clearance_mm
    needed = clearance + max(
        dimensions.yoke_radius_mm + COLUMN_DEPTH_MM / 2, dimensions.holder_reach_mm + FLANGE_LENGTH_MM / 2
    )
    if reach < needed:
        back = np.array([x, y]) / reach if reach > 0 else np.array([1.0, 0.0])
        better = origin[:2] - needed * back
        raise ValueError(
            f"mount.base_anchor_mm = {dimensions.mount.base_anchor_mm}: expected an anchor at least {needed:.1f} mm "
            f"from the pan axis, such as ({better[0]:.1f}, {better[1]:.1f}, {anchor[2]:g}), so that the column clears "
            f"the turning yoke by {clearance:g} mm; got {reach:.1f} mm"
        )
    lowest = dimensions.foot_top_mm + GUSSET_MM + dimensions.mount.wall_mm
    if height < lowest:
        raise ValueError(
            f"mount.base_anchor_mm = {dimensions.mount.base_anchor_mm}: expected an anchor above z = "
            f"{origin[2] + lowest:.1f}, where the gimbal's foot is, got z = {anchor[2]:g}"
        )
    pose = Pos(*origin) * Rot(0, 0, degrees(atan2(y, x)))
    return BaseStance(body_from_base=pose, reach_mm=reach, height_mm=height)


def gimbal_base_solid(dimensions: GimbalDimensions, stance: BaseStance) -> Solid:
    """Solid of the gimbal base in the body frame, millimetres."""
    base = _side_view(dimensions, stance) + _flange(dimensions, stance) + _servo_block(dimensions)
    base -= _servo_opening(dimensions)
    solid = one_solid(base, "gimbal_base", "look at mount.base_anchor_mm")
    return stance.body_from_base * solid


def pan_servo_in_body(dimensions: GimbalDimensions, stance: BaseStance, servo: Solid) -> Solid:
    """Pan servo in the body frame: shaft up on the pan axis, case towards the column."""
    return stance.body_from_base * Pos(0, 0, dimensions.pan_horn_mm) * servo


def _side_view(d: GimbalDimensions, stance: BaseStance) -> Part:
    """Column and foot as one L, with a gusset in its corner and the outer corner cut."""
    back, front = -stance.reach_mm - COLUMN_DEPTH_MM / 2, -stance.reach_mm + COLUMN_DEPTH_MM / 2
    top, bottom = d.foot_top_mm, d.foot_top_mm - FOOT_HEIGHT_MM
    joint = _servo_ends(d)[0] + EAR_LENGTH_MM
    outline = [
        (back, stance.height_mm),
        (back, bottom + GUSSET_MM),
        (back + GUSSET_MM, bottom),
        (joint, bottom),
        (joint, top),
        (front + GUSSET_MM, top),
        (front, top + GUSSET_MM),
        (front, stance.height_mm),
    ]
    half = COLUMN_WIDTH_MM / 2
    beam = along_y(outline, (-half, half))
    upright = beam.edges().filter_by(lambda edge: abs(edge.tangent_at(0.5).Z) > 0.99 and edge.length > GUSSET_MM * 2)
    return beam.fillet(half / 2, upright)


def _flange(d: GimbalDimensions, stance: BaseStance) -> Part:
    """Plate under the hull with four holes, and flares that lead its load into the column."""
    x, top = -stance.reach_mm, stance.height_mm
    low = top - d.mount.wall_mm
    half_length, half_width = FLANGE_LENGTH_MM / 2, FLANGE_WIDTH_MM / 2
    plate = box((x - half_length, x + half_length), (-half_width, half_width), (low, top))
    plate = plate.fillet(5, plate.edges().filter_by(lambda edge: abs(edge.tangent_at(0.5).Z) > 0.5))
    for dx in (-FLANGE_HOLES_MM[0], FLANGE_HOLES_MM[0]):
        for y in (-FLANGE_HOLES_MM[1], FLANGE_HOLES_MM[1]):
            plate -= cylinder((x + dx, y, low - 1), (x + dx, y, top + 1), FLANGE_HOLE_DIAMETER_MM / 2)
    thin, thick = COLUMN_WIDTH_MM / 2 - 1, COLUMN_WIDTH_MM / 2 + 4
    flare = [(-thin, low - 12), (thin, low - 12), (thick, low), (thick, top), (-thick, top), (-thick, low)]
    return plate + along_x(flare, (x - COLUMN_DEPTH_MM / 2 + 4, x + COLUMN_DEPTH_MM / 2 - 4))


def _servo_ends(d: GimbalDimensions) -> tuple[float, float]:
    far, near = case_ends(d.servos.pan)
    return far - EAR_LENGTH_MM - EAR_MARGIN_MM, near + EAR_LENGTH_MM + EAR_MARGIN_MM


def _servo_block(d: GimbalDimensions) -> Part:
    half = d.servos.pan.size_mm[1] / 2 + FIT_MM + d.mount.wall_mm
    top = d.foot_top_mm
    block = box(_servo_ends(d), (-half, half), (top - FOOT_HEIGHT_MM, top))
    return block.fillet(4, block.edges().filter_by(lambda edge: abs(edge.tangent_at(0.5).Z) > 0.5))


def _servo_opening(d: GimbalDimensions) -> Part:
    """Where the pan servo's case hangs through the foot, with pilot holes for the screws of its ears."""
    servo = d.servos.pan
    far, near = case_ends(servo)
    half = servo.size_mm[1] / 2 + FIT_MM
    top, bottom = d.foot_top_mm + 1, d.foot_top_mm - FOOT_HEIGHT_MM - 1
    opening = box((far - FIT_MM, near + FIT_MM), (-half, half), (bottom, top))
    for x in ear_hole_positions(servo):
        opening += cylinder((x, 0, top - 11), (x, 0, top), EAR_PILOT_DIAMETER_MM / 2)
    return opening
