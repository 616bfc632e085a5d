"""Where the fold bracket stands: its seat on the hull, its roof, and the corners of M1's cell.

Everything is in the fold frame (`optics.layout`): x along the camera's view, and the hull always below the roof and M2
below M1. So one bracket serves cameras that look anywhere, and fold down or up. The roof is level there; a pedestal
leads from it down to the flange, which may slope, and two girders lead from the pedestal to M1's cell, aslant where the
anchor is not in the plane of the camera's view and the fold.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from math import atan2, degrees, hypot

import numpy as np
from build123d import Location, Rot
from scipy.spatial.transform import RigidTransform, Rotation

from cad.parts.contact import CylinderContact
from cad.parts.flange import BOLT_HEAD_DIAMETER_MM, Seat, bolt_places, fold_seat, lies_along_body
from cad.parts.mirrors import Fixing, tray_depth_mm, tray_foot_mm, tray_half_width_mm, tray_head_mm
from cad.shapes import Limits, location_mm
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import FoldMirror, Mount, Rig
from rigs.catalogue import MATERIALS

ALIGNMENT_MM = 0.5
BOSS_WALL_MM = 3.0
"""Of the pedestal around a bolt, or around its head where that is in the pedestal."""
ROOF_CORNER_MM = 6.0
"""Radius of the pedestal's upright edges; girders begin behind them, in its sides."""
KEY_HOLE_WALL_MM = 4.0
"""Of the roof around a hole for bolt and key."""
STEEPEST_DEG = 60.0
"""Between the hull's normal and the roof's: beyond it the flange is twice as long as what is seen of it from above."""
FLATTEST_DEG = 10.0
LONGEST_GRIP_MM = 25.0
"""Up to this slope and height over the flange bolts go through the roof; else their heads are in the pedestal."""
LARGEST_RISE_MM = 150.0
"""Of the roof over the flange: a taller pedestal is a tower."""
STEEPEST_GIRDER = 1.5
"""How far a girder goes sideways for what it goes ahead: some 56 degrees."""
SMALLEST_HALF_WIDTH_MM = 25.0
SMALLEST_GIRDER_MM = 16.0
SLENDEREST_GIRDER = 7.0
"""Length of the girders in their depth: longer ones twist when M1's cell is pushed sideways."""
FLOW_PA = 1000.0
"""On M1, broadside on, at 1 m/s: 1.98 (`cad.loads.plate`) of the dynamic pressure."""
LARGEST_TURN_DEG = 1.2
"""By which that flow would turn M1 were there girders alone from the anchor to it. They are shorter, but not all that
bends: by cubes of 2 mm aqua2's, bluerov2's and torpedo's brackets turn by 0.4 to 0.8 degrees."""
WEB_NOZZLES = 6.25
"""Thickness of webs, six lines of a nozzle: three from either side, each 1.125 of it wide, which overlap. What is
between them in a thicker web is filled with short strokes, which takes longer than all six lines."""
BRACE_MM = 6.0
"""Depth of the braces between the girders, from the roof."""
OVER_HULL_MM = 2.0
"""Between the girders and the highest point of the hull under the flange."""
ROOF_SHARE = 0.45
"""Of the cell's depth along the roof: how far the roof goes beyond the cell's upper corner."""


