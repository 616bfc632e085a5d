"""ROS 2 messages made from plain numbers: REP-103 units (metres, radians), quaternions (x, y, z, w)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from optics.kernels.arrays import FloatArray
from rigs import Camera, PinholeSpec

TYPESTORE = get_typestore(Stores.ROS2_HUMBLE)
"""Oldest distribution still supported; these messages have not changed since."""

EPOCH_S = 1
"""Clock at a dive's second zero: to tf2 a stamp of zero means "the latest there is"."""

Message = Any
"""A class that the type store makes from a message definition."""


def nanoseconds(time_s: float) -> int:
    """Time of a dive on the bag's clock."""
    return round(time_s * 1e9) + EPOCH_S * 1_000_000_000


def image(pixels: NDArray[np.uint8], stamp_ns: int, frame: str) -> Message:
    """`sensor_msgs/Image`, rgb8, from uint8 sRGB of shape (height, width, 3)."""
    height, width = pixels.shape[:2]
    return _message("sensor_msgs/msg/Image")(
        header=header(stamp_ns, frame),
        height=height,
        width=width,
        encoding="rgb8",
        is_bigendian=0,
        step=3 * width,
        data=np.ascontiguousarray(pixels).reshape(-1),
    )


def compressed_image(content: bytes, suffix: str, stamp_ns: int, frame: str) -> Message:
    """`sensor_msgs/CompressedImage` of a PNG or JPEG file with its name's ending."""
    return _message("sensor_msgs/msg/CompressedImage")(
        header=header(stamp_ns, frame),
        format="png" if suffix == ".png" else "jpeg",
        data=np.frombuffer(content, dtype=np.uint8),
    )


def camera_info(camera: Camera, stamp_ns: int, frame: str) -> Message:
    """`sensor_msgs/CameraInfo` of the rig's camera, as it is in air: OpenCV's distortion, nothing rectified.

    ROS counts pixels as we do: the centre of the top-left one is (0, 0).
    """
    if isinstance(camera, PinholeSpec):
        model = "plumb_bob" if len(camera.distortion) == 5 else "rational_polynomial"
    else:
        model = "equidistant"
    matrix = np.array([[camera.fx_px, 0.0, camera.cx_px], [0.0, camera.fy_px, camera.cy_px], [0.0, 0.0, 1.0]])
    region = _message("sensor_msgs/msg/RegionOfInterest")
    return _message("sensor_msgs/msg/CameraInfo")(
        header=header(stamp_ns, frame),
        height=camera.height_px,
        width=camera.width_px,
        distortion_model=model,
        d=np.array(camera.distortion, dtype=np.float64),
        k=matrix.ravel(),
        r=np.eye(3).ravel(),
        p=np.hstack([matrix, np.zeros((3, 1))]).ravel(),
        binning_x=0,
        binning_y=0,
        roi=region(x_offset=0, y_offset=0, height=0, width=0, do_rectify=False),
    )


def joint_state(names: Sequence[str], positions: Sequence[float], stamp_ns: int) -> Message:
    """`sensor_msgs/JointState` of positions in radians; nothing is said of velocity and effort."""
    empty = np.zeros(0)
    return _message("sensor_msgs/msg/JointState")(
        header=header(stamp_ns, ""),
        name=list(names),
        position=np.array(positions, dtype=np.float64),
        velocity=empty,
        effort=empty,
    )


def transforms(poses: Sequence[tuple[str, str, FloatArray, FloatArray]], stamp_ns: int) -> Message:
    """`tf2_msgs/TFMessage` of (parent, child, translation in metres, quaternion)."""
    stamped, rigid = (_message(f"geometry_msgs/msg/{name}") for name in ("TransformStamped", "Transform"))
    vector, quaternion = (_message(f"geometry_msgs/msg/{name}") for name in ("Vector3", "Quaternion"))
    return _message("tf2_msgs/msg/TFMessage")(
        transforms=[
            stamped(
                header=header(stamp_ns, parent),
                child_frame_id=child,
                transform=rigid(
                    translation=vector(**_components("xyz", translation)),
                    rotation=quaternion(**_components("xyzw", turn)),
                ),
            )
            for parent, child, translation, turn in poses
        ]
    )


def point(coordinates: Sequence[float] | FloatArray, stamp_ns: int, frame: str) -> Message:
    """`geometry_msgs/PointStamped`."""
    xyz = _message("geometry_msgs/msg/Point")(**_components("xyz", coordinates))
    return _message("geometry_msgs/msg/PointStamped")(header=header(stamp_ns, frame), point=xyz)


def vector(components: FloatArray, stamp_ns: int, frame: str) -> Message:
    """`geometry_msgs/Vector3Stamped`."""
    xyz = _message("geometry_msgs/msg/Vector3")(**_components("xyz", components))
    return _message("geometry_msgs/msg/Vector3Stamped")(header=header(stamp_ns, frame), vector=xyz)


def pose(translation_m: FloatArray, quaternion: FloatArray, stamp_ns: int, frame: str) -> Message:
    """`geometry_msgs/PoseStamped`."""
    place = _message("geometry_msgs/msg/Point")(**_components("xyz", translation_m))
    turn = _message("geometry_msgs/msg/Quaternion")(**_components("xyzw", quaternion))
    placed = _message("geometry_msgs/msg/Pose")(position=place, orientation=turn)
    return _message("geometry_msgs/msg/PoseStamped")(header=header(stamp_ns, frame), pose=placed)


def string(text: str) -> Message:
    """`std_msgs/String`."""
    return _message("std_msgs/msg/String")(data=text)


def header(stamp_ns: int, frame: str) -> Message:
    """`std_msgs/Header`."""
    seconds, rest = divmod(stamp_ns, 1_000_000_000)
    time = _message("builtin_interfaces/msg/Time")(sec=seconds, nanosec=rest)
    return _message("std_msgs/msg/Header")(stamp=time, frame_id=frame)


def _message(name: str) -> Message:
    return TYPESTORE.types[name]


def _components(names: str, values: Sequence[float] | FloatArray) -> dict[str, float]:
    return {name: float(value) for name, value in zip(names, values, strict=True)}
