"""Views: what is asked for is checked before anything is computed, and what is written is what was rendered."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from optics.layout import camera_pose
from optics.status import Region
from optics.train import OpticalTrain, pixel_grid
from rigs import Lamp, Rig
from scenes.baking.lit_scene import prepare
from scenes.light.sun import Sun
from scenes.light.waves import Wind
from scenes.reference.compare import BESIDE_SUN, compare, looks_within
from scenes.reference.limits import check_known_to_reference, without_lamps
from scenes.reference.render import render_reference
from scenes.renderer import FastRenderer
from scenes.requests.render import render
from scenes.requests.request import Output, RenderRequest
from scenes.stage.frame import Label
from scenes.stage.scene import make_scene, on_gaze
from scenes.stage.state import State
from tests.exr_files import bitmap_of, layers_of

# A request asks for full or draft light, as the command line does, and both take too long here.
pytestmark = pytest.mark.usefixtures("rough_light")

SIZE = {"width_px": 64, "height_px": 48}
POSE_DEG = {"q1_deg": 30.0, "q2_deg": -10.0}
Q = dict(zip(("q1", "q2"), np.radians([30.0, -10.0]), strict=True))
LIGHT = ("R", "G", "B", "target.Y")


@pytest.fixture(scope="module")
def aqua2():
    return Rig.load("aqua2")


@pytest.fixture(scope="module")
def bench():
    return Rig.load("bench")


@pytest.fixture(scope="module")
def open_water(aqua2):
    """Nothing but water and the ball: the quickest scene."""
    return make_scene(aqua2, world="blue", target_m=on_gaze(aqua2, **Q, distance_m=1.0), wind=Wind(speed_m_per_s=0.0))


@pytest.mark.parametrize("preset", ["aqua2", "bluerov2", "bench"])
@pytest.mark.parametrize("distance_m", [0.5, 4.0])
def test_a_target_hangs_on_the_gaze(preset, distance_m):
    """The exact train projects the point to the principal point, and to the distance asked for along that ray."""
    rig = Rig.load(preset)
    place = on_gaze(rig, **Q, distance_m=distance_m)
    train = OpticalTrain.from_rig(rig, **Q)
    point = camera_pose(rig.camera).inv().apply(place)
    middle = [rig.camera.cx_px, rig.camera.cy_px]
    # The projection's own tolerance is 1e-6 px.
    np.testing.assert_allclose(train.project(point[np.newaxis]).pixels[0], middle, atol=1e-5)
    assert np.linalg.norm(point - train.trace([middle]).origin_m[0]) == pytest.approx(distance_m, rel=1e-12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"q1": 0.0, "q2": 0.0, "distance_m": 0.0}, "expected a distance above 0 m, got 0 m"),
        ({"q1": 0.0, "q2": 0.0, "distance_m": float("inf")}, "expected a distance above 0 m, got inf m"),
        ({"q1": 2.0, "q2": 0.0, "distance_m": 1.0}, r"q1 \(pan\)"),
    ],
)
def test_no_target_hangs_nowhere(aqua2, arguments, message):
    with pytest.raises(ValueError, match=message):
        on_gaze(aqua2, **arguments)


def test_everything_wrong_with_a_stage_is_said_at_once(aqua2):
    with pytest.raises(ValueError, match=r"a depth .*; .*a world .*; .*a Jerlov type .*; .*cloud .*; .*a target \("):
        make_scene(aqua2, world="moon", depth_m=-1.0, jerlov_type="9Z", cloud=2.0, target="shark")
    with pytest.raises(ValueError, match=r"expected a target below the surface, got one 1\.00 m above it"):
        make_scene(aqua2, world="blue", depth_m=3.0, target_m=(1.0, 0.0, 4.0))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"time_s": float("nan")}, "expected a time in seconds, got nan"),
        ({"samples": 2000}, "expected 1 to 1024 samples per pixel, got 2000"),
        ({"renderer": "reference", "samples": 1}, "expected at least 2 samples per pixel"),
        ({"renderer": "reference", "samples": 4, "stowed": True}, "knows no stowed one"),
        ({"renderer": "reference", "samples": 4, "time_s": 2.0}, "nothing moves for the reference renderer, got 2 s"),
    ],
)
def test_impossible_shots_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        RenderRequest(**arguments)


def test_impossible_outputs_are_refused(tmp_path):
    with pytest.raises(ValueError, match=r"expected an image \(.png\) of what the sensor takes, got 'view.exr'"):
        Output(path=tmp_path / "view.exr", sensor=True)
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(IsADirectoryError, match="expected a file, found a folder"):
        Output(path=tmp_path / "folder.png")
    (tmp_path / "file").touch()
    with pytest.raises(NotADirectoryError, match="expected a folder, found a file"):
        Output(path=tmp_path / "view.png", truth=tmp_path / "file")


def test_geometry_is_that_of_the_pixel_s_centre_whatever_the_samples(aqua2, open_water, tmp_path):
    """Light and the target's share are averages of four samples; every other layer is that of one."""
    found = []
    for samples in (1, 4):
        path = tmp_path / f"{samples}.exr"
        render(aqua2, open_water, RenderRequest(**POSE_DEG, **SIZE, samples=samples), Output(path=path))
        found.append(layers_of(path))
    one, four = found
    assert one.keys() == four.keys()
    for name, values in one.items():
        assert np.array_equal(values, four[name], equal_nan=True) == (name not in LIGHT), name
    assert set(np.unique(four["target.Y"])) <= {0.0, 0.25, 0.5, 0.75, 1.0}
    # The same ball: half a pixel of its outline, some 30 pixels long, is what four samples may differ by.
    assert four["target.Y"].sum() == pytest.approx(one["target.Y"].sum(), abs=15)


