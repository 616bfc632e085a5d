"""The mount as SDF 1.11, the first version in which a joint can follow another (`mimic`)."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from scipy.spatial.transform import RigidTransform

from cad.colours import colour_fractions
from cad.export.robot.robot import Link, LinkJoint, Robot
from cad.export.robot.robot_meshes import collision_files, visual_file
from cad.export.robot.xml_numbers import numbers, roll_pitch_yaw, symmetric
from cad.loads.masses import Body
from optics.mesh import PartMesh


def write_sdf(robot: Robot, path: Path) -> Path:
    """Write a robot whose meshes are in the folder `meshes` beside the file.

    Links hang on their joints' frames; what does not move against its parent is a frame, not a link.
    """
    root = Element("sdf", version="1.11")
    model = SubElement(root, "model", name=robot.name, canonical_link=robot.links[0].name)
    hanging_on = {joint.child: joint for joint in robot.joints}
    for link in robot.links:
        joint = hanging_on.get(link.name)
        if link.body is None and joint is not None:
            frame = SubElement(model, "frame", name=link.name, attached_to=joint.parent)
            _add_pose(frame, joint.parent_from_child)
            continue
        element = SubElement(model, "link", name=link.name)
        if joint is not None:
            SubElement(element, "pose", relative_to=joint.name).text = "0 0 0 0 0 0"
        _fill_link(element, link, path.parent)
    for joint in robot.joints:
        if joint.axis is not None:
            _add_joint(model, joint)
    ElementTree.indent(root)
    path.write_text(ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n", encoding="utf-8")
    return path


def _fill_link(element: Element, link: Link, folder: Path) -> None:
    if link.body is not None:
        _add_inertia(element, link.body)
    for mesh in link.parts:
        visual = SubElement(element, "visual", name=mesh.name)
        _add_mesh(visual, visual_file(mesh))
        _add_material(visual, mesh)
    for mesh in link.parts:
        for file in collision_files(mesh, folder):
            _add_mesh(SubElement(element, "collision", name=file.stem), file)


def _add_mesh(element: Element, file: Path) -> None:
    SubElement(SubElement(SubElement(element, "geometry"), "mesh"), "uri").text = file.as_posix()


def _add_material(visual: Element, mesh: PartMesh) -> None:
    material = SubElement(visual, "material")
    for kind in ("ambient", "diffuse"):
        SubElement(material, kind).text = numbers([*colour_fractions(mesh.role), 1.0])


def _add_inertia(element: Element, body: Body) -> None:
    inertial = SubElement(element, "inertial")
    SubElement(inertial, "pose").text = f"{numbers(body.centre_of_mass_m)} 0 0 0"
    SubElement(inertial, "mass").text = numbers([body.mass_kg])
    inertia = SubElement(inertial, "inertia")
    for name, value in symmetric(body.inertia_kg_m2).items():
        SubElement(inertia, name).text = value


def _add_joint(model: Element, joint: LinkJoint) -> None:
    element = SubElement(model, "joint", name=joint.name, type="revolute")
    _add_pose(element, joint.parent_from_child, relative_to=joint.parent)
    SubElement(element, "parent").text = joint.parent
    SubElement(element, "child").text = joint.child
    axis = SubElement(element, "axis")
    SubElement(axis, "xyz").text = numbers(np.zeros(3) if joint.axis is None else joint.axis)
    limit = SubElement(axis, "limit")
    for name, value in (
        ("lower", joint.lower),
        ("upper", joint.upper),
        ("effort", joint.effort_n_m),
        ("velocity", joint.velocity_rad_per_s),
    ):
        SubElement(limit, name).text = numbers([value])
    if joint.follows is not None:
        mimic = SubElement(axis, "mimic", joint=joint.follows.joint)
        SubElement(mimic, "multiplier").text = numbers([joint.follows.multiplier])
        for name in ("offset", "reference"):
            SubElement(mimic, name).text = "0"


def _add_pose(element: Element, pose: RigidTransform, **attributes: str) -> None:
    text = f"{numbers(pose.translation)} {numbers(roll_pitch_yaw(pose.rotation))}"
    SubElement(element, "pose", attributes).text = text
