"""Making a data set: the same bytes however it is cut, killed and gone on with; a full disk; another set's folder."""

import errno
import json
import shutil
from dataclasses import replace

import cv2
import numpy as np
import pyarrow.parquet as pq
import pytest

from dives.datasets import files, pieces
from dives.datasets.check import check_dataset
from dives.datasets.dataset import parse_dataset
from dives.datasets.drawing import sample_of
from dives.datasets.pieces import make_piece_of_text
from dives.datasets.rendering import DEPTH_UNIT_M, FURTHER
from dives.datasets.run import make_dataset
from dives.datasets.scenes import scene_of
from optics.status import Region
from optics.train import OpticalTrain
from optics.workers.shards import Shard
from scenes.baking.light_quality import LightQuality
from scenes.stage.frame import Label
from tests.dives.datasets.conftest import SMALL_SET, files_of

COARSE = LightQuality.coarse()


def layer(folder, kind, index):
    return cv2.imread(str(folder / next(files.records(folder, [index])).file(kind)), cv2.IMREAD_UNCHANGED)


def record(folder, index):
    return json.loads((folder / files.file_name("samples", index)).read_text())


def test_a_set_made_in_parts_is_the_same_to_the_byte(small_set, small_folder, made, tmp_path):
    # Last shard first, another process's way of making a piece, and a sample that was lost.
    parts = tmp_path / "parts"
    half = make_dataset(small_set, parts, shard=Shard(2, 2))
    assert (half.done, half.samples, half.files) == (3, 6, ())
    (parts / files.file_name("samples", pieces.pieces(small_set)[1].indices[0])).unlink()
    piece = pieces.pieces(small_set)[0]
    make_piece_of_text(SMALL_SET, str(small_folder), str(parts), piece.scene, piece.indices[:2], quality=COARSE)
    whole = make_dataset(small_set, parts)
    assert whole.is_whole and whole.failed == whole.broken == {}
    said = json.loads((parts / "shard-2-of-2.json").read_text())
    assert set(said["pieces"].values()) == {"done"}
    (parts / "shard-2-of-2.json").unlink()
    assert files_of(parts) == files_of(made)


def test_more_samples_leave_those_that_are_there(small_folder, made, tmp_path):
    more = tmp_path / "more"
    shutil.copytree(made, more)
    seven = parse_dataset(
        SMALL_SET.replace("samples = 6", "samples = 7"), source="small", folder=small_folder, quality=COARSE
    )
    made_now = []
    make_dataset(seven, more, progress=lambda done, of: made_now.append((done, of)))
    assert made_now == [(6, 7), (7, 7)]
    before, after = files_of(made), files_of(more)
    told = {name for name in before if "train" in name and not name.startswith("bop/")}
    scene = int(seven.grid.scene_of(6))
    told |= {f"bop/train/{scene:06d}/scene_{name}.json" for name in ("camera", "gt", "gt_info")}
    changed = {name for name in before if before[name] != after[name]}
    assert changed == {"dataset.toml", "manifest.json", "samples.parquet", "README.md", "contact_sheet.png", *told}


def test_what_was_killed_in_a_sample_makes_that_sample_again(small_set, made, tmp_path, monkeypatch):
    folder, written = tmp_path / "killed", []
    shutil.copytree(made, folder, ignore=shutil.ignore_patterns("*.json", "*.parquet"))
    shutil.copy(made / files.IDENTITY, folder)
    write = files.write_bytes

    def killed(path, content):
        if len(written) == 3:
            raise KeyboardInterrupt
        written.append(path)
        write(path, content)

    monkeypatch.setattr(files, "write_bytes", killed)
    with pytest.raises(KeyboardInterrupt):
        make_dataset(small_set, folder)
    monkeypatch.undo()
    assert not list((folder / "samples").rglob("*.json"))
    assert make_dataset(small_set, folder).is_whole
    assert files_of(folder) == files_of(made)


def test_a_full_disk_leaves_whole_samples_alone(small_set, tmp_path, monkeypatch):
    folder, write = tmp_path / "full", files.write_bytes

    def full(path, content):
        if path.parts[-3] == "semantic":
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        write(path, content)

    monkeypatch.setattr(files, "write_bytes", full)
    with pytest.raises(OSError, match="No space left"):
        make_dataset(small_set, folder)
    assert not (folder / "samples").exists()
    assert not list(folder.rglob("*.partial*"))


def test_another_set_and_other_files_are_left_alone(small_set, small_folder, made, tmp_path):
    other = parse_dataset(
        SMALL_SET.replace("seed = 7", "seed = 8"), source="small", folder=small_folder, quality=COARSE
    )
    before = files_of(made)
    with pytest.raises(ValueError, match="another one is in it"):
        make_dataset(other, made)
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(ValueError, match="other files"):
        make_dataset(small_set, tmp_path)
    assert files_of(made) == before
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def test_a_sample_without_room_is_set_aside_and_named(small_folder, tmp_path):
    text = SMALL_SET.replace("samples = 6", "samples = 1").replace(
        'azimuth_deg = "-5..5"', 'elevation_deg = 90\nseen_from = "bow"'
    )
    above = parse_dataset(
        text.replace("low = 0.8, high = 2.0", "low = 5.0, high = 6.0"), source="s", folder=small_folder
    )
    found = make_dataset(above, tmp_path / "set")
    assert "sample 0: expected room within 200 draws" in found.failed[0]
    assert json.loads((tmp_path / "set/manifest.json").read_text())["failed"] == {"0": found.failed[0]}
    assert pq.read_table(tmp_path / "set/samples.parquet").num_rows == 0


