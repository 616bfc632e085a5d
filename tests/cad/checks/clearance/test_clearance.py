"""Clearance over the joint range: the poses written out, closed forms with balls, a block planted at one corner."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from cad.checks.clearance.admissible import CellState, admissible_region, largest_rectangle, pair_states
from cad.checks.clearance.bodies import Body, chord_mm
from cad.checks.clearance.clearance import CHECK, RESOLUTION_MM, clearance_bodies, pair_finding
from cad.checks.clearance.moving_pair import MovingPair, joint_box, moving_pairs
from cad.finding import Verdict
from cad.overlaps import checked_poses, overlaps
from cad.poses import body_from_group
from optics.mesh import Group, PartMesh, Role

ROUNDING_MM = 1e-9
"""Double precision on lengths below a metre."""
RADIUS_MM = 5.0
BALL_MM = 0.02
"""How far the triangles of an icosphere of 5 mm with 4 subdivisions lie within the ball: 5 (1 - cos 0.035) = 0.003."""


def part(name, group, surface, role=Role.MOUNT):
    return PartMesh(
        name=name,
        group=group,
        role=role,
        vertices_m=np.asarray(surface.vertices) / 1000,
        faces=np.asarray(surface.faces, dtype=np.int32),
    )


def ball(name, group, centre_mm):
    surface = trimesh.creation.icosphere(4, RADIUS_MM)
    surface.apply_translation(centre_mm)
    return Body.of(name, [part(name, group, surface)])


def pair_of(moving, other, layout):
    return MovingPair(moving=moving, other=other, layout=layout)


def in_body(layout, group, point_mm, q):
    return 1000 * body_from_group(layout, group, *q).apply(np.asarray(point_mm) / 1000)


@pytest.mark.parametrize("groups", [(Group.PAN, Group.FIXED), (Group.TILT, Group.FIXED), (Group.TILT, Group.PAN)])
def test_the_pose_written_out_is_that_of_the_layout(aqua2, groups):
    layout = aqua2.layout
    moving, other = (ball(group, group, (0, 0, 0)) for group in groups)
    pair = pair_of(moving, other, layout)
    for q in ((0.0, 0.0), (0.7, -0.3), (-1.2, 1.9)):
        expected = body_from_group(layout, groups[0], *q).inv() * body_from_group(layout, groups[1], *q)
        turn, shift = pair.moving_from_other(*q)
        assert turn == pytest.approx(expected.rotation.as_matrix(), abs=1e-12)
        assert shift == pytest.approx(1000 * expected.translation, abs=ROUNDING_MM)


def test_a_ball_on_the_yoke_and_a_fixed_one_on_its_circle(aqua2):
    """Closed form: a chord at the limit, less two radii.

    The centres are on one circle of 60 mm about the pan axis, 100 degrees apart at q1 = 0 (aqua2's pan has no offset
    and sign 1). At the limit of 77.5 degrees 22.5 degrees are left: a chord of 2 60 sin(11.25 deg).
    """
    layout = aqua2.layout
    angle = np.radians(100)
    moving = ball("moving", Group.PAN, (60, 0, 0))
    place = layout.body_from_gimbal.apply([0.06 * np.cos(angle), 0.06 * np.sin(angle), 0])
    pair = pair_of(moving, ball("fixed", Group.FIXED, 1000 * place), layout)
    expected = 2 * 60 * np.sin(np.radians(11.25)) - 2 * RADIUS_MM
    found = pair.smallest_gap(expected - 0.05, expected - 0.05)
    assert found.bound_mm <= expected + 2 * BALL_MM
    assert found.bound_mm >= expected - 0.05 - ROUNDING_MM
    assert found.gap_mm >= expected - ROUNDING_MM
    assert np.degrees(found.q[0]) == pytest.approx(77.5, abs=0.5)


def test_no_point_goes_further_than_the_reach_says(aqua2):
    """The Lipschitz bound that everything rests on, at random joint values and turns."""
    layout, rng = aqua2.layout, np.random.default_rng(0)
    box = joint_box(layout)
    for pair in moving_pairs(clearance_bodies(aqua2.meshes), layout)[::7]:
        reach = pair.reach_mm()
        for _ in range(8):
            first, second = (box.middle + rng.uniform(-1, 1, 2) * box.half for _ in range(2))
            change = abs(pair.gap_mm(first) - pair.gap_mm(second))
            assert change <= np.abs(first - second) @ reach + ROUNDING_MM


def test_pieces_together_are_the_pair(aqua2):
    layout = aqua2.layout
    bodies = {body.name: body for body in clearance_bodies(aqua2.meshes)}
    pair = pair_of(bodies["mirror_holder"], bodies["yoke"], layout)
    pieces = pair.pieces()
    assert len(pieces) > 2
    for q2 in (-0.5, 0.0, 1.3):
        q = np.array([0.0, q2])
        assert min(piece.gap_mm(q) for piece in pieces) == pytest.approx(pair.gap_mm(q), abs=ROUNDING_MM)


def corner_block(built):
    """A cube of 2 mm in the body, where a corner of the gaze mirror's back is at the corner of the joint ranges."""
    layout = built.layout
    box = joint_box(layout)
    corner = box.middle + box.half * [1, -1]
    vertices = next(mesh for mesh in built.meshes if mesh.name == "mirror_holder").vertices_m
    extreme = vertices[np.linalg.norm(vertices, axis=1).argmax()]
    surface = trimesh.creation.box(extents=(2, 2, 2))
    # A little inwards of the limits, where a grid that has the limits themselves does not look either.
    inside = corner - box.half * [0.2, -0.2]
    surface.apply_translation(in_body(layout, Group.TILT, 1000 * extreme, inside))
    return part("block", Group.FIXED, surface), inside


