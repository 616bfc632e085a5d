"""`mirrorgaze rigs`, `new`, `check` and `schema`: exit status, words, and nothing written on bad input."""

from __future__ import annotations

import json
import subprocess
import sys

import jsonschema
import pytest
import tomlkit
import trimesh
from typer.testing import CliRunner

from mirrorgaze.cli import app
from rigs import Rig, load_document, preset_names, preset_path, save_document


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


@pytest.fixture
def bad_rig(here):
    document = load_document(preset_path("aqua2"))
    document["camera"]["fx_px"] = -1
    document["camera"]["cy_px"] = float("nan")
    document["port"]["thicknes_mm"] = 3
    save_document(document, here / "bad.toml")
    return "bad.toml"


def test_a_check_loads_little():
    """A rig's numbers need no renderer, no solids and no meshes."""
    too_heavy = {"mitsuba", "trimesh", "build123d", "matplotlib", "tomlkit", "scipy.optimize", "scipy.ndimage", "igl"}
    code = f"""import sys
from mirrorgaze.cli import main
try:
    main()
finally:
    print(*sorted({too_heavy} & set(sys.modules)))"""
    child = subprocess.run(
        [sys.executable, "-c", code, "check", "aqua2"], check=True, stdout=subprocess.PIPE, text=True
    )
    assert child.stdout.splitlines()[-1] == ""


def test_rigs_lists_the_presets():
    result = mirrorgaze("rigs")
    assert result.exit_code == 0
    assert [line.split()[0] for line in result.stdout.splitlines()] == preset_names()
    assert [rig["name"] for rig in json.loads(mirrorgaze("rigs", "--json").stdout)] == preset_names()


def test_new_copies_a_preset_with_its_comments(here):
    result = mirrorgaze("new", "reef", "--from", "bluerov2")
    assert result.exit_code == 0
    original = preset_path("bluerov2").read_text(encoding="utf-8")
    assert (here / "reef.toml").read_text(encoding="utf-8") == original.replace('name = "bluerov2"', 'name = "reef"')
    assert [path.name for path in here.iterdir()] == ["reef.toml"]


@pytest.mark.parametrize(("shape", "preset"), [("box", "aqua2"), ("open-frame", "bluerov2"), ("torpedo", "torpedo")])
def test_new_begins_with_the_preset_that_has_a_hull(here, shape, preset):
    assert mirrorgaze("new", "reef", "--hull", shape).exit_code == 0
    assert Rig.load(here / "reef.toml").model_copy(update={"name": preset}) == Rig.load(preset)


@pytest.mark.usefixtures("unplaced")
def test_new_puts_a_hulls_file_in_the_presets_place_and_says_what_it_found(here):
    """The middle of the box, at 1 m along the file's z, is the body's origin; its y is forward."""
    for folder in ("hulls", "rigs"):
        (here / folder).mkdir()
    box = trimesh.creation.box(extents=(0.2, 1.6, 0.3))
    box.apply_translation((0, 0, 1)).export(here / "hulls" / "mine.stl")
    result = mirrorgaze("new", "reef", "--from", "torpedo", "--hull", "hulls/mine.stl", "-o", "rigs/reef.toml")
    assert result.exit_code == 0, result.stderr
    rig = Rig.load(here / "rigs" / "reef.toml")
    hull = rig.gaze.hull
    assert (hull.file, hull.unit, hull.position_mm) == (here / "hulls" / "mine.stl", "m", (0, 0, -1000))
    assert (hull.yaw_deg, hull.pitch_deg, hull.roll_deg) == (-90, 0, 0)
    assert rig.gaze.mount.fold_plane is None
    first, *lines, last = result.stdout.splitlines()
    assert first == "mine.stl: 1 body, 12 triangles"
    assert [line.split(":")[0].strip() for line in lines[:3]] == ["unit", "forward is +y", "up is +z"]
    assert last.startswith("rigs/reef.toml: written; look at it: mirrorgaze show rigs/reef.toml; ")
    assert "yaw_deg = -90.0 # turns the file to the left" in (here / "rigs" / "reef.toml").read_text(encoding="utf-8")


@pytest.mark.usefixtures("unplaced")
def test_new_takes_axes_and_unit_as_told(here):
    trimesh.creation.box(extents=(2, 4, 16)).export(here / "mine.obj")
    told = ("--unit", "inch", "--forward", "-y", "--up", "+x")
    result = mirrorgaze("new", "reef", "--hull", "mine.obj", *told)
    assert result.exit_code == 0, result.stderr
    assert "forward is -y: as given" in result.stdout
    assert "length x width x height 102 x 406 x 51 mm" in result.stdout


