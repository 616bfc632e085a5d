"""The folder that describes the mount to simulators and to ROS: URDF, SDF and their meshes."""

from __future__ import annotations

from pathlib import Path

from cad.assembly.assembly import Assembly
from cad.export.robot.robot import robot_model
from cad.export.robot.robot_meshes import write_robot_meshes
from cad.export.robot.sdf import write_sdf
from cad.export.robot.urdf import write_urdf


def write_robot(assembly: Assembly, folder: Path) -> list[Path]:
    """Write URDF and SDF with the meshes they point at; the folder can be moved as a whole."""
    rig = assembly.rig
    swinging = {part.name for part in assembly.parts if part.stows}
    robot = robot_model(rig, assembly.layout, assembly.meshes, hinge=assembly.stow, swinging=swinging)
    write_robot_meshes([mesh for link in robot.links for mesh in link.parts], folder)
    return [write_urdf(robot, folder / f"{rig.name}.urdf"), write_sdf(robot, folder / f"{rig.name}.sdf")]
