"""Solids of the presets: one each, mirrors in the planes of the layout, axes that cross, nothing in the way."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from build123d import GeomType
from manifold3d import Manifold

from cad.assembly.assembly import build_assembly
from cad.overlaps import checked_poses, manifold_mm, overlaps
from cad.parts.gimbal_dimensions import PAN_BUSHING, PIVOT_BUSHING, GimbalDimensions
from cad.parts.mirrors import LIP_OVERLAP_MM
from cad.parts.servo import HORN_CENTRE_HOLE_DIAMETER_MM, HORN_DIAMETER_MM
from optics.mesh import Group, Role
from rigs import Rig

PLANE_TOLERANCE_MM = 1e-6
"""Double precision on lengths below a metre, with room for the kernel's own rounding (1e-7 mm)."""
ABOVE_FACE_MM = 0.01
"""Light is looked at this far in front of a face, so that the mirror itself is not in the way."""
NAMES = [
    "hull",
    "fold_bracket",
    "fold_mirror",
    "gimbal_base",
    "pan_servo",
    "pan_horn",
    "yoke",
    "tilt_servo",
    "tilt_horn",
    "mirror_holder",
    "gaze_mirror",
]


def cylinder_axes(solid, radius_mm):
    """Point and direction of every cylindrical face of a radius."""
    return [
        (np.array(tuple(face.axis_of_rotation.position)), np.array(tuple(face.axis_of_rotation.direction)))
        for face in solid.faces().filter_by(GeomType.CYLINDER)
        if face.radius is not None and abs(face.radius - radius_mm) < PLANE_TOLERANCE_MM
    ]


def distance_to_line(point, origin, direction):
    return np.linalg.norm(np.cross(np.asarray(point) - origin, direction / np.linalg.norm(direction)))


def replaced(rig, section, **changes):
    return rig.with_gaze(**{section: changes})


def test_the_parts_are_those_of_the_design(built):
    made = [part.name for part in built.parts if part.role is not Role.HARDWARE]
    assert made == NAMES


def test_every_part_is_printed_or_bought_or_the_hull(built):
    for part in built.parts:
        assert part.printed or part.catalogue or part.role is Role.HULL, part.name
        assert not (part.printed and part.catalogue), part.name


def test_each_part_is_one_valid_solid_and_one_closed_surface(built):
    for part, mesh in zip(built.parts, built.meshes, strict=True):
        assert len(part.solid.solids()) == 1, part.name
        assert part.solid.is_valid, part.name
        surface = trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
        assert surface.is_watertight, part.name
        assert surface.body_count == 1, part.name
        # Chords of the tessellation: 0.2 mm on the hull's tube of 57 mm radius are 0.5 % of its area at most.
        assert 1e9 * surface.volume == pytest.approx(part.solid.volume, rel=0.01), part.name


def test_the_fold_mirrors_face_is_the_layouts_plane(built):
    mesh = next(mesh for mesh in built.meshes if mesh.name == "fold_mirror")
    mirror = built.rig.gaze.fold_mirror
    corners = 1000 * built.layout.body_from_m1.inv().apply(mesh.vertices_m)
    assert corners.min(axis=0) == pytest.approx(
        [-mirror.width_mm / 2, -mirror.height_mm / 2, -mirror.thickness_mm], abs=PLANE_TOLERANCE_MM
    )
    assert corners.max(axis=0) == pytest.approx([mirror.width_mm / 2, mirror.height_mm / 2, 0], abs=PLANE_TOLERANCE_MM)


def test_the_gaze_mirrors_face_is_the_layouts_plane(built):
    mesh = next(mesh for mesh in built.meshes if mesh.name == "gaze_mirror")
    mirror = built.rig.gaze.gaze_mirror
    assert mesh.group is Group.TILT
    corners = 1000 * mesh.vertices_m
    assert corners.min(axis=0) == pytest.approx(
        [-mirror.width_mm / 2, -mirror.height_mm / 2, -mirror.thickness_mm], abs=PLANE_TOLERANCE_MM
    )
    assert corners.max(axis=0) == pytest.approx([mirror.width_mm / 2, mirror.height_mm / 2, 0], abs=PLANE_TOLERANCE_MM)