@pytest.mark.usefixtures("unplaced")
def test_new_takes_a_robots_mass(here):
    link = '<link name="b"><inertial><mass value="7.5"/></inertial>{}</link>'
    box = '<visual><geometry><box size="0.6 0.2 0.1"/></geometry></visual>'
    (here / "eel.urdf").write_text(f'<robot name="eel">{link.format(box)}</robot>', encoding="utf-8")
    assert mirrorgaze("new", "reef", "--hull", "eel.urdf").exit_code == 0
    rig = Rig.load(here / "reef.toml")
    assert (rig.vehicle.mass_kg, rig.gaze.hull.unit, rig.gaze.hull.position_mm) == (7.5, None, (0, 0, 0))


def test_new_writes_where_it_is_told(here):
    assert mirrorgaze("new", "reef", "-o", "other.toml").exit_code == 0
    assert Rig.load(here / "other.toml").name == "reef"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["My Rig"], "name = 'My Rig': expected lower-case letters"),
        (["reef", "--from", "aqua"], "did you mean 'aqua2'?"),
        (["reef", "-o", "nowhere/reef.toml"], "expected an existing folder, but there is no nowhere"),
        (["reef", "-o", "."], "expected a new file, but there is one already"),
        (["reef", "--hull", "sphere"], "hull 'sphere': expected box, open-frame, torpedo or the name of a file"),
        (["reef", "--hull", "mine.stl"], "mine.stl: expected a file, found nothing"),
        (
            ["reef", "--hull", "box", "--unit", "mm", "--up", "+z"],
            "--unit mm --up +z: expected beside the file",
        ),
        (["reef", "--hull", "box", "--look", "30,0"], "--look 30,0: expected beside the file"),
        (["reef", "--hull", "box", "--from", "aqua2"], "expected --from or the shape of a hull, got both"),
    ],
)
def test_new_writes_nothing_on_bad_input(here, arguments, words):
    result = mirrorgaze("new", *arguments)
    assert result.exit_code == 2
    assert words in result.stderr
    assert not list(here.iterdir())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            [],
            "mine.stl: expected --unit mm or cm or inch: the file does not say what its numbers mean, and",
        ),
        (["--unit", "ft"], "mine.stl: --unit ft: expected mm, cm, m, inch"),
        (["--unit", "mm", "--look", "30"], "--look 30: expected YAW,PITCH in degrees, yaw from -180 to 180"),
        (["--unit", "mm", "--look", "0,-95"], "--look 0,-95: expected YAW,PITCH in degrees"),
        (["--unit", "mm", "--look", "left,0"], "--look left,0: expected YAW,PITCH in degrees"),
        (["--unit", "mm", "--forward", "+x", "--up", "-x"], "--forward +x and --up -x: expected two different axes"),
        (
            ["--unit", "ft", "--keep", "smallest", "--forward", "q", "--camera-mm", *"000", "--camera-from", "a"],
            "mine.stl: --unit ft: expected mm, cm, m, inch; --forward q: expected +x, -x, +y, -y, +z, -z; "
            "--keep smallest: expected all, joined, largest; --camera-from a: expected that or --camera-mm, got both",
        ),
        (
            ["--unit", "mm", "--camera-from", "a"],
            "of mine.stl, which has none; say where the pinhole is: --camera-mm",
        ),
        (["--unit", "mm", "--from", "bench"], "expected a preset with mirrors, got one that has no hull"),
    ],
)
def test_new_says_what_it_needs_of_a_hulls_file(here, arguments, words):
    trimesh.creation.box(extents=(300, 100, 50)).export(here / "mine.stl")
    result = mirrorgaze("new", "reef", "--hull", "mine.stl", *arguments)
    assert result.exit_code == 2
    assert words in result.stderr
    assert [path.name for path in here.iterdir()] == ["mine.stl"]


def test_new_says_what_it_took_the_file_for_when_no_mount_fits(here):
    """Axes and unit are what a user looks at first then."""
    trimesh.creation.box(extents=(140, 40, 40)).export(here / "mine.stl")
    result = mirrorgaze("new", "reef", "--hull", "mine.stl", "--unit", "mm")
    assert result.exit_code == 2
    assert "expected a hull with room for a mount, found none" in result.stderr
    assert "forward is +x" in result.stdout
    assert [path.name for path in here.iterdir()] == ["mine.stl"]


