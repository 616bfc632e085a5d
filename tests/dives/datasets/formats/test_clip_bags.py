"""Clips as bags, read by mcap and mcap-ros2-support: images, times, frames, joints, poses."""

import shutil

import cv2
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from scipy.spatial.transform import RigidTransform, Rotation

from dives.datasets.dataset import parse_dataset
from dives.datasets.files import records
from dives.datasets.formats.clip_bags import write_mcap
from dives.datasets.formats.readback import read_back
from dives.datasets.run import make_dataset

CLIP = """
name = "clip"
samples = 3
seed = 5
formats = ["mcap"]
[scene]
rig = "bench"
world = "blue"
depth_m = 6.0
[robot]
x_m_per_s = 0.2
yaw_deg_per_s = "5..10"
[target]
distance_m = "2..3"
[[decoys]]
distance_m = 1.5
azimuth_deg = 20
[image]
width_px = 160
height_px = 120
sensor = false
jpeg_quality = 90
[clip]
frames = 3
frame_rate_hz = 5.0
"""

POSE_TOLERANCE = 1e-12
"""As of the bags of dives."""


def read(file):
    """Messages by topic."""
    found = {}
    with file.open("rb") as stream:
        for _, channel, _, message in make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            found.setdefault(channel.topic, []).append(message)
    return found


def record(folder, index):
    return next(records(folder, [index]))


def seconds(message):
    return message.header.stamp.sec + message.header.stamp.nanosec * 1e-9


def frames(*messages):
    """Parent and pose in it of each frame."""
    found = {}
    for message in messages:
        for each in message.transforms:
            place, turn = each.transform.translation, each.transform.rotation
            pose = RigidTransform.from_components(
                [place.x, place.y, place.z], Rotation.from_quat([turn.x, turn.y, turn.z, turn.w])
            )
            found[each.child_frame_id] = (each.header.frame_id, pose)
    return found


def in_world(found, child):
    pose = RigidTransform.identity()
    while child != "world":
        child, step = found[child]
        pose = step * pose
    return pose.as_matrix()


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clip") / "set"
    make_dataset(parse_dataset(CLIP, source="clip", folder=folder), folder)
    return folder


def test_a_clip_without_mirrors(clip):
    said = [record(clip, index) for index in range(3)]
    topics = read(clip / "mcap/clip-000000/clip-000000.mcap")
    images = topics["/camera/image_raw/compressed"]
    np.testing.assert_allclose([seconds(each) for each in images], [1.0, 1.2, 1.4], atol=1e-9)
    for each, own in zip(images, said, strict=True):
        assert (each.format, bytes(each.data)) == ("jpeg", (clip / own.file("images")).read_bytes())
        assert cv2.imdecode(np.frombuffer(bytes(each.data), dtype=np.uint8), cv2.IMREAD_COLOR).shape == (120, 160, 3)
    info = topics["/camera/camera_info"][0]
    assert (info.width, info.height) == (160, 120)
    np.testing.assert_array_equal(np.reshape(info.k, (3, 3)), said[0].camera_matrix)
    for moving, own in zip(topics["/tf"], said, strict=True):
        found = frames(*topics["/tf_static"], moving)
        expected = {
            "base_link": own.world_from_body,
            "camera_optical_frame": own.world_from_virtual_camera["direct"],
            "target": own.world_from_target,
            "decoy_0": own.world_from_decoys[0],
        }
        assert found.keys() == expected.keys()
        for child, pose in expected.items():
            np.testing.assert_allclose(in_world(found, child), pose, atol=POSE_TOLERANCE)
    place = topics["/target/pose"][2].pose.position
    np.testing.assert_allclose([place.x, place.y, place.z], np.array(said[2].world_from_target)[:3, 3])
    assert "/joint_states" not in topics
    assert read_back(clip) == ([], [])


def test_what_a_bag_lacks_is_found(clip, tmp_path):
    copied = shutil.copytree(clip, tmp_path / "set")
    image = copied / record(copied, 1).file("images")
    image.write_bytes(image.read_bytes()[:-1])
    (problem,), _ = read_back(copied)
    assert "expected the 3 images of clip 0" in problem
    bag = copied / "mcap/clip-000000/clip-000000.mcap"
    bag.write_bytes(bag.read_bytes()[:-100])
    (problem,), _ = read_back(copied)
    assert "expected an MCAP file" in problem


def test_the_virtual_camera_is_a_frame_of_a_rig_with_mirrors(small_set, made, tmp_path):
    copied = shutil.copytree(made, tmp_path / "set")
    names = write_mcap(small_set, copied, [3])
    assert names == ["mcap/clip-000003/clip-000003.mcap", "mcap/clip-000003/metadata.yaml"]
    own, topics = record(copied, 3), read(copied / names[0])
    found = frames(*topics["/tf_static"], *topics["/tf"])
    for child, region in (("camera_optical_frame", "direct"), ("virtual_camera_optical_frame", "gaze")):
        expected = own.world_from_virtual_camera[region]
        np.testing.assert_allclose(in_world(found, child), expected, atol=POSE_TOLERANCE)
    (joints,) = topics["/joint_states"]
    told = dict(zip(joints.name, joints.position, strict=True))
    assert told == {name: np.radians(own.joints_deg[key]) for name, key in (("pan", "q1"), ("tilt", "q2"))}
