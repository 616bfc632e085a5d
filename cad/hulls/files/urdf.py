"""URDF, also written with xacro: links posed with all joints at zero, in the axes of the base link."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

from scipy.spatial.transform import RigidTransform

from cad.hulls.files.found import FoundCamera, FoundHull
from cad.hulls.files.links import (
    ROBOT_AGAIN,
    Description,
    Problems,
    ReadMesh,
    Shape,
    camera,
    is_camera,
    numbers,
    pose_of,
    put_together,
    xml_root,
)

XACRO = "{http://www.ros.org/wiki/xacro}"


def read_urdf(file: Path, read_mesh: ReadMesh) -> FoundHull:
    """Robot of a URDF file; raises `ValueError` with all that is wrong or missing."""
    return _read(file, urdf_root(file), read_mesh)


def urdf_root(file: Path) -> ET.Element:
    """Root of a URDF file, macros expanded; raises `ValueError` when there is no robot in it."""
    root = xml_root(file.read_bytes(), "a URDF")
    if root.tag != "robot":
        raise ValueError(f"expected a URDF, whose first element is robot, got {root.tag}; {ROBOT_AGAIN}")
    if any(str(element.tag).startswith(XACRO) for element in root.iter()):
        root = xml_root(_expanded(file), "a URDF")
    return root


def _expanded(file: Path) -> str:
    """Text of a file with macros; the package xacro expands them where it is installed."""
    target = file.name.removesuffix(".xacro")
    target = target if target.endswith(".urdf") else f"{target}.urdf"
    by_hand = f"expand it with: xacro {file.name} > {target}"
    try:
        import xacro  # noqa: PLC0415  (its users have it)
    except ImportError:
        raise ValueError(
            f"expected a URDF without macros, got one of xacro's; {by_hand}   (pip install xacro, or ROS's own)"
        ) from None
    try:
        return str(xacro.process_file(str(file)).toxml())
    except Exception as error:
        # A macro may do anything, and find packages that are not here.
        said = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"expected macros that xacro expands, got {said}; {by_hand}") from None


def _read(file: Path, root: ET.Element, read_mesh: ReadMesh) -> FoundHull:
    problems = Problems()
    links = {str(link.get("name")): link for link in root.findall("link")}
    poses = _poses(root, set(links), problems)
    visuals, collisions, cameras, mass = [], [], [], 0.0
    for name, link in links.items():
        pose = poses.get(name, RigidTransform.identity())
        visuals += _shapes(link, "visual", pose, problems)
        collisions += _shapes(link, "collision", pose, problems)
        mass += numbers(_attribute(link, "inertial/mass", "value"), 1, f"{name}: mass", problems)[0]
        if is_camera(name):
            cameras.append(camera(name, pose))
    cameras += _sensors(root, poses, problems)
    description = Description(visuals=visuals, collisions=collisions, mass_kg=mass, cameras=cameras)
    return put_together(file, description, problems, read_mesh)


def _poses(root: ET.Element, links: set[str], problems: Problems) -> dict[str, RigidTransform]:
    """Pose of each link in the base link, all joints at zero."""
    joints = [_joint(joint, links, problems) for joint in root.findall("joint")]
    children = {child for _, child, _ in joints}
    bases = sorted(links - children)
    if len(bases) != 1:
        got = ", ".join(bases) or ("none: the joints go round in a circle" if links else "no link at all")
        problems.said.append(f"expected one link that is no joint's child, got {got}")
    poses = {base: RigidTransform.identity() for base in bases[:1]}
    ahead = list(poses)
    while ahead:
        parent = ahead.pop()
        for above, child, pose in joints:
            if above == parent and child not in poses:
                poses[child] = poses[parent] * pose
                ahead.append(child)
    return poses


def _joint(joint: ET.Element, links: set[str], problems: Problems) -> tuple[str, str, RigidTransform]:
    name = joint.get("name")
    ends = [str(_attribute(joint, end, "link")) for end in ("parent", "child")]
    for end in ends:
        if end not in links:
            problems.said.append(f"joint {name!r}: expected the name of a link, got {end!r}")
    return ends[0], ends[1], _origin(joint, f"joint {name!r}", problems)


def _shapes(link: ET.Element, kind: str, pose: RigidTransform, problems: Problems) -> list[Shape]:
    name = str(link.get("name"))
    return [
        Shape(geometry=geometry, pose=pose * _origin(shape, f"{name}: {kind}", problems), name=name)
        for shape in link.findall(kind)
        if (geometry := shape.find("geometry")) is not None
    ]


def _sensors(root: ET.Element, poses: dict[str, RigidTransform], problems: Problems) -> list[FoundCamera]:
    """Cameras that a simulator has on links that are not called so."""
    found = []
    for on_link in root.findall("gazebo"):
        link = on_link.get("reference")
        for sensor in on_link.iter("sensor"):
            if link in poses and not is_camera(link) and "camera" in str(sensor.get("type")):
                numbers_of = numbers(sensor.findtext("pose"), 6, f"sensor {sensor.get('name')!r}: pose", problems)
                pose = poses[link] * pose_of(numbers_of[:3], numbers_of[3:])
                found.append(camera(str(sensor.get("name")), pose, x_forward=True))
    return found


def _origin(element: ET.Element, where: str, problems: Problems) -> RigidTransform:
    xyz, rpy = (
        numbers(_attribute(element, "origin", key), 3, f"{where}: origin {key}", problems) for key in ("xyz", "rpy")
    )
    return pose_of(xyz, rpy)


def _attribute(element: ET.Element, path: str, key: str) -> str | None:
    found = element.find(path)
    return None if found is None else found.get(key)
