"""Design rules of the gimbal: where it is rounded, where air gets out, how long the cable must be."""

from __future__ import annotations

from math import hypot, sqrt

import cv2
import manifold3d
import numpy as np
import pytest
from build123d import Axis, GeomType
from scipy.ndimage import label

from cad.checks.sequence.screw_keys import KEYS_MM
from cad.overlaps import manifold_mm
from cad.parts.cable import free_cable_mm, yoke_tie_mm
from cad.parts.gimbal_base import (
    COLUMN_DEPTH_MM,
    CORNER_MM,
    base_placement,
    flange_seat,
    gimbal_base_solid,
    tie_on_beam_mm,
)
from cad.parts.gimbal_dimensions import PAN_BUSHING, GimbalDimensions
from cad.parts.hardware import INSERT_RELIEF_MM, insert, nominal_diameter_mm
from cad.parts.servo import HORN_SCREW, ear_hole_positions
from cad.parts.yoke import ROOT_FILLET_MM
from cad.shapes import SMALLEST_FILLET_MM, box, filleted
from optics.layout import Layout
from optics.mesh import Group
from rigs import Rig

PITCH_MM = 0.5
ROUND_CELLS = 1.2
"""By how much cells of half a millimetre make a hole of 3 mm larger: (3.3 / 3)²."""


def rounded(solid, radius_mm, along):
    """Length of the fillets of a radius whose axis has a direction."""
    return [
        face.area / (np.pi / 2 * radius_mm)
        for face in solid.faces().filter_by(GeomType.CYLINDER)
        if face.radius is not None
        and abs(face.radius - radius_mm) < 1e-6
        and abs(abs(np.array(tuple(face.axis_of_rotation.direction)) @ along) - 1) < 1e-6
    ]


def test_the_arms_and_the_column_grow_out_of_fillets(built):
    dimensions = GimbalDimensions.from_rig(built.rig)
    roots = rounded(built.part("yoke").solid, ROOT_FILLET_MM, np.array([1.0, 0, 0]))
    assert sum(roots) == pytest.approx(2 * 2 * dimensions.arm_half_width_mm, rel=0.05)
    layout = built.layout
    placement = base_placement(dimensions, layout)
    across = np.array(tuple((placement.body_from_base * Axis.Y.location).z_axis.direction))
    assert rounded(built.part("gimbal_base").solid, CORNER_MM, across) != []


@pytest.mark.parametrize("slope_deg", [38.0, 55.0])
def test_the_column_meets_a_steep_hull_under_its_whole_width(slope_deg):
    """One solid, which nowhere stands out of the plane under the flange, and is in it on both sides of the column."""
    slope = np.radians(slope_deg)
    normal = np.array([np.sin(slope), 0.0, -np.cos(slope)])
    rig = Rig.load("bluerov2")
    rig = rig.with_gaze(mount={"base_plane": None, "base_normal": tuple(normal.tolist())})
    dimensions = GimbalDimensions.from_rig(rig)
    placement = base_placement(dimensions, Layout.from_rig(rig))
    base = gimbal_base_solid(dimensions.foot, placement, flange_seat(rig, placement))
    heights = [(np.array(tuple(v)) - rig.gaze.mount.base_anchor_mm) @ normal for v in base.vertices()]
    assert min(heights) == pytest.approx(0, abs=1e-6)
    across = [v.X for v, height in zip(base.vertices(), heights, strict=True) if height < 1e-6]
    assert max(across) - min(across) > COLUMN_DEPTH_MM


def test_a_fillet_that_does_not_fit_is_made_smaller_by_quarters_and_never_left_out():
    """On an edge between faces 5 mm wide, 6 mm cannot be made and 0.75 x 6 = 4.5 mm can."""
    bar = box((0, 20), (0, 5), (0, 5))
    edge = bar.edges().filter_by(Axis.X).sort_by(lambda e: e.center().Y + e.center().Z)[-1:]
    made = filleted(bar, edge, 6.0, "bar")
    assert made.volume == pytest.approx(20 * (25 - 4.5**2 * (1 - np.pi / 4)), rel=1e-9)
    sheet = box((0, 20), (0, SMALLEST_FILLET_MM / 2), (0, 5))
    edge = sheet.edges().filter_by(Axis.X).sort_by(lambda e: e.center().Y + e.center().Z)[-1:]
    with pytest.raises(ValueError, match="sheet: expected room for a fillet of at least 1 mm"):
        filleted(sheet, edge, 6.0, "sheet")