def test_new_does_not_overwrite(here):
    (here / "reef.toml").write_text("mine", encoding="utf-8")
    result = mirrorgaze("new", "reef")
    assert (result.exit_code, result.stderr) == (
        2,
        "mirrorgaze: reef.toml: expected a new file, but there is one already\n",
    )
    assert (here / "reef.toml").read_text(encoding="utf-8") == "mine"


def test_a_copy_of_a_preset_keeps_the_hull_of_its_file(here):
    assert mirrorgaze("new", "reef", "--from", "aqua-shell").exit_code == 0
    assert Rig.load("reef.toml").file_hull.file.samefile(Rig.load("aqua-shell").file_hull.file)


@pytest.mark.parametrize("name", preset_names())
def test_check_finds_the_presets_good(name):
    result = mirrorgaze("check", name)
    assert result.exit_code == 0, result.stderr
    assert result.stdout.startswith(f"{name}: good\n")
    assert json.loads(mirrorgaze("check", name, "--json").stdout)["good"] is True


def test_check_shows_the_key_facts():
    lines = [" ".join(line.split()) for line in mirrorgaze("check", "aqua2").stdout.splitlines()]
    assert lines == [
        "aqua2: good",
        "camera pinhole, 640 x 480 px",
        "port flat, pmma, 8 mm",
        "M1 80 x 90 x 3 mm, d1 = 95 mm",
        "M2 80 x 100 x 3 mm, d2 = 125 mm",
        "q1 (pan) -77.5 to 77.5 degrees",
        "q2 (tilt) -32.5 to 122.5 degrees",
    ]


def test_check_says_everything_that_is_wrong(bad_rig):
    result = mirrorgaze("check", bad_rig)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.splitlines() == [
        "mirrorgaze: bad.toml: 3 problems",
        "  camera.fx_px = -1: expected a number greater than 0",
        "  camera.cy_px = nan: expected a finite number",
        "  port.thicknes_mm = 3: expected a known key; did you mean 'thickness_mm'?",
    ]


def test_check_says_it_to_machines_too(bad_rig):
    result = mirrorgaze("check", bad_rig, "--json")
    assert result.exit_code == 2
    answer = json.loads(result.stdout)
    assert answer["good"] is False
    assert [problem["place"] for problem in answer["problems"]] == ["camera.fx_px", "camera.cy_px", "port.thicknes_mm"]
    assert [problem["value"] for problem in answer["problems"]] == [-1, "nan", 3]


def test_check_reports_a_rig_that_cannot_be_built(here):
    """A well-formed rig whose fold mirror stands inside the port's glass."""
    document = load_document(preset_path("aqua2"))
    document["fold_mirror"]["distance_mm"] = 21.0
    save_document(document, here / "tight.toml")
    result = mirrorgaze("check", "tight.toml")
    assert result.exit_code == 2
    assert result.stderr.startswith("mirrorgaze: tight.toml: ")
    assert "fold_mirror.distance_mm = 21.0: expected M1 in the water in front of the port" in result.stderr


def test_schema_accepts_the_presets_and_refuses_a_bad_rig():
    schema = json.loads(mirrorgaze("schema").stdout)
    validator = jsonschema.Draft202012Validator(schema)
    for name in preset_names():
        document = load_document(preset_path(name)).unwrap()
        validator.validate(document)
    document["camera"]["fx_px"] = -1
    assert not validator.is_valid(document)
    assert validator.is_valid(tomlkit.parse(preset_path("aqua2").read_text(encoding="utf-8")).unwrap())


@pytest.mark.parametrize(("section", "key"), [("water", "iop_file"), ("camera", "response_file"), ("hull", "file")])
def test_a_check_reads_the_files_that_a_rig_names(here, section, key):
    document = load_document(preset_path("aqua-shell"))
    (here / "aqua-shell.ply").write_bytes(preset_path("aqua-shell").with_suffix(".ply").read_bytes())
    (here / "garbage.step").write_bytes(bytes(range(256)))
    if section == "water":
        document["water"].clear()
    if section == "hull":
        del document["hull"]["unit"]
    document[section][key] = "garbage.step"
    save_document(document, here / "rig.toml")
    result = mirrorgaze("check", "rig.toml")
    assert result.exit_code == 2
    assert f"{section}.{key} = 'garbage.step': expected " in result.stderr
    assert "good" not in result.stdout
