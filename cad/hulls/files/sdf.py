"""SDF: the links of one model where their poses put them, in the axes of the model."""

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

FRAMES = ("link", "joint", "frame")


def read_sdf(file: Path, read_mesh: ReadMesh) -> FoundHull:
    """Robot of an SDF file; raises `ValueError` with all that is wrong or missing."""
    model = sdf_model(file)
    problems = Problems()
    for other in ("include", "model"):
        names = [str(each.get("name") or each.findtext("uri") or "") for each in model.findall(other)]
        if names:
            said = f"expected links only, got {other} ({', '.join(names)})"
            problems.said.append(f"{said}; write it out in one with: gz sdf -p {file.name} > one.sdf")
    return put_together(file, _description(model, problems), problems, read_mesh)


def sdf_model(file: Path) -> ET.Element:
    """The only model of an SDF file; raises `ValueError` when there is not exactly one."""
    root = xml_root(file.read_bytes(), "an SDF")
    if root.tag != "sdf":
        raise ValueError(f"expected an SDF, whose first element is sdf, got {root.tag}; {ROBOT_AGAIN}")
    models = [*root.findall("model"), *root.findall("world/model")]
    if len(models) != 1:
        names = ", ".join(str(model.get("name")) for model in models) or "none"
        raise ValueError(f"expected one model, got {len(models)} ({names}); name the file of the robot alone")
    return models[0]


def _description(model: ET.Element, problems: Problems) -> Description:
    frames = _Frames(model, problems)
    visuals: list[Shape] = []
    collisions: list[Shape] = []
    cameras: list[FoundCamera] = []
    mass = 0.0
    for link in model.findall("link"):
        name = str(link.get("name"))
        for kind, shapes in (("visual", visuals), ("collision", collisions)):
            for shape in link.findall(kind):
                geometry = shape.find("geometry")
                if geometry is not None:
                    shapes.append(Shape(geometry=geometry, pose=frames.pose(shape, name), name=name))
        mass += numbers(link.findtext("inertial/mass"), 1, f"{name}: mass", problems)[0]
        sensors = [sensor for sensor in link.findall("sensor") if "camera" in str(sensor.get("type"))]
        cameras += [camera(str(each.get("name")), frames.pose(each, name), x_forward=True) for each in sensors]
        if is_camera(name) and not sensors:
            cameras.append(camera(name, frames.pose(link, "")))
    return Description(visuals=visuals, collisions=collisions, mass_kg=mass, cameras=cameras)


class _Frames:
    """Poses of a model's links, joints and frames in the model, each found when it is asked for."""

    def __init__(self, model: ET.Element, problems: Problems):
        self.problems = problems
        self.named = {str(each.get("name")): each for kind in FRAMES for each in model.findall(kind)}

    def pose(self, element: ET.Element, base: str, passed: tuple[str, ...] = ()) -> RigidTransform:
        """Pose of an element in the model; `base` is what its pose refers to when it does not say."""
        pose = element.find("pose")
        where = f"{element.get('name') or element.tag}: pose"
        text = None if pose is None or not (pose.text or "").strip() else pose.text
        in_degrees = pose is not None and pose.get("degrees") == "true"
        values = numbers(text, 6, where, self.problems)
        named = "" if pose is None else pose.get("relative_to", pose.get("frame", ""))
        above = named or base
        own = pose_of(values[:3], values[3:], degrees=in_degrees)
        if above in ("", "__model__"):
            return own
        if above not in self.named or above in passed:
            found = "a circle through" if above in passed else "no"
            self.problems.said.append(f"{where}: expected a frame of the model, got {found} {above!r}")
            return own
        return self._of_name(above, (*passed, above)) * own

    def _of_name(self, name: str, passed: tuple[str, ...]) -> RigidTransform:
        element = self.named[name]
        base = {"joint": element.findtext("child", ""), "frame": element.get("attached_to", "")}
        return self.pose(element, base.get(element.tag, "").strip(), passed)
