"""Bags of a dive made by hand, read back by mcap and mcap-ros2-support: numbers, frames, images, bytes, sentences."""

from __future__ import annotations

import shutil
import weakref
from collections import defaultdict
from xml.etree import ElementTree

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from scipy.spatial.transform import RigidTransform, Rotation

from cad.assembly.meshes import rig_meshes
from cad.export.robot.robot import Robot
from cad.export.robot.urdf import write_urdf
from dives import Dive
from dives.bags import messages, recording, transform_tree, write_bag
from dives.bags.transform_tree import driven_joints, fixed_frames, moving_frames, rig_joints
from dives.paths import body_pose, target_pose
from dives.recorder import png
from optics.gaze.kinematics import virtual_camera
from optics.layout import Layout
from rigs import FisheyeSpec, PinholeSpec, Rig
from rigs.mounting import StowJoint
from tracking.log import COLUMNS, SCHEMA
from tracking.video import VideoWriter

FRAMES = 5
RATE_HZ = 10.0
FOUND = (1, 3, 4)
"""Frames with a detection."""

POSE_TOLERANCE = 1e-12
"""Metres and entries of rotation matrices: some ten products of numbers of order 1 in float64."""

DIVE = f"""
name = "by-hand"
rig = "aqua2"
world = "tank"
depth_m = 6.0
frame_rate_hz = {RATE_HZ}
duration_s = {FRAMES / RATE_HZ}

[target.path]
shape = "straight"
start_m = [3.0, 1.0, -0.5]
velocity_m_per_s = [0.0, 1.0, 0.2]

[robot]
motion = "hover"
sway.amplitude_m = [0.1, 0.2, 0.05]
sway.turn_deg = [5.0, 3.0, 8.0]
"""


@pytest.fixture(scope="module")
def rig():
    return Rig.load("aqua2")


@pytest.fixture(scope="module")
def images(rig):
    rng = np.random.default_rng(7)
    shape = (rig.camera.height_px, rig.camera.width_px, 3)
    # Smooth enough to be quick to compress, different in every frame and channel.
    ramp = np.linspace(0, 200, shape[1])[np.newaxis, :, np.newaxis] * np.ones(shape)
    return [(ramp + rng.uniform(0, 55, 3)).astype(np.uint8) for _ in range(FRAMES)]


def a_table(rig, dive):
    """Log with numbers in every column that a bag takes, the target's true place among them."""
    rng = np.random.default_rng(3)
    time_s = np.arange(FRAMES) / dive.frame_rate_hz
    centre = Layout.from_rig(rig).body_from_gimbal.translation
    to_target = [body_pose(dive, t).inv().apply(target_pose(dive, t).translation) - centre for t in time_s.tolist()]
    x, y, z = np.array(to_target).T
    found = np.isin(np.arange(FRAMES), FOUND)
    data = {
        "frame": np.arange(FRAMES),
        "time_s": time_s,
        "mode": ["scan", *["track"] * (FRAMES - 1)],
        "detected": found,
        "true_azimuth_deg": np.degrees(np.arctan2(y, x)),
        "true_elevation_deg": np.degrees(np.arctan2(z, np.hypot(x, y))),
        "target_distance_m": np.sqrt(x * x + y * y + z * z),
        "estimated_azimuth_deg": np.where(found, 20.0, np.nan),
        "estimated_elevation_deg": np.where(found, -10.0, np.nan),
        "detected_thing": [""] * FRAMES,
        "cause_of_loss": [""] * FRAMES,
    }
    for column in COLUMNS:
        if column.name.startswith(("q1", "q2")):
            data[column.name] = rng.uniform(-30, 30, FRAMES)
        elif column.name.startswith("centroid"):
            data[column.name] = np.where(found, rng.uniform(0, 239, FRAMES), np.nan)
        elif column.name not in data:
            data[column.name] = np.zeros(FRAMES, dtype=column.kind.to_pandas_dtype())
    return pa.table({name: pa.array(data[name], type=SCHEMA.field(name).type) for name in SCHEMA.names}, schema=SCHEMA)