@dataclass(frozen=True, kw_only=True)
class BracketPlacement:
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
    girder_mm : float
        Depth of the girders under it, the roof's own wall included.
    keys_through_roof : bool
        Whether the flange's bolts and their key come through holes in the roof.
    flange_turn_deg : float
        From x to the flange's length, seen from above; other than 0 where the flange has to lie along the body and the
        camera looks elsewhere.
    hinged : bool
        Whether it is the deck of a hinge (`joints.stow`).
    """

    body_from_fold: RigidTransform
    fold_from_m1: RigidTransform
    mirror: FoldMirror
    mount: Mount
    seat: Seat
    roof_mm: float
    girder_mm: float
    keys_through_roof: bool = False
    flange_turn_deg: float = 0.0
    hinged: bool = False

    @property
    def wall_mm(self) -> float:
        """Wall of the mount."""
        return self.mount.wall_mm

    @property
    def web_mm(self) -> float:
        """Thickness of girders, braces, ribs and of the pedestal's walls: of lines without infill between them."""
        return min(self.wall_mm, WEB_NOZZLES * self.mount.nozzle_mm)

    @property
    def cell_wall_mm(self) -> float:
        """Floor of M1's cell: on a hinge it also holds the arm's plates together."""
        return self.wall_mm if self.hinged else self.web_mm

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
        """The plane of symmetry of M1's cell, which is the camera's."""
        return float(1000 * self.fold_from_m1.translation[1])

    @property
    def roof_low_mm(self) -> float:
        """Height of the roof's inner face."""
        return self.roof_mm - self.wall_mm

    @property
    def pedestal_mm(self) -> tuple[Limits, Limits]:
        """Limits along x and y of what stands on the hull: the flange, and where keys come through the roof to it."""
        corners = np.vstack([flange_corners_mm(self.seat)[:, :2], self._key_holes_mm()])
        low, high = corners.min(axis=0), corners.max(axis=0)
        return (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))

    @property
    def pocket_sides_mm(self) -> tuple[Limits, Limits]:
        """Limits along and across the flange of what stands on it, in axes turned about z by `flange_turn_deg`."""
        if not self.flange_turn_deg:
            return self.pedestal_mm
        turn = Rotation.from_euler("z", -self.flange_turn_deg, degrees=True)
        corners = turn.apply(flange_corners_mm(self.seat))
        low, high = corners.min(axis=0), corners.max(axis=0)
        return (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))

    @property
    def rear_mm(self) -> float:
        """Rear end of flange and roof."""
        return self.pedestal_mm[0][0]

    @property
    def girders_from_mm(self) -> float:
        """Where the girders begin, in the pedestal's sides."""
        return self.pedestal_mm[0][1] - ROOF_CORNER_MM

    @property
    def roof_front_mm(self) -> float:
        """Front end of the roof, over M1's cell; a flange that is over it too makes it longer."""
        return max(self.over_cell_mm, self.pedestal_mm[0][1])

    @property
    def over_cell_mm(self) -> float:
        """How far the roof goes to brace M1's cell."""
        upper, lower = self.upper_mm[0], self.lower_mm[0]
        return upper + ROOF_SHARE * (lower - upper)

    @property
    def tray_half_width_mm(self) -> float:
        """Half of the cell's width."""
        return tray_half_width_mm(self.mirror)

    def _key_holes_mm(self) -> FloatArray:
        """Corners of what is around the holes over heads that are in the pedestal, in the roof, shape (8 or 0, 2)."""
        if not self.keys_through_roof:
            return np.empty((0, 2))
        # An oblique cut through a cylinder is longer the way it leans.
        leaning = self.seat.normal[:2] / self.seat.normal[2]
        half = BOLT_HEAD_DIAMETER_MM / 2 * np.sqrt(1 + leaning**2) + KEY_HOLE_WALL_MM
        heads = _heads_mm(self.seat)
        holes = heads[:, :2] + (self.roof_mm - heads[:, 2:]) * leaning
        return np.vstack([holes - half, holes + half])

    @property
    def _cell_back_mm(self) -> float:
        """Level of the cell's back along M1's normal."""
        return -tray_depth_mm(self.mirror, self.cell_wall_mm)

    @property
    def upper_mm(self) -> tuple[float, float]:
        """Upper corner of the cell's back, as (x, z)."""
        return self.in_side_view(tray_foot_mm(self.mirror), self._cell_back_mm)

    @property
    def lower_mm(self) -> tuple[float, float]:
        """Lower corner of the cell's back, as (x, z)."""
        return self.in_side_view(
            -tray_head_mm(self.mirror, self.fixing), -tray_depth_mm(self.mirror, self.cell_wall_mm)
        )

    @property
    def fold_from_cell(self) -> Location:
        """Pose of M1's cell, which opens downwards: over its upper edge is the roof, and the mirror slides in."""
        return location_mm(self.fold_from_m1) * Rot(0, 0, 180)

    def in_side_view(self, up_mm: float, out_mm: float) -> tuple[float, float]:
        """Point of M1's frame, up its face and along its normal, as (x, z) of the fold frame."""
        x, _, z = 1000 * self.fold_from_m1.apply(np.array([0.0, up_mm, out_mm]) / 1000)
        return float(x), float(z)

    def in_body_mm(self, x: float, y: float, z: float) -> FloatArray:
        """Point of the fold frame in the body frame."""
        return np.asarray(1000 * self.body_from_fold.apply(np.array([x, y, z]) / 1000))

    def in_words(self, x: float, y: float, z: float) -> str:
        """Point of the fold frame as the rig file has it."""
        return "(" + ", ".join(f"{value:.1f}" for value in np.round(self.in_body_mm(x, y, z), 1) + 0.0) + ")"