@pytest.mark.parametrize("ending", [".png", ".exr"])
def test_a_draft_is_written_first_and_says_so_in_the_file(aqua2, open_water, tmp_path, monkeypatch, ending):
    """Where the full light is not in the cache; what is asked for as a draft then stays one."""
    monkeypatch.setattr("scenes.requests.render.prepare_from_cache", lambda *_: None)
    monkeypatch.setattr("scenes.requests.render.is_long_to_light", lambda _: True)
    path, request, told = tmp_path / f"view{ending}", RenderRequest(**POSE_DEG, **SIZE), []

    def said():
        return str(bitmap_of(path).metadata()["light"]).strip('"')

    output = Output(path=path)
    view = render(aqua2, open_water, request, output, on_draft=lambda draft: told.append((draft.light, said())))
    assert told == [("draft", "draft")]
    assert (view.light, said()) == ("full", "full")
    view = render(aqua2, open_water, replace(request, light="draft"), output, on_draft=pytest.fail)
    assert (view.light, said()) == ("draft", "draft")


def test_where_the_light_is_known_there_is_no_draft(aqua2, open_water, tmp_path):
    request, output = RenderRequest(**SIZE), Output(path=tmp_path / "view.png")
    render(aqua2, open_water, request, output)
    drafts = []
    assert render(aqua2, open_water, request, output, on_draft=drafts.append).light == "full"
    assert not drafts
    full = output.path.read_bytes()
    assert render(aqua2, open_water, replace(request, light="draft"), output).light == "full"
    assert output.path.read_bytes() == full


def test_truth_beside_a_image_is_the_layers_of_an_exr(aqua2, open_water, tmp_path):
    request = RenderRequest(**POSE_DEG, **SIZE)
    view = render(aqua2, open_water, request, Output(path=tmp_path / "view.png", truth=tmp_path / "truth"))
    render(aqua2, open_water, request, Output(path=tmp_path / "view.exr"))
    assert (tmp_path / "truth/layers.exr").read_bytes() == (tmp_path / "view.exr").read_bytes()
    assert view.truth_files == len([path for path in (tmp_path / "truth").rglob("*") if path.is_file()])
    seen = {
        note["region"]: note
        for note in json.loads((tmp_path / "truth/boxes.json").read_text())["annotations"]
        if note["name"] == "target"
    }
    left, top, right, bottom = seen["gaze"]["box_px"]
    assert left <= view.target_px[0] <= right
    assert top <= view.target_px[1] <= bottom


def test_the_reference_s_light_is_written_with_the_geometry_of_the_fast_one(aqua2, open_water, tmp_path):
    size = {"width_px": 12, "height_px": 9}
    request = RenderRequest(**POSE_DEG, **size, samples=2, seed=5)
    told = []
    render(
        aqua2,
        open_water,
        replace(request, renderer="reference"),
        Output(path=tmp_path / "true.exr"),
        progress=lambda *numbers: told.append(numbers),
    )
    render(aqua2, open_water, replace(request, samples=1), Output(path=tmp_path / "fast.exr"))
    true, fast = layers_of(tmp_path / "true.exr"), layers_of(tmp_path / "fast.exr")
    assert told[-1] == (3, 3)
    assert all(np.array_equal(true[name], fast[name], equal_nan=True) for name in true.keys() - set(LIGHT))
    from cad.assembly.meshes import rig_meshes

    again = render_reference(aqua2, rig_meshes(aqua2), open_water, **Q, **size, samples=2, seed=5)
    for name, channel in zip("RGB", np.moveaxis(again.radiance, -1, 0), strict=True):
        np.testing.assert_array_equal(true[name], channel.astype(np.float32))


