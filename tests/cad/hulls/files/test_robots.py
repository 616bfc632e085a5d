"""Robots' descriptions: links posed, masses, cameras, and meshes that are looked for."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import trimesh
import yourdfpy

from cad.hulls.files.triangles import hull_files, read_hull_file, read_triangles

URDF = """<robot name="eel">
  <link name="base_link">
    <visual><origin xyz="0 0 0.1"/><geometry><box size="0.6 0.2 0.1"/></geometry></visual>
    <collision><geometry><sphere radius="5"/></geometry></collision>
    <inertial><mass value="7.5"/></inertial>
  </link>
  <link name="tail">
    <visual><origin rpy="0.2 -0.3 0.4"/><geometry>
      <mesh filename="{uri}" scale="0.001 0.001 -0.001"/></geometry></visual>
    <inertial><mass value="0.5"/></inertial>
  </link>
  <link name="front_camera_optical_frame"/>
  <link name="camera_link"/>
  <link name="chamber"/>
  <joint name="a" type="continuous"><parent link="base_link"/><child link="tail"/>
    <origin xyz="-0.5 0.05 0" rpy="0.1 0.2 0.3"/></joint>
  <joint name="b" type="fixed"><parent link="tail"/><child link="chamber"/><origin xyz="0 0 1"/></joint>
  <joint name="c" type="fixed"><parent link="base_link"/><child link="camera_link"/><origin xyz="0.3 0 0.05"/></joint>
  <joint name="d" type="fixed"><parent link="camera_link"/><child link="front_camera_optical_frame"/>
    <origin rpy="-1.5707963267948966 0 -1.5707963267948966"/></joint>
</robot>
"""

SDF = """<sdf version="1.9"><model name="eel">
  <frame name="mid" attached_to="base"><pose degrees="true">1 0 0  0 0 90</pose></frame>
  <link name="base"><pose>0.1 0 0  0 0 0</pose>
    <inertial><mass>7.5</mass></inertial>
    <visual name="v"><pose>0 0 0.5  0 0 0</pose><geometry><cylinder><radius>0.2</radius><length>1</length></cylinder>
    </geometry></visual>
    <sensor name="eye" type="camera"><pose>0.5 0 0  0 0.5 0</pose></sensor>
  </link>
  <link name="arm"><pose relative_to="mid">2 0 0  0 0 0</pose>
    <visual name="v"><geometry><mesh><uri>{uri}</uri><scale>2 2 2</scale></mesh></geometry></visual>
  </link>
