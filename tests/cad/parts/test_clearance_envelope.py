"""The envelope beside a hull: against a wall at a known distance, and base anchors that move as little as they must."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import Manifold

from cad.overlaps import manifold_mm
from cad.parts.clearance_envelope import (
    ANCHOR_STEP_MM,
    HOLDER_ENVELOPE,
    LARGEST_MARGIN_MM,
    ON_HULL,
    STANDING,
    YOKE_ENVELOPE,
    envelope_margins_mm,
    with_standing_base,
)
from cad.parts.gimbal_base import base_placement
from cad.parts.gimbal_dimensions import GimbalDimensions
from optics.layout import Layout
from optics.mesh import Role
from rigs import Rig

CHORD_MM = 0.13
"""A cylinder of 64 sides lies at most this far inside a circle of 100 mm: 100 (1 - cos(pi / 64)) = 0.12."""


def changed(rig: Rig, section: str, **numbers: object) -> Rig:
    return rig.with_gaze(**{section: numbers})


def wall(rig: Rig, distance_mm: float, heights_mm: tuple[float, float]) -> Manifold:
    """A wall behind the gimbal, at a distance from the pan axis and between heights above the axes' crossing."""
    x, y, z = 1000 * Layout.from_rig(rig).body_from_gimbal.translation
    low, high = heights_mm
    return Manifold.cube((10, 600, high - low)).translate((x - distance_mm - 10, y - 300, z + low))


@pytest.mark.parametrize("margin", [3.0, 0.5, -1.0])
def test_a_wall_behind_the_yoke_leaves_what_it_leaves(margin):
    rig = Rig.load("bluerov2")
    dimensions = GimbalDimensions.from_rig(rig)
    # At the height of the yoke's plate, below the sphere of the holder.
    heights = (dimensions.yoke_bottom_mm, dimensions.yoke_bottom_mm + 2)
    distance = dimensions.yoke_radius_mm + rig.gaze.mount.clearance_mm + margin
    margins = envelope_margins_mm(rig, wall(rig, distance, heights))
    assert margin - 1e-6 <= margins[YOKE_ENVELOPE] <= margin + CHORD_MM
    assert margins[HOLDER_ENVELOPE] == LARGEST_MARGIN_MM


def test_a_wall_behind_the_holder_leaves_what_it_leaves():
    rig = Rig.load("bluerov2")
    dimensions = GimbalDimensions.from_rig(rig)
    top = dimensions.servo_arm_top_mm + rig.gaze.mount.clearance_mm + LARGEST_MARGIN_MM + 1
    # The nearest point of the wall is its lower edge: above the yoke, beside the sphere.
    across = np.sqrt((dimensions.holder_reach_mm + rig.gaze.mount.clearance_mm + 1.5) ** 2 - top**2)
    margins = envelope_margins_mm(rig, wall(rig, across, (top, top + 20)))
    assert 1.5 - 1e-6 <= margins[HOLDER_ENVELOPE] <= 1.5 + 2 * CHORD_MM  # chords both ways
    assert margins[YOKE_ENVELOPE] == LARGEST_MARGIN_MM


def test_what_is_in_the_hull_has_no_room():
    rig = Rig.load("aqua2")
    everywhere = Manifold.cube((2000, 2000, 2000), True)
    margins = envelope_margins_mm(rig, everywhere)
    assert margins[YOKE_ENVELOPE] == margins[HOLDER_ENVELOPE] == -rig.gaze.mount.clearance_mm


def test_presets_have_room_and_keep_their_anchors(built):
    hull = manifold_mm(next(mesh for mesh in built.meshes if mesh.role is Role.HULL))
    assert min(envelope_margins_mm(built.rig, hull).values()) > -CHORD_MM
    assert with_standing_base(built.rig) == built.rig


@pytest.mark.parametrize("name", ["aqua2", "bluerov2"])
def test_an_anchor_too_near_moves_just_far_enough(name):
    rig = Rig.load(name)
    x, y, z = rig.gaze.mount.base_anchor_mm
    near = changed(rig, "mount", base_anchor_mm=(x + 60, y, z))
    moved = with_standing_base(near)
    assert moved.gaze.mount.base_anchor_mm[1:] == (y, z)
    base_placement(GimbalDimensions.from_rig(moved), Layout.from_rig(moved))
    back = moved.gaze.mount.base_anchor_mm[0] + ANCHOR_STEP_MM
    too_near = changed(rig, "mount", base_anchor_mm=(back, y, z))
    with pytest.raises(ValueError, match="base_anchor_mm"):
        base_placement(GimbalDimensions.from_rig(too_near), Layout.from_rig(too_near))


def test_an_anchor_too_low_stays_refused():
    rig = Rig.load("aqua2")
    x, y, _ = rig.gaze.mount.base_anchor_mm
    low = changed(rig, "mount", base_anchor_mm=(x, y, -400.0))
    with pytest.raises(ValueError, match="base_anchor_mm"):
        with_standing_base(low)
    assert envelope_margins_mm(low, Manifold.cube((1, 1, 1)))[STANDING] < 0


def test_an_anchor_that_left_the_hull_is_named():
    rig = Rig.load("aqua2")
    x, y, z = rig.gaze.mount.base_anchor_mm
    slab = Manifold.cube((100, 100, 10)).translate((x - 100, y - 50, z))
    assert envelope_margins_mm(rig, slab)[ON_HULL] == LARGEST_MARGIN_MM
    assert envelope_margins_mm(rig, slab.translate((-3, 0, 0)))[ON_HULL] < 0


@pytest.mark.parametrize(("above_mm", "half_mm"), [(2.0, 14.0), (-2.0, 25.0)])
def test_a_flange_at_the_height_of_the_yoke_stands_beside_its_circle(above_mm, half_mm):
    """Closed form: half a column of 28 mm clears it where the flange is above the yoke, else half a flange of 50 mm.

    Its bolts' heads are 4 mm high, under a wall of the mount's thickness; a screw there hit the tilt servo.
    """
    rig = Rig.load("aqua2")
    d, mount = GimbalDimensions.from_rig(rig), rig.gaze.mount
    level = d.servo_arm_top_mm + mount.clearance_mm + mount.wall_mm + 4.0 + above_mm
    x, y, z = 1000 * Layout.from_rig(rig).body_from_gimbal.translation
    needed = mount.clearance_mm + max(d.yoke_radius_mm + half_mm, d.holder_reach_mm + 25.0)
    for reach, stands in ((needed - 0.1, False), (needed + 0.1, True)):
        moved = changed(rig, "mount", base_anchor_mm=(x - reach, y, z + level))
        if stands:
            assert base_placement(GimbalDimensions.from_rig(moved), Layout.from_rig(moved)).reach_mm == pytest.approx(
                reach
            )
        else:
            with pytest.raises(ValueError, match=rf"at least {needed:.1f} mm from the pan axis"):
                base_placement(GimbalDimensions.from_rig(moved), Layout.from_rig(moved))
