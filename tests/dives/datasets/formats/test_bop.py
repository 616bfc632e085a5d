"""BOP's files, read as its toolkit reads them: masks, poses and depths agree with each other and with the layers."""

import json

import cv2
import numpy as np
import pytest
import trimesh

from dives.datasets.dataset import DatasetError, parse_dataset
from dives.datasets.files import records
from dives.datasets.formats.bop import fitted_pinhole
from dives.datasets.formats.bop_models import bop_objects, write_models
from optics.status import Region
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig
from scenes.truth.silhouette import meets_ball
from tests.dives.datasets.conftest import SMALL_SET

DEPTH_STEP_MM = 1.0


def read(path):
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)


def images(made):
    """Scene, sample's number, camera, poses, and what is said of them."""
    for scene in sorted(made.glob("bop/*/0*")):
        said = [json.loads((scene / f"scene_{name}.json").read_text()) for name in ("camera", "gt", "gt_info")]
        for name, camera in said[0].items():
            yield scene, int(name), camera, said[1][name], said[2][name]


def record(made, index):
    return next(records(made, [index]))


def pose(entry, what):
    return np.reshape(entry[f"cam_R_{what}"], (3, 3)), np.array(entry[f"cam_t_{what}"])


def test_every_sample_is_in_the_scene_of_its_split(made):
    found = {(scene.parent.name, int(scene.name), index) for scene, index, *_ in images(made)}
    said = [record(made, index) for index in range(6)]
    assert found == {(each.split, each.scene["number"], each.index) for each in said}
    for scene, index, *_ in images(made):
        shown = scene / "rgb" / f"{index:06d}.png"
        assert shown.read_bytes() == (made / said[index].file("images")).read_bytes()


def test_visible_masks_are_those_of_the_layers_over_both_mirrors(made):
    """Counts and boxes by the toolkit's definition, recomputed here."""
    told = 0
    for scene, index, _, poses, infos in images(made):
        said = record(made, index)
        instances, paths, depth = (read(made / said.file(kind)) for kind in ("instances", "paths", "depth"))
        seen = paths == Region.GAZE
        np.testing.assert_array_equal(read(scene / "depth" / f"{index:06d}.png"), np.where(seen, depth, 0))
        mirrored = {each["instance"]: each for each in said.annotations if each["region"] == "gaze"}
        things = {number for number in mirrored if mirrored[number]["label"] in ("target", "decoy")}
        shown = [info for info in infos if info["px_count_visib"]]
        assert len(shown) == len(things)
        for number, info in enumerate(infos):
            whole, visible = (read(scene / kind / f"{index:06d}_{number:06d}.png") for kind in ("mask", "mask_visib"))
            assert not (visible & ~whole).any()
            assert (info["px_count_all"], info["px_count_visib"]) == ((whole > 0).sum(), (visible > 0).sum())
            assert info["visib_fract"] == info["px_count_visib"] / info["px_count_all"]
            if not info["px_count_visib"]:
                assert info["bbox_visib"] == [-1, -1, -1, -1]
                continue
            (instance,) = set(instances[visible > 0]) - {0}
            np.testing.assert_array_equal(visible > 0, seen & (instances == instance))
            left, top, width, height = mirrored[int(instance) - 1]["bbox"]
            assert info["bbox_visib"] == [left, top, width - 1, height - 1]
            v, u = np.nonzero(whole)
            assert info["bbox_obj"] == [u.min(), v.min(), np.ptp(u), np.ptp(v)]
            assert info["px_count_valid"] == np.count_nonzero(seen & (depth > 0) & (whole > 0))
            told += 1
            # The exact train says of the target how much is hidden, and how much the mirrors cut off.
            share = mirrored[int(instance) - 1]
            if share["visible_fraction"] is not None:
                all_px = share["area"] / share["visible_fraction"] / share["inside_fraction"]
                assert info["px_count_all"] == pytest.approx(all_px, abs=1e-6)
        assert len(poses) == len(infos)
    assert told >= 6


def test_depth_pose_and_matrix_lead_to_the_models_surface(made):
    """Pixels of the visible mask, carried back by matrix and depth as for any pinhole, lie on the model's sphere."""
    models = json.loads((made / "bop/models/models_info.json").read_text())
    for scene, index, camera, poses, infos in images(made):
        matrix = np.reshape(camera["cam_K"], (3, 3))
        depth = read(scene / "depth" / f"{index:06d}.png") * camera["depth_scale"]
        for number, entry in enumerate(poses):
            if not infos[number]["px_count_visib"]:
                continue
            turn, shift = pose(entry, "m2c")
            assert np.linalg.det(turn) == pytest.approx(1)
            v, u = np.nonzero(read(scene / "mask_visib" / f"{index:06d}_{number:06d}.png"))
            seen = np.stack([u, v, np.ones_like(u)]) * depth[v, u]
            points = turn.T @ (np.linalg.inv(matrix) @ seen - shift[:, np.newaxis])
            off = np.abs(np.linalg.norm(points, axis=0) - models[str(entry["obj_id"])]["diameter"] / 2)
            # What the entry says of the matrix, in millimetres there; on the face it hardly changes the distance.
            allowed = DEPTH_STEP_MM + camera["largest_px"] * shift[2] / matrix[0, 0]
            assert np.percentile(off, 90) < allowed


