"""Masses and volumes of parts, from their meshes."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import RigidTransform, Rotation

from cad.loads.masses import mount_in_body, part_bodies, together
from optics.mesh import Group, PartMesh, Role


def block(size_m, centre_m=(0, 0, 0), name="block", role=Role.MOUNT, group=Group.FIXED):
    box = trimesh.creation.box(size_m)
    box.apply_translation(centre_m)
    return PartMesh(
        name=name, group=group, role=role, vertices_m=np.array(box.vertices), faces=np.array(box.faces, dtype=np.int32)
    )


def test_a_block_has_the_mass_and_inertia_of_a_block(aqua2):
    """ABS, 1040 kg/m^3; inertia of a cuboid m (b^2 + c^2) / 12."""
    body = part_bodies(aqua2, [block((0.1, 0.2, 0.3), (1, 2, 3))])[Group.FIXED][0]
    mass = 1040 * 0.006
    assert body.mass_kg == pytest.approx(mass)
    np.testing.assert_allclose(body.centre_of_mass_m, [1, 2, 3], rtol=1e-12)
    expected = mass / 12 * np.diag([0.04 + 0.09, 0.01 + 0.09, 0.01 + 0.04])
    np.testing.assert_allclose(body.inertia_kg_m2, expected, atol=1e-12 * mass)


def test_mirrors_are_glass_servos_weigh_what_their_data_sheet_says_and_hulls_are_not_counted(aqua2):
    meshes = [
        block((0.1, 0.1, 0.003), name="gaze_mirror", role=Role.MIRROR, group=Group.TILT),
        block((0.03, 0.015, 0.03), name="tilt_servo", role=Role.SERVO, group=Group.PAN),
        block((1, 1, 1), name="hull", role=Role.HULL),
    ]
    bodies = part_bodies(aqua2, meshes)
    assert bodies[Group.TILT][0].mass_kg == pytest.approx(2500 * 3e-5)
    assert bodies[Group.PAN][0].mass_kg == pytest.approx(aqua2.gaze.servos.tilt.mass_g / 1000)
    assert bodies[Group.FIXED] == []


def test_a_servo_that_the_rig_does_not_have_is_refused(aqua2):
    with pytest.raises(ValueError, match="'lift_servo'"):
        part_bodies(aqua2, [block((0.03, 0.015, 0.03), name="lift_servo", role=Role.SERVO)])


def test_two_halves_are_the_whole(aqua2):
    halves = part_bodies(aqua2, [block((1, 1, 1), (-0.5, 0, 0), "a"), block((1, 1, 1), (0.5, 0, 0), "b")])[Group.FIXED]
    whole = part_bodies(aqua2, [block((2, 1, 1))])[Group.FIXED][0]
    joined = together("both", halves)
    assert joined.mass_kg == pytest.approx(whole.mass_kg)
    np.testing.assert_allclose(joined.centre_of_mass_m, whole.centre_of_mass_m, atol=1e-12)
    np.testing.assert_allclose(joined.inertia_kg_m2, whole.inertia_kg_m2, atol=1e-9)


def test_a_moved_body_turns_its_inertia(aqua2):
    body = part_bodies(aqua2, [block((0.1, 0.2, 0.3))])[Group.FIXED][0]
    quarter = RigidTransform.from_components([1, 0, 0], Rotation.from_euler("z", np.pi / 2))
    np.testing.assert_allclose(
        np.diag(body.moved(quarter).inertia_kg_m2), np.diag(body.inertia_kg_m2)[[1, 0, 2]], rtol=1e-12
    )


def test_only_what_turns_moves_with_the_joints(aqua2, aqua2_meshes):
    rest, turned = mount_in_body(aqua2, aqua2_meshes, 0, 0), mount_in_body(aqua2, aqua2_meshes, 0.5, 0.3)
    moved = {
        a.name for a, b in zip(rest, turned, strict=True) if not np.allclose(a.centre_of_mass_m, b.centre_of_mass_m)
    }
    turning = {mesh.name for mesh in aqua2_meshes if mesh.group is not Group.FIXED}
    # A part whose centre is on the pan axis turns in place.
    assert moved <= turning
    assert {"yoke", "mirror_holder", "gaze_mirror"} <= moved