def test_an_image_of_the_sensor_is_seeded_and_its_exposure_told(bench, tmp_path):
    scene = make_scene(bench, world="blue", wind=Wind(speed_m_per_s=0.0))
    images = []
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        output = Output(path=tmp_path / f"{name}.png", sensor=True)
        view = render(bench, scene, RenderRequest(**SIZE, seed=seed), output)
        images.append(output.path.read_bytes())
    assert images[0] == images[1] != images[2]
    sensor = bench.image_sensor
    assert sensor.exposure.shortest_us <= 1000 * view.exposure["time_ms"] <= sensor.longest_exposure_us
    assert 0 <= view.exposure["gain_db"] <= sensor.largest_gain_db


def test_the_reference_knows_neither_waves_nor_snow_nor_lamps(aqua2):
    with pytest.raises(ValueError, match=r"a flat sea \(wind of 0 m/s\), got 3 m/s; no marine snow, got some"):
        check_known_to_reference(make_scene(aqua2, world="blue", snow=True))
    lit = aqua2.model_copy(
        update={"lamps": (Lamp(position_mm=(300.0, 0.0, 0.0), angle_deg=90.0, luminous_flux_lm=1000.0),)}
    )
    dark, notes = without_lamps(lit)
    assert dark == aqua2
    assert notes == ("aqua2: lamps are off, the reference renderer knows none",)
    assert without_lamps(aqua2) == (aqua2, ())


def test_pixels_near_a_direction_are_those_whose_rays_go_there(aqua2):
    """Against the exact train: the rays of all mirrors for the gaze, of none for the direct view, in the world."""
    scene = make_scene(aqua2, world="blue", wind=Wind(speed_m_per_s=0.0))
    q = {"q1": 0.1, "q2": 0.45}
    frame = FastRenderer(prepare(scene, aqua2, []), **SIZE).render(**q)
    train = OpticalTrain.from_rig(aqua2, **q)
    pixels = pixel_grid(train.camera, SIZE["width_px"], SIZE["height_px"])
    to_world = scene.world_from_body.rotation * camera_pose(aqua2.camera).rotation
    state = State(**q, world_from_body=scene.world_from_body)
    for region, mirrors in ((Region.DIRECT, 0), (Region.FOLD, 1), (Region.GAZE, 2)):
        here = frame.region == region
        rays = to_world.apply(replace(train, mirrors=train.mirrors[:mirrors]).trace(pixels).direction)
        rays = rays.reshape(*here.shape, 3)
        direction = rays[here][len(rays[here]) // 2]
        near = looks_within(frame, aqua2, state, direction=direction, angle_deg=5.0)
        assert near[here].any()
        np.testing.assert_array_equal(near[here], rays[here] @ direction > np.cos(np.radians(5.0)))


def test_the_numbers_beside_the_sun_are_told(aqua2, tmp_path):
    """The gaze looks up at the refracted sun ahead: sin = cos(60 degrees) / n, 68 degrees high."""
    scene = make_scene(aqua2, world="blue", sun=Sun(azimuth_deg=0.0), wind=Wind(speed_m_per_s=0.0))
    towards_sun = scene.light.towards_sun
    q2_deg = np.degrees(np.arcsin(towards_sun[2])) / 2
    size = {"width_px": 32, "height_px": 24}
    options = {"path": tmp_path / "both.png", "samples": 2, **size}
    found = compare(aqua2, scene, q1_deg=0.0, q2_deg=q2_deg, **options)
    whole, beside = found.agreements[:2]
    assert (whole.name, beside.name) == ("whole image", BESIDE_SUN)
    assert 0 < beside.pixels < whole.pixels
    down = compare(aqua2, scene, q1_deg=0.0, q2_deg=-10.0, **options)
    assert BESIDE_SUN not in [each.name for each in down.agreements]
    assert Label.OPEN_WATER.name.lower().replace("_", " ") in [each.name for each in down.agreements]


def test_blur_softens_and_loses_no_light(bench, tmp_path):
    """A ball's edge in turbid water, in pixels finer than the peak of a degree.

    Light is exchanged by pairs: the sums agree in single precision, and the steepest step becomes smaller.
    """
    turbid = make_scene(bench, world="blue", jerlov_type="III", wind=Wind(speed_m_per_s=0.0))
    size = {"width_px": 640, "height_px": 480}
    for name, blur in (("sharp", False), ("soft", True)):
        render(bench, turbid, RenderRequest(**size, blur=blur), Output(path=tmp_path / f"{name}.exr"))
    sharp, soft = (layers_of(tmp_path / f"{name}.exr")["G"] for name in ("sharp", "soft"))
    assert soft.sum() == pytest.approx(sharp.sum(), rel=1e-3)
    assert np.abs(np.diff(soft, axis=1)).max() < np.abs(np.diff(sharp, axis=1)).max()