def test_the_camera_is_where_the_record_has_the_virtual_one(made):
    for _, index, camera, poses, _ in images(made):
        said = record(made, index)
        turn, shift = pose(camera, "w2c")
        world_from_camera = np.array(said.world_from_virtual_camera["gaze"])
        np.testing.assert_allclose(turn, world_from_camera[:3, :3].T, atol=1e-12)
        np.testing.assert_allclose(turn @ world_from_camera[:3, 3] + shift / 1000, 0, atol=1e-12)
        target = turn @ np.array(said.world_from_target)[:3, 3] + shift / 1000
        np.testing.assert_allclose(pose(poses[0], "m2c")[1], 1000 * target, atol=1e-9)


def test_the_set_has_the_camera_of_its_first_image(made):
    """Keys as `inout.load_cam_params` of the BOP toolkit reads them."""
    told = json.loads((made / "bop/camera.json").read_text())
    first = next(camera for _, index, camera, *_ in images(made) if index == 0)
    assert [told["fx"], 0, told["cx"], 0, told["fy"], told["cy"], 0, 0, 1] == first["cam_K"]
    assert (told["width"], told["height"], told["depth_scale"]) == (160, 120, first["depth_scale"])


def test_a_dome_about_the_pinhole_is_a_pinhole_and_a_flat_port_nearly():
    """Behind a concentric dome the matrix is that in air; behind a flat port it is longer by the water's index."""
    for name, share, most_px in (("bluerov2", 1.0, 1e-6), ("aqua2", 1.34, 4.0)):
        rig = Rig.load(name)
        train = OpticalTrain.bare(rig)
        rays = train.trace(pixel_grid(train.camera, 64, 48))
        u, v = np.meshgrid(np.arange(64), np.arange(48))
        found = fitted_pinhole(rays, (abs(u - 31.5) < 15) & (abs(v - 23.5) < 15))
        assert found.matrix[0, 0] / (rig.camera.fx_px * 64 / rig.camera.width_px) == pytest.approx(share, abs=0.02)
        assert found.rms_px <= found.largest_px < most_px


def test_models_are_in_millimetres_and_meshes_have_silhouettes(small_folder, tmp_path):
    text = SMALL_SET.replace('colour = ["red", "orange"]', 'shape = ["buoy", "fish"]')
    dataset = parse_dataset(text.replace(diameter_line(), ""), source="small", folder=small_folder)
    objects = list(bop_objects(dataset).values())
    assert [each.name for each in objects] == ["buoy", "fish", "yellow ball, 0.2 m"]
    names = write_models(tmp_path, objects)
    infos = json.loads((tmp_path / names[-1]).read_text())
    for each, name in zip(objects, names, strict=False):
        mesh = trimesh.load(tmp_path / name)
        info = infos[str(each.number)]
        np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [info[f"size_{axis}"] for axis in "xyz"], atol=1e-3)
    assert infos["1"]["size_z"] == pytest.approx(300, rel=0.05)  # the buoy is 0.3 m high
    assert infos["3"]["diameter"] == pytest.approx(200, rel=1e-3)
    check_mesh_silhouette(objects[2])


def check_mesh_silhouette(ball):
    """A ball as triangles shows what the ball shows, but for pixels on its edge."""
    from dataclasses import replace

    from scipy.spatial.transform import RigidTransform

    from scenes.stage.targets import meshed

    train = OpticalTrain.bare(Rig.load("aqua2"))
    rays = train.trace(pixel_grid(train.camera, 160, 120))
    pose = RigidTransform.from_translation([0.1, 0.05, 0.9])
    exact = meets_ball(rays, pose.translation, 0.1)
    np.testing.assert_array_equal(ball.met_by(rays, pose), exact)
    triangles = replace(ball, shape=meshed(ball.shape)).met_by(rays, pose)
    assert exact.sum() > 500
    assert np.count_nonzero(triangles != exact) < 0.02 * exact.sum()


def diameter_line():
    return next(line for line in SMALL_SET.splitlines() if line.startswith("diameter_m = {"))


def test_an_object_has_one_size(small_folder):
    text = SMALL_SET.replace(diameter_line(), 'diameter_m = "0.2..0.4"')
    with pytest.raises(DatasetError, match="an object of the format bop has one size"):
        parse_dataset(text, source="small", folder=small_folder)