def test_both_joint_axes_cross_at_the_centre_of_the_gaze_mirrors_face(built):
    """The paper's third design landmark (section 2.2), read off round surfaces of all that turns or guides."""
    assembly = built
    centre = 1000 * assembly.layout.body_from_gimbal.translation
    for name, radius, point, along in (
        ("pan_horn", HORN_DIAMETER_MM / 2, (0, 0, 0), (0, 0, 1)),
        ("yoke", PAN_BUSHING.journal_radius_mm, (0, 0, 0), (0, 0, 1)),
        ("gimbal_base", PAN_BUSHING.housing_radius_mm, centre, (0, 0, 1)),
        ("pan_bushing", PAN_BUSHING.bore_mm / 2, centre, (0, 0, 1)),
        ("tilt_horn", HORN_DIAMETER_MM / 2, (0, 0, 0), (1, 0, 0)),
        ("yoke", PIVOT_BUSHING.housing_radius_mm, (0, 0, 0), (0, 1, 0)),
        ("pivot_bushing", PIVOT_BUSHING.bore_mm / 2, (0, 0, 0), (0, 1, 0)),
        ("pivot_sleeve", PIVOT_BUSHING.journal_radius_mm, (0, 0, 0), (1, 0, 0)),
        ("mirror_holder", HORN_CENTRE_HOLE_DIAMETER_MM / 2, (0, 0, 0), (1, 0, 0)),
    ):
        axes = cylinder_axes(assembly.part(name).solid, radius)
        assert axes
        for origin, direction in axes:
            assert distance_to_line(point, origin, direction) < PLANE_TOLERANCE_MM
            assert abs(direction @ np.array(along)) == pytest.approx(1, abs=1e-12)


def test_nothing_is_in_the_way_at_rest_and_over_the_joint_range(built):
    """But for the flanges' bolts in the hull, whose threads are not drawn."""
    poses = checked_poses(built.layout, 4)
    found = [{overlap.first, overlap.second} for overlap in overlaps(built.meshes, built.layout, poses)]
    bolted = [{"hull", part.name} for part in built.parts if "flange_screw" in part.name]
    assert [pair for pair in found if pair not in bolted] == []


def test_the_gimbal_keeps_its_clearance_to_what_stands_still(built):
    """A second way to see the swept volumes: nearest vertices, at poses that the collision grid does not have."""
    layout, dimensions = built.layout, GimbalDimensions.from_rig(built.rig)
    axis = layout.body_from_gimbal.translation
    for mesh in built.meshes:
        if mesh.group is Group.PAN:
            radius = 1000 * np.linalg.norm(mesh.vertices_m[:, :2], axis=1).max()
            assert radius <= dimensions.yoke_radius_mm + PLANE_TOLERANCE_MM
        if mesh.group is Group.TILT:
            radius = 1000 * np.linalg.norm(mesh.vertices_m[:, 1:], axis=1).max()
            assert radius <= dimensions.holder_radius_mm + PLANE_TOLERANCE_MM
        if mesh.name == "gimbal_base":
            vertices = 1000 * (mesh.vertices_m - axis)
            high = vertices[vertices[:, 2] > dimensions.yoke_bottom_mm]
            gap = np.linalg.norm(high[:, :2], axis=1).min() - dimensions.yoke_radius_mm
            assert gap >= built.rig.gaze.mount.clearance_mm


def test_rays_that_start_on_the_port_do_not_hit_its_boss(built):
    port, layout = built.rig.port, built.layout
    hull = next(mesh for mesh in built.meshes if mesh.name == "hull")
    vertices = 1000 * layout.body_from_camera.inv().apply(hull.vertices_m)
    if port.shape == "flat":
        near = np.linalg.norm(vertices[:, :2], axis=1) <= port.aperture_diameter_mm / 2 + 6.1
        assert vertices[near][:, 2].max() == pytest.approx(port.distance_mm + port.thickness_mm - 0.5, abs=1e-6)
    else:
        front = vertices[vertices[:, 2] > 1]
        near = front[np.linalg.norm(front[:, :2], axis=1) < port.inner_radius_mm + port.thickness_mm]
        outside = port.inner_radius_mm + port.thickness_mm
        assert np.linalg.norm(near - port.centre_mm, axis=1).max() == pytest.approx(outside - 0.5, abs=1e-6)


def face_corners(mirror):
    """Corners of the part of a mirror's face that no lip covers, metres, shape (4, 3)."""
    half_width, half_height = mirror.width_mm / 2 - LIP_OVERLAP_MM, mirror.height_mm / 2
    signs = np.array([[-1, -1], [-1, 1], [1, 1], [1, -1]])
    return np.column_stack([signs * [half_width, half_height], np.zeros(4)]) / 1000


def cone(apex, corners):
    """Body, in millimetres, between an apex and the corners of a face, both in metres."""
    return Manifold.hull_points(np.ascontiguousarray(1000 * np.vstack([apex, corners])))


def in_front_of(light, pose):
    """What of a body of light is in front of a face whose outward normal is z of `pose`."""
    normal = pose.rotation.apply([0, 0, 1])
    return light.trim_by_plane(tuple(normal), float(1000 * pose.translation @ normal) + ABOVE_FACE_MM)


def outside_the_port(light, built):
    """What of a body of light has left the port."""
    port, pose = built.rig.port, built.layout.body_from_camera
    if port.shape == "flat":
        axis = pose.rotation.apply([0, 0, 1])
        level = 1000 * pose.translation @ axis + port.distance_mm + port.thickness_mm
        return light.trim_by_plane(tuple(axis), float(level))
    dome = Manifold.sphere(port.inner_radius_mm + port.thickness_mm, 256)
    return light - dome.translate(tuple(1000 * pose.apply(np.array(port.centre_mm) / 1000)))