def around_the_pan_axis(built):
    """What is near the pan axis at q = 0 as filled cells of PITCH_MM, in the pan frame, indexed [z, y, x]."""
    layout, d = built.layout, GimbalDimensions.from_rig(built.rig)
    from_body = layout.body_from_pan(0).inv()
    near = []
    for mesh in built.meshes:
        if mesh.name.startswith(("pan_", "gimbal_base", "yoke")):
            pose = from_body if mesh.group is Group.FIXED else from_body * layout.body_from_pan(0)
            matrix = pose.as_matrix()[:3].copy()
            matrix[:, 3] *= 1000
            near.append(manifold_mm(mesh).transform(matrix))
    whole = manifold3d.Manifold.batch_boolean(near, manifold3d.OpType.Add)
    half = PAN_BUSHING.flange_mm / 2 + 6
    levels = np.arange(d.pan_ledge_mm - 12, d.yoke_floor_mm + 3, PITCH_MM)
    side = int(2 * half / PITCH_MM)
    filled = np.zeros((len(levels), side, side), dtype=np.uint8)
    for layer, level in zip(filled, levels, strict=True):
        outlines = [
            np.round((outline + half) / PITCH_MM).astype(np.int32) for outline in whole.slice(level).to_polygons()
        ]
        if outlines:
            cv2.fillPoly(layer, outlines, 1)
    return filled.astype(bool)


def trapped_mm3(filled, axis, up):
    """Volume of the cells from which no path that never descends leads out of the box."""
    layers = np.moveaxis(filled, axis, 0)
    layers = layers[::-1] if up > 0 else layers
    above, trapped = np.ones(layers.shape[1:], dtype=bool), 0
    for layer in layers:
        pools, count = label(~layer)
        free = np.zeros(count + 1, dtype=bool)
        free[np.unique(pools[above & ~layer])] = True
        for rim in (pools[0], pools[-1], pools[:, 0], pools[:, -1]):
            free[np.unique(rim)] = True
        free[0] = False
        above = free[pools]
        trapped += np.count_nonzero(~layer & ~above)
    return trapped * PITCH_MM**3


def pockets_mm3(built):
    """Sockets of the pan servo's and its horn's screws, the end of the shaft's thread, and the relief of inserts."""
    servo = built.rig.gaze.servos.pan
    holes = len(ear_hole_positions(servo))
    size = insert(servo.ear_screw)
    relief = np.pi / 4 * size.hole_diameter_mm**2 * INSERT_RELIEF_MM
    threads = [HORN_SCREW] * 4 + [servo.ear_screw] * holes + [servo.shaft_screw]
    # ISO 4762: socket half as deep as the thread is wide; width across flats of the key.
    sockets = [3**0.5 / 2 * KEYS_MM[nominal_diameter_mm(t)][0] ** 2 * nominal_diameter_mm(t) / 2 for t in threads]
    return holes * relief + sum(sockets) + np.pi / 4 * (nominal_diameter_mm(servo.shaft_screw) + 0.2) ** 2 / 2


@pytest.mark.parametrize(("axis", "up"), [(0, 1), (0, -1), (1, 1), (1, -1), (2, 1), (2, -1)])
def test_no_air_stays_around_the_pan_axis_in_any_attitude(built, axis, up):
    """Rationale: servo, foot, bushing, hub and horn enclose rooms; air is light and leaves only upwards or level.

    Expectation: of cells of half a millimetre, in which running fits are closed, none holds air but in screws' sockets.
    """
    assert trapped_mm3(around_the_pan_axis(built), axis, up) < ROUND_CELLS * pockets_mm3(built)


def test_the_cable_between_its_ties_reaches_over_the_pan_range(built):
    """Against the two ties as points: the furthest they come apart is where the pan range turns them furthest."""
    d, layout = GimbalDimensions.from_rig(built.rig), built.layout
    base = tie_on_beam_mm(d.foot, base_placement(d, layout))
    limits = (layout.pan.min_deg, layout.pan.max_deg)
    length = free_cable_mm(d, base, limits)
    yoke, height = yoke_tie_mm(d), d.yoke_bottom_mm - d.foot_top_mm
    furthest = np.radians(90 + max(abs(limits[0]), abs(limits[1])))
    chord = sqrt((yoke * np.cos(furthest) - base) ** 2 + (yoke * np.sin(furthest)) ** 2)
    assert length == pytest.approx(hypot(chord, height), abs=1e-9)
    assert length < yoke + base + height