def bracket_placement(rig: Rig, layout: Layout) -> BracketPlacement:
    """Numbers of a rig's fold bracket.

    Raises
    ------
    ValueError
        When the hull carries no flange at the anchor or slopes too much there, or when the anchor is too low, too far
        forward or too far to the side for M1.
    """
    gaze = rig.require_gaze()
    body_from_fold = layout.body_from_fold
    seat = fold_seat(rig).moved(body_from_fold.inv())
    place = f"mount.fold_anchor_mm = {gaze.mount.fold_anchor_mm}"
    _check_slope(seat, body_from_fold, place)
    fold_from_m1 = body_from_fold.inv() * layout.body_from_m1
    flat = BracketPlacement(
        body_from_fold=body_from_fold,
        fold_from_m1=fold_from_m1,
        mirror=gaze.fold_mirror,
        mount=gaze.mount,
        seat=seat,
        roof_mm=0.0,
        girder_mm=gaze.mount.wall_mm,
        flange_turn_deg=_flange_turn_deg(rig, body_from_fold),
        hinged=gaze.joints.stow is not None,
    )
    # A hinge's deck has its stiffeners over the roof, where the arm does not swing.
    girder = gaze.mount.wall_mm if flat.hinged else _girder_mm(flat)
    roof = _roof(flat, girder)
    placement = _bolted(replace(flat, roof_mm=roof, girder_mm=girder))
    refusal = _refusal(placement)
    if refusal:
        raise ValueError(f"{place}: {refusal}")
    return placement


def flange_corners_mm(seat: Seat) -> FloatArray:
    """Corners of the box around a flange, in the frame the seat is given in, shape (8, 3)."""
    low, high = seat.contact.range_mm[0], seat.height_mm
    sides = product((-seat.length_mm / 2, seat.length_mm / 2), (-seat.width_mm / 2, seat.width_mm / 2), (low, high))
    return np.asarray(1000 * seat.body_from_seat.apply(np.array(list(sides)) / 1000))


def _heads_mm(seat: Seat) -> FloatArray:
    """Undersides of the bolts' heads on a flange, in the frame the seat is given in, shape (4, 3)."""
    places = np.array([[x, y, seat.height_mm] for x, y in bolt_places()])
    return np.asarray(1000 * seat.body_from_seat.apply(places / 1000))


def _girder_mm(placement: BracketPlacement) -> float:
    """Depth of the girders: enough against flow on M1, and a share of their length to the far end over the cell.

    Two webs of thickness t and depth h turn by 6 F l^2 / (E t h^3) where a force F acts at a lever as long as they are.
    """
    x, y, _ = placement.anchor_mm
    length = hypot(placement.over_cell_mm - x, placement.y_mm - y)
    force = FLOW_PA * placement.mirror.width_mm * placement.mirror.height_mm / 1e6
    lever = float(np.linalg.norm(placement.fold_from_m1.translation - placement.anchor_mm / 1000))
    modulus = MATERIALS[placement.mount.material].youngs_modulus_pa
    cubed = 6 * force * lever**2 / (modulus * placement.web_mm / 1000 * np.radians(LARGEST_TURN_DEG))
    return max(SMALLEST_GIRDER_MM, length / SLENDEREST_GIRDER, 1000 * float(np.cbrt(cubed)))


def _roof(placement: BracketPlacement, girder_mm: float) -> float:
    """Height of the roof's outer face: over the flange, and girders over the hull and over M1's cell."""
    seat = placement.seat
    # A saddle is round: its crest is highest.
    sides = (0.0,) if isinstance(seat.contact, CylinderContact) else (-seat.width_mm / 2, seat.width_mm / 2)
    ends = (-seat.length_mm / 2, seat.length_mm / 2)
    levels = [placement.upper_mm[1] + girder_mm]
    beyond = OVER_HULL_MM + girder_mm if girder_mm > seat.wall_mm else seat.wall_mm
    for height, over in ((seat.height_mm, 0.0), (seat.contact.range_mm[1], beyond)):
        corners = np.array([[end, side, height] for end in ends for side in sides])
        levels.append(float(1000 * seat.body_from_seat.apply(corners / 1000)[:, 2].max()) + over)
    return max(levels)