def test_a_block_planted_at_one_corner_of_the_joint_range_is_found(aqua2):
    """A grid misses it, a bound does not.

    Rationale: a cube of 2 mm that only one corner of the holder reaches, near q1 = 77.5 and q2 = -32.5 degrees.
    Expectation: the 5 x 5 grid of the quick look misses it; the bounded search names both parts and the pose; the
    admissible region loses that corner and the largest rectangle around rest leaves it out.
    """
    layout = aqua2.layout
    block, where = corner_block(aqua2)
    holder = next(mesh for mesh in aqua2.meshes if mesh.name == "mirror_holder")
    assert overlaps([holder, block], layout, checked_poses(layout, 5)) == []
    pair = pair_of(Body.of("mirror_holder", [holder]), Body.of("block", [block]), layout)
    found = pair_finding(pair, aqua2, 1.0)
    assert found.verdict is Verdict.FAILED
    assert "block intersect at" in str(found.problem)
    assert found.figure == 0
    region = admissible_region([(pair, 1.0)], layout)
    assert 0.5 < region.fraction < 0.995
    (low1, high1), (low2, high2) = region.largest.q1_deg, region.largest.q2_deg
    assert low1 <= 0 <= high1 and low2 <= 0 <= high2
    where_deg = np.degrees(where)
    assert not (low1 <= where_deg[0] <= high1 and low2 <= where_deg[1] <= high2)
    # Every pose of the rectangle keeps the gap.
    for q1 in np.radians(np.linspace(low1, high1, 9)):
        for q2 in np.radians(np.linspace(low2, high2, 9)):
            assert pair.gap_mm(np.array([q1, q2])) >= 1.0


def test_states_of_a_lone_joint_fill_the_other_one(aqua2):
    layout = aqua2.layout
    bodies = {body.name: body for body in clearance_bodies(aqua2.meshes)}
    states = pair_states(pair_of(bodies["yoke"], bodies["hull"], layout), 1000.0)
    assert (states == CellState.TOO_NEAR).all()
    assert (pair_states(pair_of(bodies["yoke"], bodies["hull"], layout), 1.0) == CellState.CLEAR).all()


def test_the_largest_rectangle_holds_its_seed():
    """By hand, in a 4 x 5 field with two bad cells: 3 x 3 cells around (0, 0), 2 x 5 around (2, 4)."""
    good = np.ones((4, 5), dtype=bool)
    good[0, 3] = good[3, 2] = False
    assert largest_rectangle(good, (0, 0)) == ((0, 3), (0, 3))
    assert largest_rectangle(good, (2, 4)) == ((1, 3), (0, 5))
    assert largest_rectangle(good, None) is None


def test_the_presets_keep_their_clearance_everywhere(checked):
    findings = checked.of(CHECK)
    assert len(findings) > 80
    assert [str(f.problem) for f in findings if f.problem] == []
    assert all(f.figure >= f.limit - RESOLUTION_MM for f in findings)


def test_a_bearing_that_binds_is_found(aqua2):
    """The bushing's bore drawn together by a tenth: the hub has no clearance left."""
    bushing = aqua2.part("pan_bushing")
    tight = replace(bushing, make=lambda: bushing.solid.scale(0.99))
    parts = tuple(tight if part is bushing else part for part in aqua2.parts)
    bodies = {body.name: body for body in clearance_bodies(aqua2.meshes)}
    pair = pair_of(bodies["yoke"], bodies["pan_bushing"], aqua2.layout)
    assert pair_finding(pair, aqua2, 3.0).verdict is Verdict.PASSED
    assert pair_finding(pair, replace(aqua2, parts=parts), 3.0).verdict is Verdict.FAILED


def test_hulls_are_coarser_than_other_parts():
    assert chord_mm(Role.HULL) > chord_mm(Role.MOUNT)
