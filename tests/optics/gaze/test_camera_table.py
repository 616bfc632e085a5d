"""The camera as a table: its reader, loaded as others load it, sees what the exact train sees, and so does MuJoCo."""

import importlib.util

import numpy as np
import pytest

from optics.gaze.camera_table import JOINT_NUMBERS, OUTLINE_NUMBERS, camera_table, write_camera_table
from optics.layout import Layout, camera_pose
from optics.status import Region, Status
from optics.train import OpticalTrain, pixel_grid, regions
from rigs import Rig
from tests.exr_files import bitmap_of, layers_of

SIZE = {"width_px": 96, "height_px": 72}

SINGLE_PRECISION_PX = 1e-3
"""Rays in single precision: 6e-8 of a direction of some 700 px, and of an origin's decimetre beside two metres."""


def exported(rig, folder):
    """Table and reader, both from the files that were written."""
    npz, reader = write_camera_table(rig, folder / "camera.npz", **SIZE)
    spec = importlib.util.spec_from_file_location("reader_of_others", reader)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module, module.load(npz)


@pytest.mark.parametrize(
    ("name", "outline"), [("aqua2", "rectangle"), ("aqua2", "octagon"), ("bluerov2", "ellipse"), ("torpedo", None)]
)
def test_the_reader_sees_what_the_train_sees(name, outline, tmp_path):
    rig = Rig.load(name)
    if outline is not None:
        rig = rig.with_(gaze_mirror__outline=outline)
    reader, table = exported(rig, tmp_path)
    joints = rig.gaze.joints
    body = camera_pose(rig.camera)
    for pan, tilt in ((0.5, 0.5), (0.1, 0.9), (0.85, 0.2)):
        q1, q2 = (
            low + share * (high - low)
            for share, (low, high) in zip((pan, tilt), (joints.pan.limits, joints.tilt.limits), strict=True)
        )
        train = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
        pixels = pixel_grid(train.camera, SIZE["width_px"], SIZE["height_px"])
        exact = train.trace(pixels)
        origin, direction, path, blocked = reader.rays(table, q1, q2)
        # A pixel on an edge may fall to either side in single precision.
        same = path.ravel() == regions(exact.status)
        assert same.mean() > 0.998
        assert (path == Region.GAZE).sum() > 50
        np.testing.assert_array_equal(blocked.ravel()[same], (exact.status == Status.BACK_OF_MIRROR)[same])
        seen = same & (exact.status == Status.OK)
        points = body.inv().apply((origin + 2.0 * direction).reshape(-1, 3)[seen])
        np.testing.assert_allclose(train.project(points).pixels, pixels[seen], rtol=0, atol=SINGLE_PRECISION_PX)
        others = same & np.isin(exact.status, (Status.MISSED_M1, Status.MISSED_M2))
        np.testing.assert_allclose(
            direction.reshape(-1, 3)[others], body.rotation.apply(exact.direction[others]), rtol=0, atol=1e-6
        )
        np.testing.assert_allclose(table["transmittance"].ravel(), train.transmittance(pixels), rtol=0, atol=1e-6)
        np.testing.assert_allclose(
            reader.gaze_mirror_pose(table, q1, q2), Layout.from_rig(rig).body_from_m2(q1, q2).as_matrix(), atol=1e-12
        )


def test_a_rig_without_mirrors_has_its_port_alone(tmp_path):
    rig = Rig.load("bench")
    reader, table = exported(rig, tmp_path)
    _, direction, path, blocked = reader.rays(table)
    train = OpticalTrain.from_rig(rig)
    exact = train.trace(pixel_grid(train.camera, SIZE["width_px"], SIZE["height_px"]))
    np.testing.assert_array_equal(path.ravel() == Region.DIRECT, exact.passed)
    body = camera_pose(rig.camera)
    np.testing.assert_allclose(direction.reshape(-1, 3), body.rotation.apply(exact.direction), rtol=0, atol=1e-6)
    assert not blocked.any()