def write_folder(folder, rig, images):
    folder.mkdir()
    (folder / "dive.toml").write_text(DIVE)
    pq.write_table(a_table(rig, Dive.load(folder / "dive.toml")), folder / "log.parquet")
    write_video(folder / "video.mkv", images)
    return folder


def write_video(path, images):
    writer = VideoWriter(path, "ffv1", RATE_HZ)
    for image in images:
        writer.write(image)
    writer.close()


@pytest.fixture(scope="module")
def folder(rig, images, tmp_path_factory):
    return write_folder(tmp_path_factory.mktemp("dives") / "by_hand", rig, images)


@pytest.fixture
def own_folder(folder, tmp_path):
    """A copy that a test may spoil."""
    return shutil.copytree(folder, tmp_path / "spoilt")


@pytest.fixture(scope="module")
def table(folder):
    return pq.read_table(folder / "log.parquet")


@pytest.fixture(scope="module")
def bag(folder, rig, tmp_path_factory):
    return write_bag(folder, rig, tmp_path_factory.mktemp("bags") / "dive.bag")


def read(bag):
    """Messages by topic as (log time, type, message), by a reader that is not ours."""
    found = defaultdict(list)
    (file,) = bag.glob("*.mcap")
    with file.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            found[channel.topic].append((message.log_time, schema.name, decoded))
    return found


@pytest.fixture(scope="module")
def topics(bag):
    return read(bag)


def stamp_s(message):
    return message.header.stamp.sec + message.header.stamp.nanosec * 1e-9


def pose_of(transform):
    place, turn = transform.transform.translation, transform.transform.rotation
    return RigidTransform.from_components(
        [place.x, place.y, place.z], Rotation.from_quat([turn.x, turn.y, turn.z, turn.w])
    )


def chain(static, moving, child, root="world"):
    """Pose of a frame in the root by going up from parent to parent, as tf does."""
    parents = {t.child_frame_id: t for t in [*static.transforms, *moving.transforms]}
    pose = RigidTransform.identity()
    while child != root:
        step = parents[child]
        pose, child = pose_of(step) * pose, step.header.frame_id
    return pose


def test_every_topic_has_its_type_and_number(topics):
    often = {
        "/tf": "tf2_msgs/msg/TFMessage",
        "/camera/image_raw": "sensor_msgs/msg/Image",
        "/camera/camera_info": "sensor_msgs/msg/CameraInfo",
        "/joint_states": "sensor_msgs/msg/JointState",
        "/joint_states/commanded": "sensor_msgs/msg/JointState",
        "/joint_states/estimated": "sensor_msgs/msg/JointState",
        "/target/truth": "geometry_msgs/msg/PointStamped",
        "/tracking/mode": "std_msgs/msg/String",
    }
    found = {topic: ({kind for _, kind, _ in said}, len(said)) for topic, said in topics.items()}
    assert found == {topic: ({kind}, FRAMES) for topic, kind in often.items()} | {
        "/tf_static": ({"tf2_msgs/msg/TFMessage"}, 1),
        "/target/estimated_direction": ({"geometry_msgs/msg/Vector3Stamped"}, len(FOUND)),
        "/target/detected_px": ({"geometry_msgs/msg/PointStamped"}, len(FOUND)),
    }


def test_stamps_are_the_logs_times_one_second_on(topics, table):
    # A stamp of zero would mean "the latest there is" to tf2.
    for topic in ("/camera/image_raw", "/camera/camera_info", "/joint_states", "/target/truth"):
        stamps = [stamp_s(message) for _, _, message in topics[topic]]
        np.testing.assert_allclose(stamps, 1 + table["time_s"].to_numpy(), atol=1e-9)  # a nanosecond
        np.testing.assert_array_equal([at for at, _, _ in topics[topic]], np.round(np.array(stamps) * 1e9))


