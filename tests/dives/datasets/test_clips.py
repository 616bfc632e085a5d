"""Clips: frames that follow each other, their optical flow, and their trajectories as evo reads them.

The rig has no mirrors and the water nothing in it, so that nothing is lit.
"""

import json

import cv2
import numpy as np
import pytest
import yaml

from dives.datasets import files
from dives.datasets.dataset import parse_dataset
from dives.datasets.drawing import clip_of
from dives.datasets.rendering import DEPTH_UNIT_M, FLOW_UNIT_PX, FLOW_ZERO
from dives.datasets.run import make_dataset
from dives.datasets.scenes import scene_of
from optics.train import OpticalTrain
from scenes.stage.frame import Label
from scenes.truth.motion import Seen

CLIPS = """
name = "clips"
samples = 6
seed = 5
formats = ["tum", "euroc", "mcap", "bop", "webdataset", "parquet"]
[scene]
rig = "bench"
world = "blue"
depth_m = 6.0
[robot]
x_m_per_s = 0.2
yaw_deg_per_s = "5..10"
[target]
diameter_m = 0.6
distance_m = "2..3"
azimuth_deg = "-5..5"
z_m_per_s = 0.4
[image]
width_px = 160
height_px = 120
sensor = false
[clip]
frames = 3
frame_rate_hz = 5.0
flow = true
"""


@pytest.fixture(scope="module")
def clips(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clips")
    dataset = parse_dataset(CLIPS, source="clips", folder=folder)
    make_dataset(dataset, folder / "set")
    return dataset, folder / "set"


def records(folder):
    return list(files.records(folder, range(6)))


def test_frames_of_a_clip_share_their_draw_and_move_evenly(clips):
    said = records(clips[1])
    assert [(each.clip, each.frame) for each in said] == [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)]
    assert said[0].drawn == said[2].drawn != said[3].drawn
    for first, second in ((said[0], said[1]), (said[1], said[2]), (said[4], said[5])):
        assert first.split == second.split
        assert second.time_s - first.time_s == pytest.approx(0.2)
        body, target = (
            np.array(getattr(second, name)) - np.array(getattr(first, name))
            for name in ("world_from_body", "world_from_target")
        )
        np.testing.assert_allclose(body[:3, 3], [0.04, 0, 0], atol=1e-12)
        np.testing.assert_allclose(target[:3, 3], [0, 0, 0.08], atol=1e-12)
        turn = np.array(first.world_from_body)[:3, :3].T @ np.array(second.world_from_body)[:3, :3]
        angle = np.degrees(np.arccos((np.trace(turn) - 1) / 2))
        assert angle == pytest.approx(0.2 * first.drawn["robot.yaw_deg_per_s"])


def test_flow_leads_to_where_the_points_of_the_target_are_a_frame_later(clips):
    dataset, folder = clips
    rig = next(iter(dataset.rigs.values()))
    train = OpticalTrain.from_rig(rig)
    scale = rig.camera.width_px / 160
    first, second = records(folder)[:2]
    flow = cv2.imread(str(folder / first.file("flow")), cv2.IMREAD_UNCHANGED)[..., ::-1].astype(float)
    depth = cv2.imread(str(folder / first.file("depth")), cv2.IMREAD_UNCHANGED) * DEPTH_UNIT_M
    semantic = cv2.imread(str(folder / first.file("semantic")), cv2.IMREAD_UNCHANGED)
    v, u = np.nonzero((semantic == Label.TARGET) & (flow[..., 2] == 1 + Seen.YES))
    assert len(u) > 100
    rays = train.trace((np.stack([u, v], axis=-1) + 0.5) * scale - 0.5)
    along = (depth[v, u] - rays.origin_m[:, 2]) / rays.direction[:, 2]
    points = rays.origin_m + along[:, np.newaxis] * rays.direction
    poses = [np.array(each.world_from_virtual_camera["direct"]) for each in (first, second)]
    there = points @ poses[0][:3, :3].T + poses[0][:3, 3] + [0, 0, 0.08]
    seen = train.project((there - poses[1][:3, 3]) @ poses[1][:3, :3]).pixels
    expected = (seen + 0.5) / scale - 0.5 - np.stack([u, v], axis=-1)
    found = (flow[v, u, :2] - FLOW_ZERO) * FLOW_UNIT_PX
    # Half a step of flow, and what half a step of depth makes of it.
    np.testing.assert_allclose(found, expected, atol=0.75 * FLOW_UNIT_PX)
    assert np.linalg.norm(expected, axis=1).min() > 1


def test_evo_reads_both_formats_and_they_agree(clips):
    file_interface = pytest.importorskip("evo.tools.file_interface")
    _, folder = clips
    said = records(folder)[3:]
    tum = file_interface.read_tum_trajectory_file(folder / "trajectories/clip-000001/robot.txt")
    euroc = file_interface.read_euroc_csv_trajectory(
        folder / "euroc/clip-000001/mav0/state_groundtruth_estimate0/data.csv"
    )
    for trajectory in (tum, euroc):
        np.testing.assert_allclose(trajectory.timestamps, [0, 0.2, 0.4], atol=1e-6)
        for pose, record in zip(trajectory.poses_se3, said, strict=True):
            np.testing.assert_allclose(pose, record.world_from_body, atol=1e-8)
    camera = file_interface.read_tum_trajectory_file(folder / "trajectories/clip-000001/camera.txt")
    np.testing.assert_allclose(camera.poses_se3[2], said[2].world_from_virtual_camera["direct"], atol=1e-8)


def test_images_of_euroc_are_those_of_the_set(clips):
    _, folder = clips
    place = folder / "euroc/clip-000001/mav0/cam0"
    lines = (place / "data.csv").read_text().splitlines()[1:]
    images = [(place / "data" / line.split(",")[1]).resolve() for line in lines]
    assert images == [folder.resolve() / f"images/00000/{index:08d}.png" for index in (3, 4, 5)]
    assert all(cv2.imread(str(place / "data" / line.split(",")[1])) is not None for line in lines)
    sensor = yaml.safe_load((place / "sensor.yaml").read_text())
    assert sensor["resolution"] == [160, 120]
    assert sensor["rate_hz"] == 5


def test_bop_takes_the_camera_itself_of_a_rig_without_mirrors(clips):
    dataset, folder = clips
    cameras = {}
    for file in folder.glob("bop/*/*/scene_camera.json"):
        cameras |= json.loads(file.read_text())
    said = records(folder)
    assert sorted(cameras, key=int) == [str(each.index) for each in said]
    for each in said:
        camera, world_from_camera = cameras[str(each.index)], np.array(each.world_from_virtual_camera["direct"])
        np.testing.assert_allclose(np.reshape(camera["cam_R_w2c"], (3, 3)), world_from_camera[:3, :3].T, atol=1e-12)
        assert camera["rig"] == next(iter(dataset.rigs.values())).name


def test_a_clip_whose_joints_would_leave_their_limits_is_drawn_again(tmp_path):
    text = CLIPS.replace('"bench"', '"aqua2"').replace("[robot]", "[joints]\nq1_deg_per_s = 200.0\n[robot]")
    made = parse_dataset(text, source="clips", folder=tmp_path)
    scene = scene_of(made, 0)
    joint = scene.rig.gaze.joints.pan
    # Three frames, and that which the last one's flow leads to.
    ends = [clip_of(scene, number).values["joints.q1_deg"] + 3 * 200 / 5 for number in range(8)]
    assert joint.min_deg + 120 <= min(ends) < max(ends) <= joint.max_deg
