"""`mirrorgaze render`, `export` and `design`: what they print and write, and that bad input writes nothing."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app
from optics.backend import mi
from rigs import load_document, preset_path, save_document
from scenes.image import LAYERS


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


@pytest.fixture
def impossible_rig(here):
    document = load_document(preset_path("aqua2"))
    document["fold_mirror"]["distance_mm"] = 10.0
    save_document(document, here / "impossible.toml")
    return "impossible.toml"


def test_machines_are_told_regions_gaze_and_time(here):
    """The README's example: gaze 30 degrees to the left, 20 down (eq. 5 of the paper), all regions present."""
    result = mirrorgaze("render", "aqua2", "--q1", "30", "--q2", "-10", "-o", "view.png", "--json")
    assert result.exit_code == 0, result.stderr
    view = json.loads(result.stdout)
    assert view["gaze_deg"] == pytest.approx({"azimuth": 30.0, "elevation": -20.0, "roll": -30.0}, abs=1e-9)
    assert sum(view["region_px"].values()) == 640 * 480
    assert all(view["region_px"][region] > 10_000 for region in ("direct", "fold", "gaze"))
    assert view["time_s"] > 0
    picture = np.array(mi.Bitmap(str(here / "view.png")))
    assert picture.shape == (480, 640, 3)
    # The ball hangs on the gaze axis: it is where the JSON says, and redder than the wall around it.
    u, v = np.round(view["target_px"]).astype(int)
    ball, wall = picture[v, u].astype(float), picture[v - 60, u].astype(float)
    assert ball[0] / ball[1:].mean() > 1.3 * wall[0] / wall[1:].mean()


def test_exr_holds_radiance_and_ground_truth(here):
    arguments = ("--width", "64", "--height", "48", "--depth", "3", "--water", "II", "--samples", "4")
    result = mirrorgaze("render", "aqua2", *arguments, "-o", "view.exr")
    assert result.exit_code == 0, result.stderr
    bitmap = mi.Bitmap(str(here / "view.exr"))
    names = [field.name for field in bitmap.struct_()]
    assert sorted(names) == sorted(LAYERS)
    layers = np.array(bitmap)
    assert layers.shape == (48, 64, len(LAYERS))
    distance = layers[..., names.index("distance.Z")]
    assert 0.05 < distance.min() < distance.max() < 12  # the tank is 8 m wide


def test_water_changes_what_is_seen(here):
    """Type III takes more light than IB: the same wall in the direct view is another colour."""
    for water in ("IB", "III"):
        assert (
            mirrorgaze(
                "render", "bench", "--water", water, "--width", "32", "--height", "24", "-o", f"{water}.exr"
            ).exit_code
            == 0
        )
    clear, turbid = (np.array(mi.Bitmap(str(here / f"{water}.exr")))[..., :3] for water in ("IB", "III"))
    assert not np.allclose(clear, turbid, rtol=0.1)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--q1", "300"), "expected q1 (pan) between -77.5 and 77.5 deg, got 300"),
        (("--q2", "nan"), "expected q2 (tilt) between -32.5 and 122.5 deg, got nan"),
        (("--world", "moon"), "expected a world (blue, reef, tank) or a file that ends in .obj, .ply, .stl, .glb, .gltf, .xml, got 'moon'"),
        (("--depth", "-3"), "expected a depth from 0.5 to 100 m, got -3 m"),
        (("--water", "9Z"), "expected a Jerlov type (I, IA, IB, II, III, 1C, 3C, 5C, 7C, 9C), got '9Z'"),
        (("-o", "view.bmp"), "expected an image file that ends in .png or .exr, got 'view.bmp'"),
        (("-o", "nowhere/view.png"), "there is no nowhere"),
        (("--width", "0"), "--width"),
    ],
)
def test_bad_input_is_a_sentence_and_writes_nothing(here, arguments, sentence):
    result = mirrorgaze("render", "aqua2", *arguments)
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert not list(here.iterdir())


@pytest.mark.parametrize("command", ["render", "export", "design"])
def test_an_impossible_rig_is_refused_by_every_command(impossible_rig, here, command):
    """M1 inside the port: the sentence names the key; nothing but the rig file is there afterwards."""
    result = mirrorgaze(command, impossible_rig)
    assert result.exit_code == 2
    assert "fold_mirror.distance_mm = 10" in result.stderr
    assert [path.name for path in here.iterdir()] == [impossible_rig]


def test_export_names_what_it_wrote(here, monkeypatch):
    # A slicer on the PATH would take a minute of its own; its check has its own tests.
    monkeypatch.setenv("PATH", str(here))
    result = mirrorgaze("export", "aqua2", "-o", "mount", "--json")
    assert result.exit_code == 0, result.stderr
    files = json.loads(result.stdout)["files"]
    assert {"mount/parts/yoke.stl", "mount/aqua2.step", "mount/robot/aqua2.urdf", "mount/manifest.json"} <= set(files)
    there = [path for path in (here / "mount").rglob("*") if path.is_file()]
    assert sorted(files) == sorted(str(path.relative_to(here)) for path in there)
    assert "export: drawings" in result.stderr
