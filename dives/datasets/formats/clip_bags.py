"""Clips as ROS 2 bags, `mcap/clip-000000/`: an MCAP file with images, joints, frames and poses, and its metadata.

Topics and frames are those of a dive's bag (`dives.bags`). The images are the set's own files, not encoded again.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform

from cad.export.robot.robot import CAMERA, LinkJoint
from dives.bags import messages
from dives.bags.bag import Write, open_bag
from dives.bags.transform_tree import BODY, WORLD, Motion, driven_joints, fixed_frames, moving_frames, rig_joints
from dives.datasets.dataset import Dataset
from dives.datasets.files import IMAGE_TOPIC
from dives.datasets.formats.trajectories import clips
from dives.datasets.record import Matrix, SampleRecord
from rigs import Camera, Rig

TOPICS = {
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/tf": "tf2_msgs/msg/TFMessage",
    IMAGE_TOPIC: "sensor_msgs/msg/CompressedImage",
    "/camera/camera_info": "sensor_msgs/msg/CameraInfo",
    "/joint_states": "sensor_msgs/msg/JointState",
    "/target/pose": "geometry_msgs/msg/PoseStamped",
}

Records = list[SampleRecord]


def write_mcap(dataset: Dataset, folder: Path, indices: Sequence[int]) -> list[str]:
    """Write a bag for each clip; returns the names of their files."""
    rigs = {rig.name: rig for rig in dataset.rigs.values()}
    joints = {name: () if rig.gaze is None else rig_joints(rig) for name, rig in rigs.items()}
    names = []
    for clip, found in clips(folder, indices):
        name, rig = f"clip-{clip:06d}", rigs[found[0].rig]
        with open_bag(folder / "mcap" / name, TOPICS) as write:
            _write_clip(write, folder, rig, joints[rig.name], found)
        names += [f"mcap/{name}/{name}.mcap", f"mcap/{name}/metadata.yaml"]
    return names


def _write_clip(write: Write, folder: Path, rig: Rig, joints: Sequence[LinkJoint], found: Records) -> None:
    stamps = [messages.nanoseconds(record.time_s - found[0].time_s) for record in found]
    driven = driven_joints(joints)
    values = _joint_values(found, driven)
    still = fixed_frames(joints) if joints else [_mounted_camera(found[0])]
    write("/tf_static", stamps[0], messages.transforms([each.at(0) for each in still], stamps[0]))
    moving = [*_placed(found), *moving_frames(joints, values)]
    for row, (stamp, record) in enumerate(zip(stamps, found, strict=True)):
        write("/tf", stamp, messages.transforms([each.at(row) for each in moving], stamp))
        if driven:
            write("/joint_states", stamp, messages.joint_state(driven, [values[name][row] for name in driven], stamp))
        if record.world_from_target is not None:
            _, _, place, turn = Motion.of(WORLD, "target", _pose(record.world_from_target)).at(0)
            write("/target/pose", stamp, messages.pose(place, turn, stamp, WORLD))
        write("/camera/camera_info", stamp, messages.camera_info(_camera(rig, record), stamp, CAMERA))
        file = folder / record.file("images")
        image = messages.compressed_image(file.read_bytes(), file.suffix, stamp, CAMERA)
        write(IMAGE_TOPIC, stamp, image)


def _joint_values(found: Records, driven: Sequence[str]) -> dict[str, Any]:
    """Radians over the images by the names of the joints; a fold mirror's hinge is in use, at zero."""
    names = {"pan": "q1", "tilt": "q2"}
    return {
        name: np.radians([record.joints_deg[names[name]] if name in names else 0.0 for record in found])
        for name in driven
    }


def _placed(found: Records) -> list[Motion]:
    """The robot in the world, and what is in the water with it."""
    poses: dict[str, list[Matrix | None]] = {BODY: [record.world_from_body for record in found]}
    poses["target"] = [record.world_from_target for record in found]
    for number in range(len(found[0].world_from_decoys)):
        poses[f"decoy_{number}"] = [record.world_from_decoys[number] for record in found]
    return [Motion.of(WORLD, child, _pose(each)) for child, each in poses.items() if each[0] is not None]


def _mounted_camera(record: SampleRecord) -> Motion:
    """The camera of a rig without mirrors."""
    camera = _pose(record.world_from_body).inv() * _pose(record.world_from_virtual_camera["direct"])
    return Motion.of(BODY, CAMERA, camera)


def _pose(matrix: Any) -> RigidTransform:
    return RigidTransform.from_matrix(matrix)


def _camera(rig: Rig, record: SampleRecord) -> Camera:
    """The camera at the size of the images."""
    (fx, _, cx), (_, fy, cy), _ = record.camera_matrix
    size = {"width_px": record.width_px, "height_px": record.height_px}
    return rig.camera.model_copy(update=size | {"fx_px": fx, "fy_px": fy, "cx_px": cx, "cy_px": cy})