def test_images_come_back_pixel_by_pixel(topics, images):
    for (_, _, message), image in zip(topics["/camera/image_raw"], images, strict=True):
        assert (message.encoding, message.header.frame_id) == ("rgb8", "camera_optical_frame")
        assert message.step == 3 * message.width
        back = np.frombuffer(bytes(message.data), dtype=np.uint8).reshape(message.height, message.width, 3)
        np.testing.assert_array_equal(back, image)


def test_camera_info_is_the_rigs_camera_in_air(topics, rig):
    _, _, info = topics["/camera/camera_info"][0]
    camera = rig.camera
    assert (info.width, info.height, info.distortion_model) == (camera.width_px, camera.height_px, "plumb_bob")
    assert list(info.d) == list(camera.distortion)
    matrix = [[camera.fx_px, 0, camera.cx_px], [0, camera.fy_px, camera.cy_px], [0, 0, 1]]
    np.testing.assert_array_equal(np.reshape(info.k, (3, 3)), matrix)
    np.testing.assert_array_equal(np.reshape(info.p, (3, 4)), np.hstack([matrix, np.zeros((3, 1))]))
    np.testing.assert_array_equal(np.reshape(info.r, (3, 3)), np.eye(3))


@pytest.mark.parametrize(
    ("kind", "model", "distortion", "name"),
    [
        (PinholeSpec, "pinhole", (0.1,) * 8, "rational_polynomial"),
        (FisheyeSpec, "fisheye", (0.1, 0.2, 0.3, 0.4), "equidistant"),
    ],
)
def test_other_lenses_have_the_names_that_ros_gives_them(rig, kind, model, distortion, name):
    camera = kind.model_validate(rig.camera.model_dump() | {"model": model, "distortion": distortion})
    info = messages.camera_info(camera, 1, "camera_optical_frame")
    assert (info.distortion_model, tuple(info.d)) == (name, distortion)


def test_joints_are_those_of_the_log_and_named_as_in_the_urdf(topics, table, rig, tmp_path):
    names = urdf_joints(rig_joints(rig), tmp_path)
    for topic, kind in (("", "true"), ("/commanded", "command"), ("/estimated", "estimated")):
        said = topics[f"/joint_states{topic}"]
        expected = [np.radians(table[f"q{joint}_{kind}_deg"].to_numpy()) for joint in (1, 2)]
        assert all(list(message.name) == names for _, _, message in said)
        np.testing.assert_array_equal([message.position for _, _, message in said], np.transpose(expected))


def urdf_joints(joints, folder):
    """Names of the joints that turn and do not follow another, as an exported URDF spells them."""
    path = write_urdf(Robot(name="joints", links=(), joints=joints), folder / "joints.urdf")
    found = ElementTree.parse(path).getroot().findall("joint")
    return [joint.get("name") for joint in found if joint.get("type") != "fixed" and joint.find("mimic") is None]


def test_a_fold_mirror_on_a_hinge_is_a_joint_too(rig, tmp_path, monkeypatch):
    parts = rig_meshes(rig)
    # The rig with the hinge has other parts, which cost half a minute; joints do not depend on them.
    monkeypatch.setattr(transform_tree, "rig_meshes", lambda rig: parts)
    joints = rig.gaze.joints.model_copy(update={"stow": StowJoint(max_deg=90.0)})
    tree = rig_joints(rig.with_gaze(joints=joints))
    assert sorted(driven_joints(tree)) == sorted(urdf_joints(tree, tmp_path)) == ["pan", "stow", "tilt"]
    moving = moving_frames(tree, {"pan": np.zeros(1), "tilt": np.zeros(1), "stow": np.zeros(1)})
    in_use = chain_of([*fixed_frames(tree), *moving], "fold_mirror_frame")
    expected = Layout.from_rig(rig).body_from_m1.as_matrix()
    np.testing.assert_allclose(in_use.as_matrix(), expected, atol=POSE_TOLERANCE)


def chain_of(motions, child):
    """As `chain`, from motions, in the body."""
    parents = {motion.child: motion for motion in motions}
    pose = RigidTransform.identity()
    while child != "base_link":
        child, _, place, turn = parents[child].at(0)
        pose = RigidTransform.from_components(place, Rotation.from_quat(turn)) * pose
    return pose