def test_joints_beyond_their_limits_are_refused(tmp_path):
    reader, table = exported(Rig.load("aqua2"), tmp_path)
    with pytest.raises(ValueError, match="expected pan from"):
        reader.rays(table, 3.0, 0.0)


def test_the_reader_is_short_and_needs_numpy_alone(tmp_path):
    _, reader = write_camera_table(Rig.load("bench"), tmp_path / "camera.npz", **SIZE)
    lines = reader.read_text().splitlines()
    assert [line for line in lines if line.startswith(("import ", "from "))] == ["import numpy as np"]
    assert len(lines) <= 60


def test_another_file_than_npz_or_exr_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"ends in \.npz or \.exr"):
        write_camera_table(Rig.load("bench"), tmp_path / "camera.csv")


def test_an_exr_file_has_the_same_layers_and_the_mirrors_in_its_header(tmp_path):
    rig = Rig.load("aqua2").with_(gaze_mirror__outline="octagon")
    file, shader = write_camera_table(rig, tmp_path / "camera.exr", **SIZE)
    assert shader.name == "read_camera.glsl"
    table, layers = camera_table(rig, **SIZE), layers_of(file)
    for name, layer in (("origin_m", "origin"), ("direction", "direction")):
        found = np.stack([layers[f"{layer}.{axis}"] for axis in "XYZ"], axis=-1)
        np.testing.assert_array_equal(found, table[name])
    for name in ("status", "transmittance"):
        np.testing.assert_array_equal(layers[f"{name}.Y"], table[name])
    assert len(layers) == 8
    for name, values in header_of(file).items():
        np.testing.assert_allclose(values, table[name], rtol=1e-6, atol=1e-7)  # single precision
    bench, _ = write_camera_table(Rig.load("bench"), tmp_path / "bench.exr", **SIZE)
    assert "pan_sign" not in bitmap_of(bench).metadata()


def header_of(file):
    """Poses, outlines and joints of an EXR file, as the table has them."""
    header = bitmap_of(file).metadata()
    found = {name: np.array(header[name].matrix) for name in ("body_from_m1", "body_from_gimbal")}
    numbers = {
        "m1_outline": OUTLINE_NUMBERS,
        "m2_outline": OUTLINE_NUMBERS,
        "pan": JOINT_NUMBERS,
        "tilt": JOINT_NUMBERS,
    }
    return found | {name: [header[f"{name}_{each}"] for each in what] for name, what in numbers.items()}


def test_mujoco_finds_a_ball_in_the_pixels_in_which_the_train_shows_it(tmp_path):
    """Rays of the table, cast by MuJoCo, against the ball's points projected by the exact train."""
    mujoco = pytest.importorskip("mujoco")
    rig = Rig.load("aqua2")
    reader, table = exported(rig, tmp_path)
    q1, q2 = 0.3, -0.1
    origin, direction, path, _ = reader.rays(table, q1, q2)
    gaze = np.argwhere(path == Region.GAZE)
    row, column = gaze[len(gaze) // 2]
    centre, radius = origin[row, column] + 1.5 * direction[row, column], 0.15
    ball = f'<geom type="sphere" size="{radius}" pos="{" ".join(map(str, centre))}"/>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{ball}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    geom, found = np.zeros(1, dtype=np.int32), np.zeros(path.shape)
    for row, column in gaze:
        found[row, column] = mujoco.mj_ray(
            model, data, origin[row, column], direction[row, column], None, 1, -1, geom, None
        )
    seen = found > 0
    assert seen.sum() > 20
    points = (origin + found[..., np.newaxis] * direction)[seen]
    np.testing.assert_allclose(np.linalg.norm(points - centre, axis=1), radius, atol=1e-6)
    train = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
    pixels = pixel_grid(train.camera, SIZE["width_px"], SIZE["height_px"]).reshape(*path.shape, 2)[seen]
    image = train.project(camera_pose(rig.camera).inv().apply(points))
    np.testing.assert_allclose(image.pixels, pixels, rtol=0, atol=SINGLE_PRECISION_PX)