</model></sdf>
"""


def ball(radius: float) -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=1, radius=radius)


@pytest.fixture
def eel(write):
    """Robot of two drawn links; the mesh of the second lies in its package."""
    fin = trimesh.creation.box(extents=(300, 100, 50))
    write("eel_description/meshes/fin.stl", fin)
    return write("eel_description/urdf/eel.urdf", URDF.format(uri="package://eel_description/meshes/fin.stl"))


def test_links_are_posed_as_yourdfpy_poses_them(eel):
    found = read_hull_file(eel)
    robot = yourdfpy.URDF.load(str(eel), load_meshes=False, build_scene_graph=True)
    fin = trimesh.creation.box(extents=(300, 100, 50)).apply_scale((0.001, 0.001, -0.001))
    fin.apply_transform(robot.get_transform("tail", "base_link") @ robot.link_map["tail"].visuals[0].origin)
    assert found.vertices[8:].min(axis=0) == pytest.approx(fin.vertices.min(axis=0))
    assert found.vertices[8:].max(axis=0) == pytest.approx(fin.vertices.max(axis=0))
    assert found.vertices[:8].max(axis=0) == pytest.approx((0.3, 0.1, 0.15))
    assert [(body.name, body.triangles) for body in found.bodies] == [("base_link", 12), ("tail", 12)]


def test_a_mirrored_mesh_keeps_its_outside(eel):
    found = read_hull_file(eel)
    assert trimesh.Trimesh(found.vertices, found.faces).volume == pytest.approx(0.6 * 0.2 * 0.1 + 0.3 * 0.1 * 0.05)


def test_a_robot_has_a_frame_a_mass_and_cameras(eel):
    found = read_hull_file(eel)
    assert (found.unit_mm, found.up, found.forward, found.has_frame, found.mass_kg) == (1000, "+z", "+x", True, 8)
    assert [camera.name for camera in found.cameras] == ["front_camera_optical_frame", "camera_link"]
    for camera in found.cameras:
        assert camera.position_mm == pytest.approx((300, 0, 50))
        assert (camera.look, camera.top) == (pytest.approx((1, 0, 0)), pytest.approx((0, 0, 1)))


def test_the_files_of_a_robot_are_known_without_reading_them(eel):
    fin = eel.parent.parent / "meshes" / "fin.stl"
    assert hull_files(eel) == (eel, fin.resolve())
    assert read_hull_file(eel).files == (eel, fin.resolve())
    assert np.ptp(read_triangles(eel, None)[0][:, 2]) > 100


@pytest.mark.parametrize(
    "place", ["fin.stl", "meshes/fin.stl", "../meshes/fin.stl", "../../eel_description/meshes/fin.stl"]
)
def test_a_mesh_is_looked_for_beside_and_above(write, place):
    write(f"ws/copy/{place}", ball(100))
    file = write("ws/copy/eel.urdf", URDF.format(uri="package://eel_description/meshes/fin.stl"))
    assert read_hull_file(file).bodies[1].triangles == 80


def test_all_that_is_wrong_is_said_at_once(write):
    wrong = URDF.replace('size="0.6 0.2 0.1"', 'size="0.6 much"').replace(
        '<child link="chamber"/>', '<child link="x"/>'
    )
    file = write("eel.urdf", wrong.format(uri="package://eel/fin.stl"))
    with pytest.raises(ValueError) as refusal:
        read_hull_file(file)
    said = str(refusal.value)
    assert "base_link: box.size = '0.6 much': expected 3 numbers" in said
    assert "joint 'b': expected the name of a link, got 'x'" in said
    assert "expected one link that is no joint's child, got base_link, chamber" in said
    assert "missing: package://eel/fin.stl; put them there" in said


def test_a_mesh_of_a_robot_that_is_broken_is_named(write):
    write("fin.stl", b"hello")
    with pytest.raises(ValueError, match=r"eel\.urdf: fin\.stl: expected (a mesh|triangles)"):
        read_hull_file(write("eel.urdf", URDF.format(uri="fin.stl")))


def test_without_visuals_the_collision_shapes_count(write):
    text = (
        '<robot name="r"><link name="b"><collision><geometry><box size="1 2 3"/></geometry></collision></link></robot>'
    )
    assert read_hull_file(write("r.urdf", text)).size == pytest.approx((1, 2, 3))


def test_a_xacro_file_without_macros_is_a_urdf_and_others_say_how_to_expand_them(write, monkeypatch):
    write("fin.stl", ball(100))
    plain = URDF.format(uri="fin.stl")
    assert len(read_hull_file(write("eel.urdf.xacro", plain)).bodies) == 2
    head = '<robot name="eel" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:property name="a" value="1"/>'
    macros = write("eel.urdf.xacro", plain.replace('<robot name="eel">', head))
    monkeypatch.setitem(sys.modules, "xacro", None)
    with pytest.raises(ValueError, match=r"got one of xacro's; expand it with: xacro eel\.urdf\.xacro > eel\.urdf"):
        read_hull_file(macros)


def test_an_sdf_has_frames_and_glb_meshes_are_turned(write):
    """A frame 1 m ahead of the base, turned to the left, and the arm 2 m ahead in it; glTF's y becomes z."""
    write("fin.glb", trimesh.creation.box(extents=(0.2, 0.4, 0.6)))
    found = read_hull_file(write("model.sdf", SDF.format(uri="model://eel/fin.glb")))
    arm = found.vertices[found.faces[-12:].reshape(-1)]
    assert (arm.min(axis=0) + arm.max(axis=0)) / 2 == pytest.approx((1.1, 2, 0))
    assert np.ptp(arm, axis=0) == pytest.approx((1.2, 0.4, 0.8))
    tube = found.vertices[found.faces[:-12].reshape(-1)]
    assert tube.max(axis=0) == pytest.approx((0.3, 0.2, 1), abs=1e-3)
    assert (found.mass_kg, found.has_frame) == (7.5, True)
    (eye,) = found.cameras
    assert (eye.name, eye.position_mm) == ("eye", pytest.approx((600, 0, 0)))
    assert eye.look == pytest.approx((np.cos(0.5), 0, -np.sin(0.5)))


def test_an_sdf_with_frames_that_are_not_there_includes_or_two_models_is_refused(write):
    write("fin.stl", ball(0.1))
    text = SDF.format(uri="fin.stl")
    wrong = text.replace('relative_to="mid"', 'relative_to="far"').replace(
        "</model>", "<include><uri>x</uri></include></model>"
    )
    with pytest.raises(ValueError, match=r"got include \(x\).*arm: pose: expected a frame of the model, got no 'far'"):
        read_hull_file(write("model.sdf", wrong))
    circle = text.replace('attached_to="base"', 'attached_to="arm"')
    with pytest.raises(ValueError, match="got a circle through"):
        read_hull_file(write("model.sdf", circle))
    two = '<sdf><world name="w"><model name="a"/><model name="b"/></world></sdf>'
    with pytest.raises(ValueError, match=r"expected one model, got 2 \(a, b\)"):
        read_hull_file(write("world.sdf", two))


def test_a_part_of_a_mesh_is_drawn_and_a_prefix_need_not_be_declared(write):
    """Two boxes in one file, 1 m apart; the link has the far one, put into its own middle."""
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.box(extents=(0.2, 0.4, 0.6)), node_name="body")
    far = trimesh.transformations.translation_matrix((1, 0, 0))
    scene.add_geometry(trimesh.creation.box(extents=(0.1, 0.1, 0.1)), node_name="prop", transform=far)
    write("eel.glb", scene.export(file_type="glb"))
    part = "<uri>eel.glb</uri><submesh><name>{}</name><center>{}</center></submesh>"
    model = (
        '<sdf><model name="eel"><gz:note gz:kind="a"/><link name="a"><visual name="v"><geometry><mesh>{}</mesh>'
        "</geometry></visual></link></model></sdf>"
    )
    for centre, middle in (("false", 1), ("true", 0)):
        found = read_hull_file(write("eel.sdf", model.format(part.format("prop", centre))))
        assert (len(found.faces), found.box.mean(axis=0)) == (12, pytest.approx((middle, 0, 0), abs=1e-6))
    with pytest.raises(ValueError, match=r"a: mesh\.submesh = 'fin': expected a part of eel\.glb \(body, prop\)"):
        read_hull_file(write("eel.sdf", model.format(part.format("fin", "false"))))