def test_a_sample_is_known_by_its_number_alone(small_set):
    scene = scene_of(small_set, int(small_set.grid.scene_of(4)))
    again = scene_of(replace(small_set), int(small_set.grid.scene_of(4)))
    sample_of(scene, 2)
    first, second = sample_of(scene, 4), sample_of(again, 4)
    assert (first.values, first.split, first.present) == (second.values, second.split, second.present)
    assert first.values != sample_of(scene, 2).values


def test_depth_and_paths_lead_back_to_the_target(small_set, made):
    """The ball's pixels, carried back by the exact train of the record's joints and by depth, lie on the ball."""
    rig = next(iter(small_set.rigs.values()))
    checked = 0
    for index in range(6):
        said = record(made, index)
        paths, depth = layer(made, "paths", index), layer(made, "depth", index) * DEPTH_UNIT_M
        shown = (layer(made, "semantic", index) == Label.TARGET) & (paths == Region.GAZE)
        v, u = np.nonzero(shown)
        if not len(v):
            continue
        q1, q2 = (np.radians(said["joints_deg"][name]) for name in ("q1", "q2"))
        train = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
        rays = train.trace(np.stack([u, v], axis=-1).astype(float))
        world_from_camera = np.array(said["world_from_virtual_camera"]["direct"])
        world_from_gaze = np.array(said["world_from_virtual_camera"]["gaze"])
        origin = rays.origin_m @ world_from_camera[:3, :3].T + world_from_camera[:3, 3]
        direction = rays.direction @ world_from_camera[:3, :3].T
        # z-depth counts along the virtual camera's axis, from its pinhole.
        axis, pinhole = world_from_gaze[:3, 2], world_from_gaze[:3, 3]
        along = (depth[shown] - (origin - pinhole) @ axis) / (direction @ axis)
        points = origin + along[:, np.newaxis] * direction
        centre = np.array(said["world_from_target"])[:3, 3]
        off = np.linalg.norm(points - centre, axis=1) - said["target_radius_m"]
        # Half a step of depth, a little more at the limb.
        assert np.percentile(np.abs(off), 90) < DEPTH_UNIT_M
        checked += len(v)
    assert checked > 200


def test_records_agree_with_the_layers(made):
    for index in range(6):
        said, paths = record(made, index), layer(made, "paths", index)
        for region in Region:
            assert said["path_px"][region.name.lower()] == np.sum(paths % FURTHER == region)
        semantic, instances = layer(made, "semantic", index), layer(made, "instances", index)
        for each in said["annotations"]:
            shown = (
                (semantic == each["category_id"])
                & (instances == each["instance"] + 1)
                & (paths == Region[each["region"].upper()] + FURTHER * each["further_reflection"])
            )
            left, top, width, height = each["bbox"]
            rows, columns = np.nonzero(shown)
            assert each["area"] == shown.sum()
            assert (columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1) == (left, top, width, height)
            if each["instance"] >= 0:
                assert said["instances"][str(each["instance"] + 1)] == each["name"]


def test_normals_are_unit_vectors_towards_the_camera_that_sees_them(small_set, made):
    codes = layer(made, "normals", 0)[..., ::-1].astype(float)
    seen = codes.any(axis=-1)
    normals = codes[seen] / 65535 * 2 - 1
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1, atol=1e-4)
    rig = next(iter(small_set.rigs.values()))
    # Behind the port, pixels look the same way in the virtual camera's frame whatever its mirrors.
    rays = OpticalTrain.from_rig(rig.without_mirrors()).trace(np.argwhere(seen)[:, ::-1].astype(float))
    assert (np.sum(rays.direction * normals, axis=-1) < 0).mean() > 0.999


def test_the_table_has_a_row_for_each_sample(small_set, made):
    rows = pq.read_table(made / "samples.parquet").to_pylist()
    assert [row["index"] for row in rows] == list(range(6))
    for row in rows:
        said = record(made, row["index"])
        assert row["joints.q1_deg"] == pytest.approx(said["joints_deg"]["q1"])
        assert row["target.colour"] == said["scene"]["target.colour"]
        assert (made / row["image"]).is_file()
        assert (row["target.u_px"] is None) == (said["target_px"] is None)
    assert {row["target.colour"] for row in rows} == {"red", "orange"}


@pytest.mark.filterwarnings("ignore")  # of the formats' own libraries
def test_images_may_be_jpeg_and_layers_are_not(small_folder, made, tmp_path):
    """At quality 95 the root mean square error of water with noise is about a grey level; layers stay to the bit."""
    text = SMALL_SET + "\n[image]\njpeg_quality = 95\n"
    folder = tmp_path / "jpeg"
    done = make_dataset(parse_dataset(text, source="small", folder=small_folder, quality=COARSE), folder)
    assert done.is_whole
    assert check_dataset(folder).problems == ()
    assert not list(folder.glob("images/*/*.png"))
    for index in range(6):
        jpeg = cv2.imread(str(folder / f"images/00000/{index:08d}.jpg"))
        png = layer(made, "images", index)
        assert np.sqrt(np.mean((jpeg.astype(float) - png) ** 2)) < 3
        for kind in ("depth", "normals", "semantic", "instances", "paths"):
            assert (folder / kind / f"00000/{index:08d}.png").read_bytes() == (
                made / kind / f"00000/{index:08d}.png"
            ).read_bytes()
    listed = json.loads((folder / "annotations/instances_train.json").read_text())["images"]
    assert all((folder / image["file_name"]).is_file() and image["file_name"].endswith(".jpg") for image in listed)
