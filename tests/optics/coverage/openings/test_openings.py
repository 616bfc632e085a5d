"""What opens a blind patch: a wall that hides it, a joint that ends before it, a mirror on a hinge before it."""

from __future__ import annotations

import numpy as np
import pytest
from plain_boxes import box_part

from optics.coverage.blind import blind_patches
from optics.coverage.coverage import compute_coverage, covered_cells, stepped_joints
from optics.coverage.openings.direct_view import seen_directly
from optics.coverage.openings.moved_parts import moved_parts
from optics.coverage.openings.openings import blind_openings, single_changes
from optics.coverage.sphere import cell_directions, cells_of
from optics.layout import Layout
from optics.mesh import Group, Role
from rigs import Rig

AQUA2 = Rig.load("aqua2")
NSIDE = 32


def with_tilt(rig: Rig, **limits: float) -> Rig:
    joints = rig.gaze.joints
    return rig.with_gaze(joints=joints.model_copy(update={"tilt": joints.tilt.model_copy(update=limits)}))


@pytest.fixture(scope="module")
def short_tilt():
    """aqua2's mirrors alone, with a tilt that ends 40 degrees early: what lies high behind is then blind."""
    rig = with_tilt(AQUA2, max_deg=AQUA2.gaze.joints.tilt.max_deg - 40)
    q1, q2 = stepped_joints(rig, 4.0)
    return rig, compute_coverage(rig, [], q1=q1, q2=q2, columns=4, rows=4, nside=NSIDE)


def test_a_joint_that_ends_early_is_what_opens_the_patch_beyond(short_tilt):
    rig, coverage = short_tilt
    found = blind_openings(rig, [], coverage, possible=lambda changed: changed.gaze.joints != rig.gaze.joints)
    assert [opening.key for opening in found][:1] == ["joints.tilt.max_deg"]
    best = found[0]
    assert best.after > best.before == rig.gaze.joints.tilt.max_deg
    patch = blind_patches(coverage)[best.patch]
    assert best.gained_sr == pytest.approx(best.share * patch.solid_angle_sr)
    # The gain is that of a coverage with the changed number, counted in the patch and elsewhere.
    changed = with_tilt(rig, max_deg=best.after)
    q1, q2 = stepped_joints(changed, 4.0)
    after = compute_coverage(changed, [], q1=q1, q2=q2, columns=4, rows=4, nside=NSIDE)
    gained = 4 * np.pi * (after.covered_fraction - coverage.covered_fraction)
    assert gained >= 0.9 * best.gained_sr
    assert best.net_sr == pytest.approx(gained, abs=1e-9)


def test_nothing_is_said_of_changes_that_cannot_be(short_tilt):
    rig, coverage = short_tilt
    keys = {opening.key for opening in blind_openings(rig, [], coverage, possible=lambda changed: False)}
    assert keys <= {"joints.stow"}


def test_a_servo_that_turns_no_further_gives_way_at_its_other_end():
    changes = {(each.key, each.after - each.before): each for each in single_changes(AQUA2)}
    change = changes["joints.tilt.min_deg", -10.0]
    tilt, travel = change.rig.gaze.joints.tilt, AQUA2.gaze.servos.tilt.travel_deg
    assert tilt.max_deg - tilt.min_deg == pytest.approx(travel)
    assert f"max_deg = {tilt.max_deg:g}" in change.also


def test_chosen_cells_are_decided_as_all_are():
    q1, q2 = stepped_joints(AQUA2, 10.0)
    chosen = np.arange(0, 12 * NSIDE**2, 37)
    everything = covered_cells(AQUA2, [], q1=q1, q2=q2, nside=NSIDE)
    some = covered_cells(AQUA2, [], q1=q1, q2=q2, nside=NSIDE, cells=chosen)
    assert (some == everything[chosen]).all()
    assert 0 < some.sum() < len(some)


def test_parts_move_with_the_mirror_that_they_hold():
    """d1 moves bracket and gimbal along the camera's axis, d2 the gimbal along the fold; the hull stays."""
    names = {"hull": Role.HULL, "fold_bracket": Role.MOUNT, "gimbal_base": Role.MOUNT}
    parts = [box_part(-np.ones(3), np.ones(3), group=Group.FIXED, name=name, role=role) for name, role in names.items()]
    longer = AQUA2.with_gaze(fold_mirror={"distance_mm": 105.0}, gaze_mirror={"distance_mm": 145.0})
    gimbal = Layout.from_rig(longer).body_from_gimbal.translation - Layout.from_rig(AQUA2).body_from_gimbal.translation
    shifts = [np.zeros(3), np.array([0.01, 0, 0]), gimbal]
    for part, moved, shift in zip(parts, moved_parts(parts, AQUA2, longer), shifts, strict=True):
        assert moved.vertices_m - part.vertices_m == pytest.approx(np.broadcast_to(shift, part.vertices_m.shape))


def test_what_turns_with_a_wider_mirror_is_stretched():
    part = box_part((-0.04, -0.05, -0.003), (0.04, 0.05, 0), name="gaze_mirror", role=Role.MIRROR, group=Group.TILT)
    wider = AQUA2.with_gaze(gaze_mirror={"width_mm": 2 * AQUA2.gaze.gaze_mirror.width_mm})
    (moved,) = moved_parts([part], AQUA2, wider)
    assert np.ptp(moved.vertices_m, axis=0) == pytest.approx(np.ptp(part.vertices_m, axis=0) * [2, 1, 1])


def test_the_direct_view_is_what_the_camera_sees_past_the_parts():
    """Straight ahead is seen, behind is not, and a wall in front hides what is behind it."""
    directions = cell_directions(NSIDE)
    seen = seen_directly(AQUA2, [], directions)
    ahead, behind = cells_of([[1, 0, 0], [-1, 0, 0]], NSIDE)
    assert seen[ahead]
    assert not seen[behind]
    camera = Layout.from_rig(AQUA2).body_from_camera.translation
    near, far = camera + np.array([1.0, 0.0, -2.0]), camera + np.array([1.1, 2.0, 2.0])
    wall = box_part(near, far, group=Group.FIXED, role=Role.HULL)
    left = directions[:, 1] > 0.05
    hidden = seen_directly(AQUA2, [wall], directions)
    assert not hidden[left].any()
    assert seen[left].any()
    assert (hidden[directions[:, 1] < -0.05] == seen[directions[:, 1] < -0.05]).all()
