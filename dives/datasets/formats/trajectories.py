"""Trajectories of clips: TUM's text files, and EuRoC's (ASL) folders, whose image lists lead to the set's own images.

Poses are those of robot, target and camera in the world. The camera is the virtual one over both mirrors, or the real
one of a rig without mirrors: right, down, forward.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform

from dives.datasets.dataset import Dataset
from dives.datasets.files import records
from dives.datasets.record import SampleRecord
from optics.kernels.arrays import FloatArray
from rigs.atomic_files import csv_text, write_text

EUROC_HEAD = (
    "#timestamp",
    *(f"p_RS_R_{axis} [m]" for axis in "xyz"),
    *(f"q_RS_{axis} []" for axis in "wxyz"),
    *(f"v_RS_R_{axis} [m s^-1]" for axis in "xyz"),
    *(f"b_w_RS_S_{axis} [rad s^-1]" for axis in "xyz"),
    *(f"b_a_RS_S_{axis} [m s^-2]" for axis in "xyz"),
)

Trajectory = list[tuple[float, FloatArray]]
"""Times, s, and poses, shape (4, 4)."""


def write_tum(dataset: Dataset, folder: Path, indices: Sequence[int]) -> list[str]:
    """Write `trajectories/clip-000000/robot.txt`, `camera.txt` and `target.txt`: time, place, quaternion x y z w."""
    names = []
    for clip, found in clips(folder, indices):
        for whose, trajectory in _trajectories(found).items():
            names.append(f"trajectories/clip-{clip:06d}/{whose}.txt")
            (folder / names[-1]).parent.mkdir(parents=True, exist_ok=True)
            write_text(folder / names[-1], "".join(_tum_line(*each) for each in trajectory))
    return names


def write_euroc(dataset: Dataset, folder: Path, indices: Sequence[int]) -> list[str]:
    """Write `euroc/clip-000000/mav0/`: `cam0` with its images, `state_groundtruth_estimate0` of the robot."""
    names = []
    for clip, found in clips(folder, indices):
        place = f"euroc/clip-{clip:06d}/mav0"
        for name, text in _euroc_texts(dataset, found).items():
            names.append(f"{place}/{name}")
            (folder / names[-1]).parent.mkdir(parents=True, exist_ok=True)
            write_text(folder / names[-1], text)
        # The way from it to the images leads through it.
        (folder / place / "cam0/data").mkdir(exist_ok=True)
    return names


def clips(folder: Path, indices: Sequence[int]) -> Iterator[tuple[int, list[SampleRecord]]]:
    """Records of each clip, in their order."""
    for clip, found in groupby(records(folder, indices), key=lambda record: int(record.clip)):
        yield clip, list(found)


def _trajectories(found: list[SampleRecord]) -> dict[str, Trajectory]:
    times = [record.time_s - found[0].time_s for record in found]
    poses = {
        "robot": [record.world_from_body for record in found],
        "camera": [_camera_pose(record) for record in found],
        "target": [record.world_from_target for record in found],
    }
    return {
        whose: [(time_s, np.array(pose)) for time_s, pose in zip(times, each, strict=True)]
        for whose, each in poses.items()
        if each[0] is not None
    }


def _camera_pose(record: SampleRecord) -> Any:
    virtual = record.world_from_virtual_camera
    return virtual.get("gaze", virtual["direct"])


def _tum_line(time_s: float, pose: FloatArray) -> str:
    placed = RigidTransform.from_matrix(pose)
    numbers = [*placed.translation, *placed.rotation.as_quat(canonical=True)]
    return " ".join([f"{time_s:.6f}", *(f"{number:.9f}" for number in numbers)]) + "\n"


def _euroc_texts(dataset: Dataset, found: list[SampleRecord]) -> dict[str, str]:
    times_ns = [round((record.time_s - found[0].time_s) * 1e9) for record in found]
    # From cam0/data, where readers look, to the set's folder.
    images = [f"../../../../../{record.file('images')}" for record in found]
    rows: list[Sequence[Any]] = [EUROC_HEAD]
    for time_ns, record in zip(times_ns, found, strict=True):
        body = RigidTransform.from_matrix(record.world_from_body)
        velocity = [record.drawn[f"robot.{axis}_m_per_s"] for axis in "xyz"]
        attitude = body.rotation.as_quat(canonical=True, scalar_first=True)
        rows.append((time_ns, *body.translation.tolist(), *attitude.tolist(), *velocity, *[0.0] * 6))
    return {
        "cam0/data.csv": csv_text([("#timestamp [ns]", "filename"), *zip(times_ns, images, strict=True)]),
        "cam0/sensor.yaml": _sensor_yaml(dataset, found[0]),
        "state_groundtruth_estimate0/data.csv": csv_text(rows),
    }


def _sensor_yaml(dataset: Dataset, record: SampleRecord) -> str:
    """The camera in air; that a port and mirrors are before it, no such file can say."""
    (fx, _, cx), (_, fy, cy), _ = record.camera_matrix
    camera = next(rig.camera for rig in dataset.rigs.values() if rig.name == record.rig)
    body_from_world = np.linalg.inv(record.world_from_body)
    mounted = body_from_world @ np.array(record.world_from_virtual_camera["direct"])
    return (
        f"# The camera in air, as it is mounted; port and mirrors are in rigs/{record.rig}.toml.\n"
        "sensor_type: camera\n"
        "T_BS:\n  rows: 4\n  cols: 4\n"
        f"  data: [{', '.join(f'{value:.9f}' for value in mounted.ravel())}]\n"
        f"rate_hz: {dataset.spec.clip.frame_rate_hz:g}\n"
        f"resolution: [{record.width_px}, {record.height_px}]\n"
        f"camera_model: {camera.model}\n"
        f"distortion_coefficients: {list(camera.distortion)}\n"
        f"intrinsics: [{fx:.9g}, {fy:.9g}, {cx:.9g}, {cy:.9g}]\n"
    )
