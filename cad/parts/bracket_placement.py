"""Where the fold bracket stands: its seat on the hull, its roof, and the corners of M1's cell.

Everything is in the fold frame: the body's, but for a rig that folds up turned by half a turn about the camera's axis.
So one bracket serves both: in the fold frame the hull is always below the roof and M2 below M1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from build123d import Location, Rot
from scipy.spatial.transform import RigidTransform, Rotation

from cad.parts.flange import Seat, fold_seat
from cad.parts.mirrors import Fixing, tray_depth_mm, tray_foot_mm, tray_half_width_mm, tray_head_mm
from cad.shapes import location_mm
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import FoldMirror, Mount, Rig

ALIGNMENT_MM = 0.5
STEEPEST_DEG = 35.0
"""Between the hull's normal and the roof's: beyond it the wedge between the two is a tower."""
SMALLEST_HALF_WIDTH_MM = 25.0


@dataclass(frozen=True, kw_only=True)
class FoldStance:
    """Numbers of a fold bracket, in the fold frame.

    Attributes
    ----------
    body_from_fold : RigidTransform
        Pose of the fold frame.
    fold_from_m1 : RigidTransform
        Pose of M1, metres.
    mirror : FoldMirror
    mount : Mount
    seat : Seat
        Where the flange lies.
    roof_mm : float
        Height of the roof's outer face.
    """

    body_from_fold: RigidTransform
    fold_from_m1: RigidTransform
    mirror: FoldMirror
    mount: Mount
    seat: Seat
    roof_mm: float

    @property
    def wall_mm(self) -> float:
        """Wall of the mount."""
        return self.mount.wall_mm

    @property
    def fixing(self) -> Fixing:
        """How M1 is held."""
        return self.mount.mirror_fixing

    @property
    def anchor_mm(self) -> FloatArray:
        """Anchor, shape (3,)."""
        return np.asarray(1000 * self.seat.body_from_seat.translation)

    @property
    def y_mm(self) -> float:
        """The plane of symmetry, which is the camera's."""
        return float(1000 * self.fold_from_m1.translation[1])

    @property
    def roof_low_mm(self) -> float:
        """Height of the roof's inner face."""
        return self.roof_mm - self.wall_mm

    @property
    def rear_mm(self) -> float:
        """Rear end of flange and roof."""
        return float(self.anchor_mm[0]) - self.seat.length_mm / 2

    @property
    def tray_half_width_mm(self) -> float:
        """Half of the cell's width."""
        return tray_half_width_mm(self.mirror)

    @property
    def half_width_mm(self) -> float:
        """Half of the roof's width: of the wider of flange and cell."""
        return max(self.tray_half_width_mm, SMALLEST_HALF_WIDTH_MM)

    @property
    def upper_mm(self) -> tuple[float, float]:
        """Upper corner of the cell's back, as (x, z)."""
        return self.in_side_view(tray_foot_mm(self.mirror), -tray_depth_mm(self.mirror, self.wall_mm))

    @property
    def lower_mm(self) -> tuple[float, float]:
        """Lower corner of the cell's back, as (x, z)."""
        return self.in_side_view(-tray_head_mm(self.mirror, self.fixing), -tray_depth_mm(self.mirror, self.wall_mm))

    @property
    def fold_from_cell(self) -> Location:
        """Pose of M1's cell, which opens downwards: over its upper edge is the roof, and the mirror slides in."""
        return location_mm(self.fold_from_m1) * Rot(0, 0, 180)

    def in_side_view(self, up_mm: float, out_mm: float) -> tuple[float, float]:
        """Point of M1's frame, up its face and along its normal, as (x, z) of the fold frame."""
        x, _, z = 1000 * self.fold_from_m1.apply(np.array([0.0, up_mm, out_mm]) / 1000)
        return float(x), float(z)


def fold_stance(rig: Rig, layout: Layout) -> FoldStance:
    """Numbers of a rig's fold bracket.

    Raises
    ------
    ValueError
        When the anchor is beside the camera's vertical plane, not above M1, too far forward, or on too steep a hull.
    """
    gaze = rig.require_gaze()
    body_from_fold = fold_frame(layout)
    seat = fold_seat(rig).moved(body_from_fold.inv())
    stance = FoldStance(
        body_from_fold=body_from_fold,
        fold_from_m1=body_from_fold.inv() * layout.body_from_m1,
        mirror=gaze.fold_mirror,
        mount=gaze.mount,
        seat=seat,
        roof_mm=_roof(seat),
    )
    _check(stance, f"mount.fold_anchor_mm = {gaze.mount.fold_anchor_mm}")
    return stance


def fold_frame(layout: Layout) -> RigidTransform:
    """Pose of the fold frame in the body: the identity for a fold down, half a turn about the camera's axis for up."""
    if layout.fold_direction[1] > 0:
        return RigidTransform.identity()
    pinhole = layout.body_from_camera.translation
    turn = Rotation.from_rotvec(np.pi * layout.body_from_camera.rotation.apply([0, 0, 1]))
    return RigidTransform.from_components(pinhole - turn.apply(pinhole), turn)


def _roof(seat: Seat) -> float:
    """Height of the roof's outer face: not below the flange's, and a wall above the highest point of the contact."""
    # The roof is as long as the flange, but level: it reaches further along the slope.
    slope = max(float(seat.normal[2]), 0.1)
    half_length, half_width = seat.length_mm / 2 / slope, seat.width_mm / 2 / slope
    # A saddle is round: its crest is highest.
    sides = (0.0,) if seat.strapped else (-half_width, half_width)
    levels = []
    for height, over in ((seat.height_mm, 0.0), (seat.contact.range_mm[1], seat.wall_mm)):
        corners = np.array([[end, side, height] for end in (-half_length, half_length) for side in sides])
        levels.append(float(1000 * seat.body_from_seat.apply(corners / 1000)[:, 2].max()) + over)
    return max(levels)


def _check(stance: FoldStance, place: str) -> None:
    """Compare the anchor with M1; numbers in messages are those of the body frame, as in the rig file."""
    x, y, _ = stance.anchor_mm
    side = float(stance.body_from_fold.rotation.apply([0, 0, 1])[2])
    if abs(y - stance.y_mm) > ALIGNMENT_MM:
        here, wanted = (1000 * stance.body_from_fold.apply(np.array([x, v, 0]) / 1000)[1] for v in (y, stance.y_mm))
        raise ValueError(f"{place}: expected y = {wanted:g}, as the camera has, got y = {here:g}")
    steep = float(np.degrees(np.arccos(np.clip(stance.seat.normal[2], -1, 1))))
    if steep > STEEPEST_DEG:
        raise ValueError(
            f"{place}: expected a hull whose normal is within {STEEPEST_DEG:g} degrees of "
            f"{'up' if side > 0 else 'down'}, got {steep:.0f} degrees"
        )
    if stance.roof_low_mm < stance.upper_mm[1]:
        room = stance.upper_mm[1] - stance.roof_low_mm
        low, high = (
            1000 * stance.body_from_fold.apply(np.array([x, y, z]) / 1000)[2]
            for z in (stance.anchor_mm[2], stance.anchor_mm[2] + room)
        )
        raise ValueError(
            f"{place}: expected z of at {'least' if side > 0 else 'most'} {high:.1f}, beyond M1's cell, so that the "
            f"roof clears it, got z = {low:g}"
        )
    if x + stance.seat.length_mm / 2 > stance.lower_mm[0]:
        raise ValueError(
            f"{place}: expected x of at most {stance.lower_mm[0] - stance.seat.length_mm / 2:.1f}, behind the front of "
            f"M1, got x = {x:g}"
        )
