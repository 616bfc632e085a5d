"""The presets are good, survive being written, and say what their sources say."""

from __future__ import annotations

import math
import tomllib

import pytest
import tomlkit

from rigs import Rig, preset_names, preset_path
from rigs.mounting import HullPlane


@pytest.mark.parametrize("name", preset_names())
def test_a_preset_loads_under_its_own_name(name):
    assert Rig.load(name).name == name


@pytest.mark.parametrize("name", preset_names())
def test_results_can_be_kept_by_a_rig(name):
    """Rigs that are equal have the same hash; the planes of a hull from a file have no order."""
    rig = Rig.load(name)
    if rig.file_hull is not None:
        deck, keel = (HullPlane(point_mm=(0.0, 0.0, z), normal=(0.0, 0.0, z)) for z in (1.0, -1.0))
        one, other = {"deck": deck, "keel": keel}, {"keel": keel, "deck": deck}
        assert hash(rig.with_gaze(hull={"planes": one})) == hash(rig.with_gaze(hull={"planes": other}))
    assert hash(rig) == hash(Rig.load(name))


@pytest.mark.parametrize("name", preset_names())
def test_a_preset_survives_being_written_and_read(name, tmp_path):
    rig = Rig.load(name)
    file = tmp_path / "copy.toml"
    file.write_text(tomlkit.dumps(rig.model_dump(mode="json", exclude_none=True)), encoding="utf-8")
    assert Rig.load(file) == rig


@pytest.mark.parametrize("name", preset_names())
def test_a_preset_is_the_same_by_name_by_path_and_by_text(name):
    path = preset_path(name)
    text = path.read_text(encoding="utf-8")
    assert Rig.load(name) == Rig.load(path) == Rig.load(str(path)) == Rig.parse(text, source=name, folder=path.parent)


def test_only_the_bench_has_no_mirrors():
    assert {name: Rig.load(name).gaze is not None for name in preset_names()} == {
        "aqua-shell": True,
        "aqua2": True,
        "bench": False,
        "bluerov2": True,
        "glider": True,
        "torpedo": True,
    }


def test_aqua2_is_the_size_that_is_commonly_quoted():
    hull = Rig.load("aqua2").gaze.hull
    assert (hull.length_mm, hull.width_mm, hull.height_mm) == (650, 450, 130)


def test_bluerov2_sees_80_degrees():
    """CentraleNantesROV/bluerov2: 1920 x 1080 pixels, 80 degrees horizontally."""
    camera = Rig.load("bluerov2").camera
    field_of_view = 2 * math.degrees(math.atan(camera.width_px / 2 / camera.fx_px))
    assert (camera.width_px, camera.height_px) == (1920, 1080)
    assert field_of_view == pytest.approx(80, abs=0.1)  # fx_px is given to 1 px


def test_bench_has_the_intrinsics_of_table_1():
    """Cortes-Perez & Torres-Mendez 2021, table 1, row "Air"."""
    camera = Rig.load("bench").camera
    assert (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px) == (476.42, 475.98, 960.68, 744.18)


def test_torpedo_is_as_long_and_as_thick_as_sparus_ii():
    """Carreras et al. 2018."""
    hull = Rig.load("torpedo").gaze.hull
    assert (hull.length_mm, hull.diameter_mm) == (1600, 230)


def test_aqua_shell_weighs_what_the_links_of_its_description_weigh():
    """aqua.urdf.xacro: shell, four hips, two middle hips, six legs with shoulders, and a ballast of 7140 kg/m³."""
    links_kg = 14.4 + 4 * 0.25 + 2 * 0.5 + 6 * (0.065 + 0.025) + 7140.0 * 0.10 * 0.025 * 0.0057
    assert Rig.load("aqua-shell").vehicle.mass_kg == pytest.approx(links_kg, abs=5e-4)


def test_joint_ranges_fit_the_servos():
    for name in ("aqua-shell", "aqua2", "bluerov2", "glider", "torpedo"):
        rig = Rig.load(name)
        for joint, servo in ((rig.gaze.joints.pan, rig.gaze.servos.pan), (rig.gaze.joints.tilt, rig.gaze.servos.tilt)):
            assert joint.max_deg - joint.min_deg <= servo.travel_deg


def test_every_key_of_a_preset_is_a_key_of_the_schema():
    """Editors complete and check rig files by the schema: it must know what we write ourselves."""
    known = Rig.model_json_schema()["properties"]
    for name in preset_names():
        document = tomllib.loads(preset_path(name).read_text(encoding="utf-8"))
        assert set(document) <= set(known)