def _bolted(placement: BracketPlacement) -> BracketPlacement:
    """Placement with bolts through a roof that is near and parallel, else with holes in it for bolts and their key."""
    seat, heads, upright = placement.seat, _heads_mm(placement.seat), float(placement.seat.normal[2])
    if seat.attachment != "screws":
        return placement
    standing = (placement.roof_mm - heads[:, 2].max()) / upright
    if upright > np.cos(np.radians(FLATTEST_DEG)) and 0 < standing <= LONGEST_GRIP_MM:
        return replace(placement, seat=replace(seat, standing_mm=standing))
    beyond = BOLT_HEAD_DIAMETER_MM * np.tan(np.arccos(upright)) + 1
    room = float((placement.roof_mm - heads[:, 2].min()) / upright + beyond)
    if placement.hinged:
        # The deck's rails stand on the roof, over the heads as well.
        room = max(room, seat.head_room_mm)
    holed = replace(placement, seat=replace(seat, head_room_mm=room), keys_through_roof=True)
    # On a steep nose they would be in M1's cell: there keys come in under the roof, if at all.
    return placement if _refusal(holed) else holed


def _flange_turn_deg(rig: Rig, body_from_fold: RigidTransform) -> float:
    if not lies_along_body(rig, "fold"):
        return 0.0
    x, y, _ = body_from_fold.rotation.inv().apply([1.0, 0.0, 0.0])
    return round(degrees(atan2(y, x)), 6)


def _check_slope(seat: Seat, body_from_fold: RigidTransform, place: str) -> None:
    steep = float(np.degrees(np.arccos(np.clip(seat.normal[2], -1, 1))))
    if steep > STEEPEST_DEG:
        roof = np.round(body_from_fold.rotation.apply([0, 0, 1]), 3)
        words = {1.0: "up", -1.0: "down"}.get(float(roof[2]), f"{tuple((roof + 0.0).tolist())}, where M1's roof faces")
        raise ValueError(
            f"{place}: expected a hull whose normal is within {STEEPEST_DEG:g} degrees of {words}, got {steep:.0f} "
            "degrees"
        )


def _refusal(placement: BracketPlacement) -> str:
    """Why the anchor does not suit M1, with one that would, body frame; empty when it does."""
    x, y, z = placement.anchor_mm
    front = placement.pedestal_mm[0][1]
    rise = placement.roof_mm - float(flange_corners_mm(placement.seat)[:, 2].max())
    if rise > LARGEST_RISE_MM:
        return (
            f"expected an anchor such as {placement.in_words(x, y, z + rise - LARGEST_RISE_MM)}, so that the roof "
            f"over M1's cell is at most {LARGEST_RISE_MM:g} mm off the flange, not {rise:.1f} mm"
        )
    # A flange over the cell must leave M1 its light.
    over_cell = float(flange_corners_mm(placement.seat)[:, 2].min()) > placement.upper_mm[1]
    furthest = placement.lower_mm[0] if over_cell and abs(y - placement.y_mm) <= ALIGNMENT_MM else placement.upper_mm[0]
    if front > furthest:
        return (
            f"expected an anchor such as {placement.in_words(x - front + furthest, y, z)}, where the flange is behind "
            f"{'the front' if furthest == placement.lower_mm[0] else 'the upper edge'} of M1's cell, not "
            f"{front - furthest:.1f} mm ahead of it"
        )
    beside, room = y - placement.y_mm, max(STEEPEST_GIRDER * (placement.upper_mm[0] - front), ALIGNMENT_MM)
    if abs(beside) > room:
        nearest = placement.in_words(x, placement.y_mm + float(np.clip(beside, -room, room)), z)
        return (
            f"expected an anchor at most {room:.1f} mm beside the camera's view, such as {nearest}, so that the "
            f"girders reach M1's cell from there, not {abs(beside):.1f} mm"
        )
    return ""