@pytest.mark.parametrize("q1", [0.0, 0.7, -1.35])
@pytest.mark.parametrize("q2", [-0.5, 0.0, 0.8, 1.6])
def test_nothing_stands_in_the_way_of_light_that_hits_both_mirrors(built, q1, q2):
    """Port to M1 and M1 to M2 as bodies, against every part.

    Rationale: light from the pinhole that hits M1's free face runs in a cone; after M1 it runs in the cone whose apex
    is the pinhole's mirror image. Both are cut to what hits M1 (and then M2) and to what is in front of M1 (and of the
    port). Refraction at a flat port makes the true cones narrower.
    Expectation: no part shares volume with the light, up to the rounding of the tessellation.
    """
    layout, rig = built.layout, built.rig
    pinhole = layout.body_from_camera.translation
    m1 = layout.body_from_m1.apply(face_corners(rig.gaze.fold_mirror))
    m2_pose = layout.body_from_m2(q1, q2)
    m2 = m2_pose.apply(face_corners(rig.gaze.gaze_mirror))
    image = layout.body_from_m1.apply(layout.body_from_m1.inv().apply(pinhole) * [1, 1, -1])
    to_m1 = in_front_of(outside_the_port(cone(pinhole, m1), built), layout.body_from_m1)
    through_m1 = cone(image, image + 5 * (m1 - image))
    to_m2 = in_front_of(in_front_of(cone(image, m2) ^ through_m1, layout.body_from_m1), m2_pose)
    assert to_m1.volume() > 1e4
    assert to_m2.volume() > 1e4
    for part, mesh in zip(built.parts, built.meshes, strict=True):
        pose = built.pose(part, q1, q2).as_matrix()[:3]
        pose[:, 3] *= 1000
        body = manifold_mm(mesh).transform(pose)
        for name, light in (("to M1", to_m1), ("to M2", to_m2)):
            assert (light ^ body).volume() == pytest.approx(0, abs=1e-3), f"{part.name}, light {name}"


def test_a_base_anchor_inside_the_sweep_is_refused_with_a_place_that_works(aqua2):
    rig = replaced(aqua2.rig, "mount", base_anchor_mm=(320.0, 60.0, -65.0))
    with pytest.raises(ValueError, match=r"mount\.base_anchor_mm = \(320.*such as \(298\.7, 60\.0, -65\)"):
        build_assembly(rig)
    build_assembly(replaced(aqua2.rig, "mount", base_anchor_mm=(298.6, 60.0, -65.0)))


def test_a_base_anchor_beside_the_camera_turns_the_base(aqua2):
    rig = replaced(aqua2.rig, "mount", base_anchor_mm=(290.0, 0.0, -65.0))
    assembly = build_assembly(rig)
    flange = assembly.part("gimbal_base").solid.faces().sort_by(lambda face: face.center().Z)[-1]
    assert tuple(flange.center())[:2] == pytest.approx((290.0, 0.0), abs=1e-6)


def test_a_fold_anchor_far_beside_the_camera_or_far_below_the_mirror_is_refused(aqua2):
    cases = (
        ((270.0, -60.0, 65.0), r"expected an anchor at most \d+\.\d mm beside the camera's view, such as \(270\.0, -"),
        ((270.0, 60.0, -150.0), r"expected an anchor such as \(270\.0, 60\.0, -\d+\.\d\), so that the roof"),
    )
    for anchor, expected in cases:
        with pytest.raises(ValueError, match=rf"mount\.fold_anchor_mm.*{expected}"):
            build_assembly(replaced(aqua2.rig, "mount", fold_anchor_mm=anchor, fold_normal=(0.0, 0.0, 1.0)))


def test_a_servo_whose_shaft_is_beside_its_case_is_refused(aqua2):
    servo = aqua2.rig.gaze.servos.pan.model_copy(update={"shaft_offset_mm": 14.0})
    with pytest.raises(ValueError, match=r"servos\.pan\.shaft_offset_mm = 14: expected at most 12\.5"):
        build_assembly(replaced(aqua2.rig, "servos", pan=servo))


@pytest.mark.parametrize("wall_mm", [1.2, 12.0])
def test_thin_and_thick_walls_leave_the_fits_open(aqua2, wall_mm):
    assembly = build_assembly(replaced(aqua2.rig, "mount", wall_mm=wall_mm))
    meshes = [mesh for mesh in assembly.meshes if mesh.name != "hull"]
    assert overlaps(meshes, assembly.layout, checked_poses(assembly.layout, 2)) == []


def test_a_part_is_tessellated_once(aqua2):
    assert all(first is second for first, second in zip(aqua2.meshes, aqua2.meshes, strict=True))
    assert [mesh.name for mesh in aqua2.printed] == [part.name for part in aqua2.parts if part.printed]


def test_a_rig_without_mirrors_has_no_assembly():
    with pytest.raises(ValueError, match="expected a rig with mirrors, got 'bench'"):
        build_assembly(Rig.load("bench"))
