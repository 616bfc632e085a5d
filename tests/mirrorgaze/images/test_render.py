"""`mirrorgaze render`: what it prints and writes, and that bad input writes nothing."""

from __future__ import annotations

import json
import re
import subprocess
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app
from optics.kernels.backend import mi
from scenes.stage.frame import Label
from tests.exr_files import layers_of

pytestmark = pytest.mark.usefixtures("rough_light")


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


def test_machines_are_told_regions_gaze_and_time(here):
    """The README's example: gaze 30 degrees to the left, 20 down (eq. 5 of the paper), all regions present."""
    result = mirrorgaze("render", "aqua2", "--q1-deg", "30", "--q2-deg", "-10", "-o", "view.png", "--json")
    assert result.exit_code == 0, result.stderr
    view = json.loads(result.stdout)
    assert view["gaze_deg"] == pytest.approx({"azimuth": 30.0, "elevation": -20.0, "roll": -30.0}, abs=1e-9)
    assert sum(view["region_px"].values()) == 640 * 480
    assert all(view["region_px"][region] > 10_000 for region in ("direct", "fold", "gaze"))
    assert view["time_s"] > 0
    image = np.array(mi.Bitmap(str(here / "view.png")))
    assert image.shape == (480, 640, 3)
    # The ball hangs on the gaze axis: it is where the JSON says, and redder than the wall around it, grey or yellow:
    # against green, since what a yellow tile lacks in blue says nothing about red.
    u, v = np.round(view["target_px"]).astype(int)
    ball, wall = image[v, u].astype(float), image[v - 60, u].astype(float)
    assert ball[0] / ball[1] > 1.3 * wall[0] / wall[1]


SMALL = ("--width-px", "64", "--height-px", "48")
POSE = ("--q1-deg", "30", "--q2-deg", "-10")

TOO_HEAVY = {"trimesh", "networkx", "build123d", "matplotlib", "tomlkit", "cv2", "scipy.ndimage", "scipy.interpolate"}
WARM = f"""import sys
from scenes.baking.light_quality import LightQuality
LightQuality.full = LightQuality.coarse
from mirrorgaze.cli import main
try:
    main()
finally:
    print(*sorted({TOO_HEAVY} & set(sys.modules)))
"""
"""A command as it is run, in the coarse light of `rough_light`; what it loaded of what it should not comes last."""


def test_with_everything_in_the_cache_little_is_loaded(here):
    """Each of these takes 0.1 to 5 s to import, a frame 0.03 s."""
    command = ("render", "aqua2", *SMALL)
    assert mirrorgaze(*command).exit_code == 0
    child = subprocess.run([sys.executable, "-c", WARM, *command], check=True, stdout=subprocess.PIPE, text=True)
    assert child.stdout.splitlines()[-1] == ""


MITSUBA_WORLD = """<scene version="3.0.0">
  <shape type="cube" id="box"><transform name="to_world"><translate x="3"/></transform></shape>
  <emitter type="constant" id="lamp"/>
</scene>
"""


def test_exr_holds_radiance_and_ground_truth(here):
    result = mirrorgaze("render", "bench", *SMALL, "--water", "III", "--samples", "4", "-o", "view.exr")
    assert result.exit_code == 0, result.stderr
    layers = layers_of(here / "view.exr")
    assert {"R", "G", "B", "Z", "distance.Z", "position.X", "normal.Y", "label.Y", "instance.Y"} <= layers.keys()
    assert 0.05 < layers["distance.Z"].min() < layers["distance.Z"].max() < 12  # the tank is 8 m wide


def test_truth_is_a_folder_beside_the_image(here):
    result = mirrorgaze("render", "aqua2", *SMALL, *POSE, "--ground-truth", "truth")
    assert result.exit_code == 0, result.stderr
    there = [path for path in (here / "truth").rglob("*") if path.is_file()]
    assert f"truth: {len(there)} files of ground truth" in result.stdout
    names = {annotation["name"] for annotation in json.loads((here / "truth/boxes.json").read_text())["annotations"]}
    # The ball hangs on this pose's gaze axis before the tank's yellow wall, east.
    assert {"target", "east wall"} <= names
    assert (here / "truth/layers.exr").exists()
    assert (here / "truth/masks/target.png").exists()
    assert sorted(path.name for path in here.iterdir()) == ["truth", "view.png"]


