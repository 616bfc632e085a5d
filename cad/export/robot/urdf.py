"""The mount as URDF, with a hint that lets MuJoCo keep the frames it would otherwise merge."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from scipy.spatial.transform import RigidTransform

from cad.colours import colour_fractions
from cad.export.robot.robot import Link, LinkJoint, Robot
from cad.export.robot.robot_meshes import collision_files, visual_file
from cad.export.robot.xml_numbers import numbers, roll_pitch_yaw, symmetric
from cad.loads.masses import Body
from optics.mesh import Role


def write_urdf(robot: Robot, path: Path) -> Path:
    """Write a robot whose meshes are in the folder `meshes` beside the file."""
    root = Element("robot", name=robot.name)
    # MuJoCo would weld frames that do not move to their parents, and look for meshes beside the file.
    compiler = {"fusestatic": "false", "strippath": "false", "balanceinertia": "false"}
    SubElement(SubElement(root, "mujoco"), "compiler", compiler)
    for role in sorted({mesh.role for link in robot.links for mesh in link.parts}, key=list(Role).index):
        material = SubElement(root, "material", name=role.value)
        SubElement(material, "color", rgba=numbers([*colour_fractions(role), 1.0]))
    for link in robot.links:
        _add_link(root, link, path.parent)
    for joint in robot.joints:
        _add_joint(root, joint)
    ElementTree.indent(root)
    path.write_text(ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n", encoding="utf-8")
    return path


def _add_link(root: Element, link: Link, folder: Path) -> None:
    element = SubElement(root, "link", name=link.name)
    if link.body is not None:
        _add_inertia(element, link.body)
    for mesh in link.parts:
        visual = SubElement(element, "visual", name=mesh.name)
        SubElement(SubElement(visual, "geometry"), "mesh", filename=visual_file(mesh).as_posix())
        SubElement(visual, "material", name=mesh.role.value)
    for mesh in link.parts:
        for file in collision_files(mesh, folder):
            collision = SubElement(element, "collision", name=file.stem)
            SubElement(SubElement(collision, "geometry"), "mesh", filename=file.as_posix())


def _add_inertia(element: Element, body: Body) -> None:
    inertial = SubElement(element, "inertial")
    SubElement(inertial, "origin", xyz=numbers(body.centre_of_mass_m), rpy="0 0 0")
    SubElement(inertial, "mass", value=numbers([body.mass_kg]))
    SubElement(inertial, "inertia", symmetric(body.inertia_kg_m2))


def _add_joint(root: Element, joint: LinkJoint) -> None:
    element = SubElement(root, "joint", name=joint.name, type="fixed" if joint.axis is None else "revolute")
    _add_origin(element, joint.parent_from_child)
    SubElement(element, "parent", link=joint.parent)
    SubElement(element, "child", link=joint.child)
    if joint.axis is None:
        return
    SubElement(element, "axis", xyz=numbers(joint.axis))
    SubElement(
        element,
        "limit",
        lower=numbers([joint.lower]),
        upper=numbers([joint.upper]),
        effort=numbers([joint.effort_n_m]),
        velocity=numbers([joint.velocity_rad_per_s]),
    )
    if joint.follows is not None:
        multiplier = numbers([joint.follows.multiplier])
        SubElement(element, "mimic", joint=joint.follows.joint, multiplier=multiplier, offset="0")


def _add_origin(element: Element, pose: RigidTransform) -> None:
    SubElement(element, "origin", xyz=numbers(pose.translation), rpy=numbers(roll_pitch_yaw(pose.rotation)))
