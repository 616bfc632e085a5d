"""Write a finished dive as a ROS 2 bag: one MCAP file and its metadata, the same bytes for the same dive."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

from rosbags.interfaces import Connection, Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from cad.export.robot.robot import CAMERA, LinkJoint
from dives.bags import messages
from dives.bags.facts import Facts
from dives.bags.messages import TYPESTORE, Message
from dives.bags.recording import Recording
from dives.bags.transform_tree import fixed_frames, rig_joints
from rigs import Rig
from rigs.atomic_files import scratch_folder

METADATA_VERSION: Literal[8] = 8
"""Of rosbag2's metadata: the newest that Humble reads (version 9 writes qualities of service another way)."""

FOREVER = QosTime(0, 0)
LATCHED = Qos(
    history=QosHistory.KEEP_LAST,
    depth=1,
    reliability=QosReliability.RELIABLE,
    durability=QosDurability.TRANSIENT_LOCAL,
    deadline=FOREVER,
    lifespan=FOREVER,
    liveliness=QosLiveliness.AUTOMATIC,
    liveliness_lease_duration=FOREVER,
    avoid_ros_namespace_conventions=False,
)
"""For what is said once and must reach those who come later."""

TOPICS = {
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/camera/image_raw": "sensor_msgs/msg/Image",
    "/camera/camera_info": "sensor_msgs/msg/CameraInfo",
    "/joint_states": "sensor_msgs/msg/JointState",
    "/joint_states/commanded": "sensor_msgs/msg/JointState",
    "/joint_states/estimated": "sensor_msgs/msg/JointState",
    "/target/truth": "geometry_msgs/msg/PointStamped",
    "/target/estimated_direction": "geometry_msgs/msg/Vector3Stamped",
    "/target/detected_px": "geometry_msgs/msg/PointStamped",
    "/tracking/mode": "std_msgs/msg/String",
}


def write_bag(
    folder: Path, rig: Rig, path: Path, *, progress: Callable[[int, int], None] = lambda done, total: None
) -> Path:
    """Write a dive's images, joints, frames and truth as a ROS 2 bag.

    Parameters
    ----------
    folder : Path
        Of a finished dive: log, video, and the dive's own file, which says how the robot moved.
    rig : Rig
        The one that dived.
    path : Path
        Folder of the bag. A bag that is there is replaced.
    progress : callable
        Told the number of images written and of all images.

    Returns
    -------
    Path
        The bag's folder, with `metadata.yaml` and the MCAP file.

    Raises
    ------
    ValueError
        When the folder holds no finished dive, or one of another camera; with every problem that shows at once.
    FileExistsError
        When something else than a bag is at `path`.
    """
    check_place(path)
    recording = Recording.open(folder, rig)
    joints = rig_joints(rig)
    with open_bag(path, TOPICS) as write:
        _write_all(write, recording, rig, joints, progress)
    return path


Write = Callable[[str, int, Message], None]
"""Writes a message by its topic and its time, nanoseconds."""


def check_place(path: Path) -> None:
    """`FileExistsError` when something else than a bag is at a path."""
    if path.exists() and not (path / "metadata.yaml").is_file():
        raise FileExistsError(f"{path}: expected nothing or an earlier bag, got something else")


@contextmanager
def open_bag(path: Path, topics: Mapping[str, str]) -> Iterator[Write]:
    """Give what writes messages into a new bag, whose types are given by topic; at the end it replaces an earlier one.

    When the block fails nothing changes.
    """
    check_place(path)
    with scratch_folder(path.parent, path.name) as scratch:
        # The bag's name is written into it, so it is made under its own name in another folder.
        made = scratch / path.name
        writer = Writer(made, version=METADATA_VERSION, storage_plugin=StoragePlugin.MCAP)
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        with writer:
            connections = {topic: _connection(writer, topic, kind) for topic, kind in topics.items()}

            def write(topic: str, stamp: int, message: Message) -> None:
                connection = connections[topic]
                writer.write(connection, stamp, TYPESTORE.serialize_cdr(message, connection.msgtype))

            yield write
        if path.exists():
            shutil.rmtree(path)
        made.rename(path)


def _connection(writer: Writer, topic: str, kind: str) -> Connection:
    qualities = [LATCHED] if topic == "/tf_static" else []
    return writer.add_connection(topic, kind, typestore=TYPESTORE, offered_qos_profiles=qualities)


def _write_all(
    write: Write,
    recording: Recording,
    rig: Rig,
    joints: tuple[LinkJoint, ...],
    progress: Callable[[int, int], None],
) -> None:
    stamps = [messages.nanoseconds(time_s) for time_s in recording.number("time_s")]
    still = [motion.at(0) for motion in fixed_frames(joints)]
    write("/tf_static", stamps[0], messages.transforms(still, stamps[0]))
    facts = Facts.of(recording, rig, joints)
    for row, (stamp, image) in enumerate(zip(stamps, recording.images(), strict=True)):
        for topic, message in facts.at(row, stamp):
            write(topic, stamp, message)
        write("/camera/camera_info", stamp, messages.camera_info(rig.camera, stamp, CAMERA))
        write("/camera/image_raw", stamp, messages.image(image, stamp, CAMERA))
        progress(row + 1, len(stamps))