def test_water_changes_what_is_seen(here):
    """Type III takes more light than IB: the same wall in the direct view is another colour."""
    for water in ("IB", "III"):
        arguments = ("--water", water, "--width-px", "32", "--height-px", "24", "-o", f"{water}.exr")
        assert mirrorgaze("render", "bench", *arguments).exit_code == 0
    clear, turbid = (layers_of(here / f"{water}.exr")["G"] for water in ("IB", "III"))
    assert not np.allclose(clear, turbid, rtol=0.1)


def test_waves_go_on_with_time_and_stand_with_it(here):
    """Up through both mirrors, 60 degrees high: waves show, and move; the same time gives the same bytes."""
    pose = ("--world", "blue", "--q2-deg", "30", "--wind-m-per-s", "8")
    images = []
    for name, time in (("a", "0"), ("b", "0"), ("c", "0.7")):
        result = mirrorgaze("render", "aqua2", *SMALL, *pose, "--time-s", time, "-o", f"{name}.png")
        assert result.exit_code == 0, result.stderr
        images.append((here / f"{name}.png").read_bytes())
    assert images[0] == images[1] != images[2]


def test_scenery_reaches_the_image(here):
    """Target, sun and cloud: what the layers and the facts say of each."""
    scenery = ("--world", "blue", "--target", "diver", "--depth-m", "2")
    light = ("--sun-elevation-deg", "30", "--sun-azimuth-deg", "200", "--cloud", "1")
    result = mirrorgaze("render", "bench", *SMALL, *scenery, *light, "-o", "view.exr", "--json")
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["sun_deg"] == {"elevation": 30.0, "azimuth": 200.0}
    overcast = layers_of(here / "view.exr")
    # The diver, 2.1 m long, fills a corner of the view, where the ball of 0.2 m fills 0.4 % of it.
    assert (overcast["label.Y"] == Label.TARGET).mean() > 0.03
    assert mirrorgaze("render", "bench", *SMALL, *scenery, *light[:-1], "0", "-o", "clear.exr").exit_code == 0
    # Kasten & Czeplak 1980: a quarter of the light is left under a closed cover; half is never reached.
    assert overcast["G"].mean() < 0.5 * layers_of(here / "clear.exr")["G"].mean()


def test_snow_is_in_the_image(here):
    """Flakes are thinner than a pixel: some of 300 000 samples meet one, few do (100 in a cubic metre)."""
    layers = []
    for option in ("--snow", "--json"):
        frame = ("--world", "blue", "--width-px", "320", "--height-px", "240", "--samples", "4", "--seed", "3")
        assert mirrorgaze("render", "bench", *frame, option, "-o", f"{option}.exr").exit_code == 0
        layers.append(layers_of(here / f"{option}.exr"))
    # Snow has a kernel of its own, whose last bit may differ on a graphics card; a flake changes a sample by more.
    snowed = np.abs(layers[0]["G"] / layers[1]["G"] - 1) > 1e-5
    assert 0 < snowed.sum() < 0.01 * snowed.size


def test_the_sun_stands_where_date_and_place_say(here):
    """Equinox, 12:07 UTC at Greenwich and on the equator: overhead, but for the 23 arc minutes of a day's declination.

    The equation of time on 20 March is -7.5 minutes (Meeus, Astronomical Algorithms, chapter 28).
    """
    pytest.importorskip("pvlib")
    when = ("--date", "2026-03-20T12:07:30+00:00", "--latitude-deg", "0", "--longitude-deg", "0")
    result = mirrorgaze("render", "bench", "--width-px", "8", "--height-px", "6", "--world", "blue", *when, "--json")
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["sun_deg"]["elevation"] == pytest.approx(90, abs=0.5)


def test_without_pvlib_a_sentence_says_what_to_install(here, monkeypatch):
    # Python has it that a module which is None cannot be imported; another test may have imported parts of it.
    for module in ("pvlib", *(name for name in sys.modules if name.startswith("pvlib."))):
        monkeypatch.setitem(sys.modules, module, None)
    when = ("--date", "2026-03-20T12:00:00+00:00", "--latitude-deg", "20", "--longitude-deg", "0")
    result = mirrorgaze("render", "bench", *when)
    assert result.exit_code == 2
    assert "pip install 'mirrorgaze[sun]', or give its elevation and azimuth" in result.stderr
    assert not list(here.iterdir())


def test_the_sensor_s_image_is_seeded_and_its_exposure_printed(here):
    images = []
    for name, seed in (("a", "1"), ("b", "1"), ("c", "2")):
        arguments = ("--world", "blue", "--wind-m-per-s", "0", "--sensor", "--seed", seed, "-o", f"{name}.png")
        result = mirrorgaze("render", "aqua2", *SMALL, *arguments)
        assert result.exit_code == 0, result.stderr
        images.append((here / f"{name}.png").read_bytes())
    assert images[0] == images[1] != images[2]
    assert re.search(r"exposure time +\d+\.\d{3} ms\n  gain +\d+\.\d dB", result.stdout)