def test_the_frames_are_one_tree_under_the_world(topics):
    ((_, _, static),) = topics["/tf_static"]
    for _, _, moving in topics["/tf"]:
        both = [*static.transforms, *moving.transforms]
        children = [transform.child_frame_id for transform in both]
        assert len(children) == len(set(children))  # one parent each
        assert {transform.header.frame_id for transform in both} - set(children) == {"world"}
        assert "base_link" in children


def test_the_virtual_camera_is_where_two_reflections_put_it(topics, table, rig, folder):
    dive = Dive.load(folder / "dive.toml")
    layout = Layout.from_rig(rig)
    q = np.radians([table[f"q{joint}_true_deg"].to_numpy() for joint in (1, 2)]).T
    ((_, _, static),) = topics["/tf_static"]
    for row, (_, _, moving) in enumerate(topics["/tf"]):
        world_from_body = body_pose(dive, float(table["time_s"][row].as_py()))
        expected = world_from_body * virtual_camera(layout, *q[row])
        found = chain(static, moving, "virtual_camera_optical_frame")
        np.testing.assert_allclose(found.as_matrix(), expected.as_matrix(), atol=POSE_TOLERANCE)
        real = chain(static, moving, "camera_optical_frame")
        np.testing.assert_allclose(
            real.as_matrix(), (world_from_body * layout.body_from_camera).as_matrix(), atol=POSE_TOLERANCE
        )
        mirror = chain(static, moving, "tilt_link")
        np.testing.assert_allclose(
            mirror.as_matrix(), (world_from_body * layout.body_from_m2(*q[row])).as_matrix(), atol=POSE_TOLERANCE
        )


def test_the_target_is_where_the_dive_says_in_the_world(topics, folder):
    dive = Dive.load(folder / "dive.toml")
    ((_, _, static),) = topics["/tf_static"]
    for (_, _, moving), (_, _, said) in zip(topics["/tf"], topics["/target/truth"], strict=True):
        assert said.header.frame_id == "base_link"
        place = chain(static, moving, "base_link").apply([said.point.x, said.point.y, said.point.z])
        # The dive's own path at the stamp's time; stamps are rounded to a nanosecond.
        np.testing.assert_allclose(place, target_pose(dive, stamp_s(said) - 1).translation, atol=1e-8)


def test_what_the_loop_found_is_said_and_nothing_else(topics, table):
    for _, _, message in topics["/target/estimated_direction"]:
        said = [message.vector.x, message.vector.y, message.vector.z]
        azimuth, elevation = np.radians([20.0, -10.0])
        expected = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
        np.testing.assert_allclose(said, expected, atol=1e-15)  # rounding
    detected = [(m.point.x, m.point.y, m.point.z, m.header.frame_id) for _, _, m in topics["/target/detected_px"]]
    x, y = (table[f"centroid_{axis}_px"].to_pylist() for axis in "xy")
    assert detected == [(x[row], y[row], 0.0, "gaze_mirror_crop") for row in FOUND]
    assert [m.data for _, _, m in topics["/tracking/mode"]] == table["mode"].to_pylist()


def test_the_same_dive_gives_the_same_bytes(folder, rig, bag, tmp_path):
    again = write_bag(folder, rig, tmp_path / bag.name)
    files = sorted(path.name for path in bag.iterdir())
    assert files == ["dive.bag.mcap", "metadata.yaml"] == sorted(path.name for path in again.iterdir())
    assert all((bag / name).read_bytes() == (again / name).read_bytes() for name in files)
    # A bag that is there is replaced.
    (again / "metadata.yaml").write_text("an earlier one")
    write_bag(folder, rig, again)
    assert (again / "metadata.yaml").read_bytes() == (bag / "metadata.yaml").read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == [bag.name]


