"""The arm that stows M1 keeps its clearance over its angle and both joint ranges."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from cad.assembly.assembly import Assembly, build_assembly
from cad.checks.clearance.bodies import Body
from cad.checks.clearance.stow_clearance import stow_clearance_findings
from cad.finding import Verdict
from cad.poses import body_from_group
from optics.mesh import Group, PartMesh, merge
from rigs import Rig
from rigs.mounting import StowJoint

CLEARANCE_MM = 3.0


@pytest.fixture(scope="module")
def stowable() -> tuple[Assembly, list[PartMesh]]:
    rig = Rig.load("aqua2")
    joints = rig.gaze.joints.model_copy(update={"stow": StowJoint(max_deg=90.0)})
    assembly = build_assembly(rig.with_gaze(joints=joints))
    return assembly, assembly.meshes


def swinging(assembly, meshes) -> list[PartMesh]:
    return [mesh for part, mesh in zip(assembly.parts, meshes, strict=True) if part.stows]


def test_a_fixed_fold_mirror_has_no_arm(aqua2):
    assert stow_clearance_findings(aqua2, aqua2.meshes, CLEARANCE_MM) == []


def test_no_sampled_gap_is_below_the_proven_one(stowable):
    """200 seeded poses and the corners of the box, by the poses of both bodies in the body frame."""
    assembly, meshes = stowable
    findings = stow_clearance_findings(assembly, meshes, CLEARANCE_MM)
    assert {finding.verdict for finding in findings} == {Verdict.PASSED}
    bound = next(finding.figure for finding in findings if finding.subject.endswith("what tilts"))
    arm, tilting = swinging(assembly, meshes), [mesh for mesh in meshes if mesh.group is Group.TILT]
    layout = assembly.layout
    low = np.radians([layout.pan.min_deg, layout.tilt.min_deg, 0.0])
    high = np.radians([layout.pan.max_deg, layout.tilt.max_deg, 90.0])
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
    poses = np.vstack([np.random.default_rng(4).uniform(low, high, (200, 3)), corners])
    bodies = [Body.of(name, parts) for name, parts in (("arm", arm), ("tilting", tilting))]
    gaps = [sampled_gap_mm(*bodies, assembly, q) for q in poses]
    assert min(gaps) > bound
    # The bound is not idle: the search may stop at two thirds of the smallest gap.
    assert bound > 0.5 * min(gaps)


def sampled_gap_mm(arm: Body, tilting: Body, assembly: Assembly, q) -> float:
    swung, turned = assembly.stow.body_from_stowing(q[2]), body_from_group(assembly.layout, Group.TILT, q[0], q[1])
    between = swung.inv() * turned
    return arm.gap_mm(tilting, between.rotation.as_matrix(), 1000 * between.translation)


def test_what_stands_in_the_arms_way_is_found(stowable):
    """A block of 10 mm where the arm's outermost corner is at 70 degrees, far from it in use and stowed."""
    assembly, meshes = stowable
    corners, _, _ = merge(swinging(assembly, meshes))
    point, _ = assembly.stow.axis_in_body()
    outermost = corners[np.linalg.norm(corners - point, axis=1).argmax()]
    block = trimesh.creation.box(extents=(10.0, 10.0, 10.0))
    middle = assembly.stow.body_from_stowing(np.radians(70.0)).apply(outermost)
    base = next(mesh for mesh in meshes if mesh.name == "gimbal_base")
    planted = PartMesh(
        name="gimbal_base",
        group=Group.FIXED,
        role=base.role,
        vertices_m=np.vstack([base.vertices_m, middle + block.vertices / 1000]),
        faces=np.vstack([base.faces, len(base.vertices_m) + block.faces]).astype(np.int32),
    )
    blocked = [planted if mesh is base else mesh for mesh in meshes]
    finding, *others = stow_clearance_findings(assembly, blocked, CLEARANCE_MM)
    assert finding.verdict is Verdict.FAILED
    assert finding.problem.place == "joints.stow.max_deg"
    assert "stowing arm and hull and base" in str(finding.problem)
    assert all(other.problem is None for other in others)