def test_the_reference_renders_too(here):
    arguments = ("--width-px", "12", "--height-px", "9", "--renderer", "reference", "--samples", "4", "-o", "view.png")
    result = mirrorgaze("render", "bench", *arguments)
    assert result.exit_code == 0, result.stderr
    assert "reference: 3 of 3" in result.stderr
    assert "(reference, 4 samples)" in result.stdout
    assert np.array(mi.Bitmap(str(here / "view.png"))).shape == (9, 12, 3)


def test_what_of_a_world_file_is_not_used_is_said(here):
    (here / "box.xml").write_text(MITSUBA_WORLD, encoding="utf-8")
    result = mirrorgaze(
        "render", "bench", "--width-px", "16", "--height-px", "12", "--world", "box.xml", "-o", "view.exr"
    )
    assert result.exit_code == 0, result.stderr
    assert "box.xml: not used: emitter lamp" in result.stderr
    layers = layers_of(here / "view.exr")
    # The cube of side 2 m, 3 m ahead: its face is 2 m before the robot's origin, where the camera stands.
    assert np.nanmin(layers["position.X"]) == pytest.approx(2, abs=1e-5)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--q1-deg", "300"), "expected q1 (pan) between -77.5 and 77.5 deg, got 300"),
        (("--q2-deg", "nan"), "expected q2 (tilt) between -32.5 and 122.5 deg, got nan"),
        (("--world", "moon"), "expected a world (blue, reef, tank) or a file that ends in .obj, .ply, .stl, .glb"),
        (("--world", "moon.ply"), "moon.ply: expected a file, found nothing"),
        (("--target", "shark"), "expected a target (ball, buoy, diver, fish) or a file"),
        (("--depth-m", "-3"), "expected a depth from 0.5 to 100 m, got -3 m"),
        (("--water", "9Z"), "expected a Jerlov type (I, IA, IB, II, III, 1C, 3C, 5C, 7C, 9C), got '9Z'"),
        (("--cloud", "2"), "expected cloud from 0 (clear) to 1 (overcast), got 2.0"),
        (("--wind-m-per-s", "30"), "expected speed_m_per_s from 0 to 15, got 30.0"),
        (("--time-s", "nan"), "expected a time in seconds, got nan"),
        (("--sun-elevation-deg", "0"), "expected elevation_deg above 0 and at most 90, got 0.0"),
        (
            ("--date", "noon", "--latitude-deg", "0", "--longitude-deg", "0"),
            "--date noon: expected a time as 2026-03-20T12",
        ),
        (
            ("--date", "2026-03-20T12:00", "--latitude-deg", "0", "--longitude-deg", "0"),
            "expected a time with its zone",
        ),
        (("--latitude-deg", "0"), "missing: --date, --longitude-deg"),
        (
            ("--sun-azimuth-deg", "9", "--date", "2026-03-20"),
            "the sun's angles or a date and a place, got both; expected all",
        ),
        (("-o", "view.bmp"), "expected an image file that ends in .png or .exr, got 'view.bmp'"),
        (("-o", "nowhere/view.png"), "there is no nowhere"),
        (("-o", "view.exr", "--sensor"), "expected an image (.png) of what the sensor takes, got 'view.exr'"),
        (("--width-px", "0"), "--width-px"),
        (("--renderer", "slow"), "--renderer"),
        (("--renderer", "reference", "--samples", "1"), "expected at least 2 samples per pixel"),
        (
            ("--renderer", "reference", "--wind-m-per-s", "3", "--snow"),
            "(wind of 0 m/s), got 3 m/s; no marine snow, got some",
        ),
        (("--renderer", "reference", "--stowed"), "the reference renderer knows no stowed one"),
    ],
)
def test_bad_input_is_a_sentence_and_writes_nothing(here, arguments, sentence):
    result = mirrorgaze("render", "aqua2", *arguments)
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert not list(here.iterdir())


def test_everything_wrong_with_the_scenery_is_said_at_once(here):
    result = mirrorgaze(
        "render", "aqua2", "--wind-m-per-s", "30", "--sun-elevation-deg", "95", "--world", "moon", "--depth-m", "0"
    )
    assert result.exit_code == 2
    for part in ("got 30.0", "got 95.0", "got 0 m", "got 'moon'"):
        assert part in result.stderr