def test_frames_as_single_images_give_the_same_messages(own_folder, rig, images, topics, tmp_path):
    (own_folder / "video.mkv").unlink()
    (own_folder / "frames").mkdir()
    for number, image in enumerate(images):
        (own_folder / "frames" / f"{number:06d}.png").write_bytes(png(image))
    found = read(write_bag(own_folder, rig, tmp_path / "bag"))
    for (_, _, first), (_, _, second) in zip(topics["/camera/image_raw"], found["/camera/image_raw"], strict=True):
        assert bytes(first.data) == bytes(second.data)


def test_the_video_is_never_held_as_a_whole(folder, rig, tmp_path, monkeypatch):
    decode, alive, most = recording._decoded, weakref.WeakSet(), []

    class Watched(np.ndarray):
        __hash__ = object.__hash__

    def watched(path):
        for image in decode(path):
            seen = image.view(Watched)
            alive.add(seen)
            most.append(len(alive))
            yield seen
            del seen, image

    monkeypatch.setattr(recording, "_decoded", watched)
    write_bag(folder, rig, tmp_path / "bag")
    # The last one written, the one handed on, and the one being decoded.
    assert len(most) == FRAMES
    assert max(most) <= 3


def test_progress_is_told_image_by_image(folder, rig, tmp_path):
    told = []
    write_bag(folder, rig, tmp_path / "bag", progress=lambda done, total: told.append((done, total)))
    assert told == [(done, FRAMES) for done in range(1, FRAMES + 1)]


def remove(folder, *names):
    for name in names:
        (folder / name).unlink()


def cut(folder, share):
    video = folder / "video.mkv"
    video.write_bytes(video.read_bytes()[: int(video.stat().st_size * share)])


def one_row_more(folder):
    log = pq.read_table(folder / "log.parquet")
    last = log.slice(FRAMES - 1).set_column(1, SCHEMA.field("time_s"), [[9.0]])
    pq.write_table(pa.concat_tables([log, last]), folder / "log.parquet")


def one_row_less(folder):
    log = pq.read_table(folder / "log.parquet")
    pq.write_table(log.slice(0, FRAMES - 1), folder / "log.parquet")


def without_columns(folder):
    log = pq.read_table(folder / "log.parquet")
    pq.write_table(log.drop_columns(["target_distance_m", "mode"]), folder / "log.parquet")


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (lambda folder: remove(folder, "log.parquet"), r"finished dive.*log\.parquet"),
        (
            lambda folder: remove(folder, "log.parquet", "dive.toml", "video.mkv"),
            r"without dive\.toml, without log\.parquet, without video\.mkv",
        ),
        (lambda folder: cut(folder, 0.5), r"video\.mkv: expected .*(cut short|cannot be read)"),
        (lambda folder: cut(folder, 0.001), r"video\.mkv: expected a video"),
        (one_row_more, r"expected 6 images, one for each row of the log, got 5: it is cut short"),
        (one_row_less, r"expected 4 images, one for each row of the log, got more"),
        (without_columns, r"without column target_distance_m, column mode"),
    ],
)
def test_a_bad_folder_is_told_in_a_sentence_and_leaves_nothing(own_folder, rig, tmp_path, spoil, sentence):
    spoil(own_folder)
    with pytest.raises(ValueError, match=sentence):
        write_bag(own_folder, rig, tmp_path / "out" / "bag")
    assert not list((tmp_path / "out").glob("*")) and not list((tmp_path / "out").glob(".*"))


def test_another_cameras_images_are_noticed(own_folder, rig, images, tmp_path):
    write_video(own_folder / "video.mkv", [image[:240, :320] for image in images])
    with pytest.raises(ValueError, match=r"expected images of 640 x 480 px, the rig's camera's, got 320 x 240 px"):
        write_bag(own_folder, rig, tmp_path / "bag")


def test_something_else_is_not_overwritten(folder, rig, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("keep me")
    with pytest.raises(FileExistsError, match="earlier bag"):
        write_bag(folder, rig, tmp_path / "mine")
    assert (tmp_path / "mine" / "letter.txt").read_text() == "keep me"
