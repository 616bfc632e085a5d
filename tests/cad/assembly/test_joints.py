"""The named joints of the solids against the frames of `optics.layout`, and their ranges against the rig's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cad.assembly.joints import jointed_mount
from optics.layout import Layout
from optics.mesh import Group
from rigs import Rig

AGREEMENT_MM = 1e-9
"""Both are double precision on lengths below a metre, with some ten roundings of 1e-13 mm."""
UNIT_AGREEMENT = 1e-12
MM = 1000.0


@pytest.fixture(scope="module")
def mount(built):
    return jointed_mount(built)


def matrix_of(location):
    """Pose as a matrix, shape (4, 4), millimetres."""
    transformation = location.wrapped.Transformation()
    rows = [[transformation.Value(row, column) for column in range(1, 5)] for row in range(1, 4)]
    return np.array([*rows, [0, 0, 0, 1]])


def joint_values(layout, count):
    """Values over both ranges, limits included, radians."""
    for pan in np.linspace(layout.pan.min_deg, layout.pan.max_deg, count):
        for tilt in np.linspace(layout.tilt.min_deg, layout.tilt.max_deg, count):
            yield np.radians(pan), np.radians(tilt)


def assert_agrees(location, pose):
    found, expected = matrix_of(location), pose.as_matrix()
    np.testing.assert_allclose(found[:3, :3], expected[:3, :3], rtol=0, atol=UNIT_AGREEMENT)
    np.testing.assert_allclose(found[:3, 3], MM * expected[:3, 3], rtol=0, atol=AGREEMENT_MM)


def test_the_joints_move_the_parts_as_the_layout_says(mount):
    """Rationale: build123d chains two revolute joints; the layout multiplies rotations. Neither knows the other."""
    for q1, q2 in joint_values(mount.layout, 7):
        mount.move(q1, q2)
        assert_agrees(mount.pan.location, mount.layout.body_from_pan(q1))
        assert_agrees(mount.tilt.location, mount.layout.body_from_m2(q1, q2))


def test_a_part_moves_with_its_body(mount, built):
    """The mirror's vertices, as the kernel has them after the joints have moved, lie where the layout puts its face."""
    layout, mirror = built.layout, built.rig.gaze.gaze_mirror
    q1, q2 = np.radians([33.0, 21.0])
    mount.move(q1, q2)
    names = [part.name for part in built.parts if part.group is Group.TILT]
    plate = mount.tilt.solids()[names.index("gaze_mirror")]
    corners = np.array([tuple(vertex) for vertex in plate.vertices()])
    local = MM * layout.body_from_m2(q1, q2).inv().apply(corners / MM)
    assert local.max(axis=0) == pytest.approx([mirror.width_mm / 2, mirror.height_mm / 2, 0], abs=1e-6)
    assert local.min(axis=0)[2] == pytest.approx(-mirror.thickness_mm, abs=1e-6)


def test_the_ranges_are_the_rigs(mount, built):
    joints = built.rig.gaze.joints
    assert mount.fixed.joints["pan"].angular_range == (joints.pan.min_deg, joints.pan.max_deg)
    assert mount.pan.joints["tilt"].angular_range == (joints.tilt.min_deg, joints.tilt.max_deg)


@pytest.mark.parametrize(("q_deg", "name"), [((77.6, 0.0), r"q1 \(pan\)"), ((0.0, -32.6), r"q2 \(tilt\)")])
def test_a_value_outside_its_range_is_refused_by_the_joints_name(mount, q_deg, name):
    with pytest.raises(ValueError, match=rf"expected {name} between .* got"):
        mount.move(*np.radians(q_deg))


def test_signs_and_offsets_turn_the_solids_as_they_turn_the_layout(aqua2):
    """Joint values keep the rig file's meaning: reversed and offset servos move the parts as the layout says."""
    joints = aqua2.rig.gaze.joints
    pan = joints.pan.model_copy(update={"sign": -1, "offset_deg": 12.0})
    tilt = joints.tilt.model_copy(update={"sign": -1, "offset_deg": 70.0})
    rig: Rig = aqua2.rig.with_gaze(joints=joints.model_copy(update={"pan": pan, "tilt": tilt}))
    layout = Layout.from_rig(rig)
    mount = jointed_mount(replace(aqua2, layout=layout, stow=None))
    for q1, q2 in joint_values(layout, 3):
        mount.move(q1, q2)
        assert_agrees(mount.pan.location, layout.body_from_pan(q1))
        assert_agrees(mount.tilt.location, layout.body_from_m2(q1, q2))


def test_the_assembly_keeps_its_solids(aqua2):
    before = [tuple(part.solid.center()) for part in aqua2.parts]
    jointed_mount(aqua2).move(0.5, 0.5)
    assert [tuple(part.solid.center()) for part in aqua2.parts] == before
