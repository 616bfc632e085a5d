"""Whatever is wrong with a rig file is said, all at once, in the words of the file."""

from __future__ import annotations

import copy
import math
import pickle
import tomllib
from pathlib import Path
from typing import Any

import pytest
import tomlkit
from hypothesis import given
from hypothesis import strategies as st

from rigs import Problem, Rig, RigError, preset_path
from rigs.documents.validation import validated

AQUA2 = tomllib.loads(preset_path("aqua2").read_text(encoding="utf-8"))
GONE = object()


def changed(**edits: Any) -> dict[str, Any]:
    """AQUA2 with values replaced; keys are dotted with double underscores: camera__fx_px=3."""
    document = copy.deepcopy(AQUA2)
    for dotted, value in edits.items():
        *parents, last = dotted.split("__")
        section = document
        for parent in parents:
            section = section[parent]
        if value is GONE:
            del section[last]
        else:
            section[last] = value
    return document


def problems_of(document: dict[str, Any], folder: Path = Path()) -> list[str]:
    with pytest.raises(RigError) as caught:
        Rig.parse(tomlkit.dumps(document), source="rig.toml", folder=folder)
    return [str(problem) for problem in caught.value.problems]


BAD_VALUES = {
    "text for a number": ({"camera__fx_px": "500"}, "camera.fx_px = '500': expected a number"),
    "truth for a number": ({"camera__fx_px": True}, "camera.fx_px = True: expected a number"),
    "fraction of a pixel": ({"camera__width_px": 640.5}, "camera.width_px = 640.5: expected a whole number"),
    "text for pixels": ({"camera__width_px": "640"}, "camera.width_px = '640': expected a whole number"),
    "number for text": ({"description": 4}, "description = 4: expected text in quotes"),
    "nan": ({"water__salinity_ppt": math.nan}, "water.salinity_ppt = nan: expected a finite number"),
    "inf": ({"fold_mirror__distance_mm": math.inf}, "fold_mirror.distance_mm = inf: expected a finite number"),
    "minus inf": ({"camera__yaw_deg": -math.inf}, "camera.yaw_deg = -inf: expected a finite number"),
    "nan in a list": (
        {"camera__position_mm": [0.0, math.nan, 0.0]},
        "camera.position_mm[1] = nan: expected a finite number",
    ),
    "zero thickness": (
        {"gaze_mirror__thickness_mm": 0.0},
        "gaze_mirror.thickness_mm = 0.0: expected a number greater than 0",
    ),
    "zero port thickness": ({"port__thickness_mm": 0}, "port.thickness_mm = 0: expected a number greater than 0"),
    "too salty": (
        {"water__salinity_ppt": 36.0},
        "water.salinity_ppt = 36.0: expected a number less than or equal to 35",
    ),
    "short list": ({"camera__position_mm": [1.0]}, "camera.position_mm = [1.0]: expected a list of 3 numbers"),
    "long list": (
        {"camera__position_mm": [1.0, 2.0, 3.0, 4.0]},
        "camera.position_mm = [1.0, 2.0, 3.0, 4.0]: expected a list of 3 numbers",
    ),
    "number for a list": ({"camera__position_mm": 5}, "camera.position_mm = 5: expected a list of numbers"),
    "number for a table": ({"joints__pan": 3}, "joints.pan = 3: expected a table"),
    "number for a tagged table": ({"camera": 3}, "camera = 3: expected a table"),
    "unknown choice": (
        {"mount__material": "wood"},
        "mount.material = 'wood': expected 'abs', 'petg', 'pla' or 'nylon'",
    ),
    "unknown sign": ({"joints__pan__sign": 2}, "joints.pan.sign = 2: expected 1 or -1"),
    "unknown servo": (
        {"servos__tilt": "hs5086"},
        "servos.tilt = 'hs5086': expected a servo of the catalogue (hs5086wp, hs5086wp-paper, hs646wp) or a table",
    ),
    "wrong tag": ({"camera__model": "pin"}, "camera.model = 'pin': expected one of 'fisheye', 'pinhole'"),
    "no tag": ({"port__shape": GONE}, "port.shape: expected one of 'dome', 'flat', 'none'"),
    "name with a space": (
        {"name": "My Rig"},
        "name = 'My Rig': expected lower-case letters, digits, - and _, beginning with a letter or a digit",
    ),
    "missing key": ({"camera__fy_px": GONE}, "camera.fy_px: expected a value, but the key is missing"),
    "missing section": ({"camera": GONE}, "camera: expected a value, but the key is missing"),
    "unknown key": ({"camera__fov_deg": 90}, "camera.fov_deg = 90: expected one of the known keys cx_px, cy_px,"),
    "nearly a key": (
        {"camera__widht_px": 640},
        "camera.widht_px = 640: expected a known key; did you mean 'width_px'?",
    ),
    "nearly a section": ({"watr": {"salinity_ppt": 1}}, "watr: expected a known key; did you mean 'water'?"),
    "key with a dot": ({"camera.fx_px": 3}, "camera.fx_px = 3: expected one of the known keys camera,"),
    "key of another shape": (
        {"hull__file": "hull.step"},
        "hull.file = 'hull.step': expected one of the known keys edge_",
    ),
    "joint limits reversed": (
        {"joints__pan__min_deg": 80.0},
        "joints.pan: expected min_deg < max_deg, got 80 and 77.5",
    ),
    "joint limits equal": ({"joints__pan__min_deg": 77.5}, "joints.pan: expected min_deg < max_deg, got 77.5 and 77.5"),
    "principal point outside": (
        {"camera__cx_px": 640.0},
        "camera: expected a principal point inside the 640 x 480 image, got cx_px = 640.0, cy_px = 239.5",
    ),
    "three coefficients": (
        {"camera__distortion": [0.0, 0.0, 0.0]},
        "camera: expected 5 or 8 distortion coefficients, got 3",
    ),
    "port that looks inwards": (
        {"port__normal": [0.0, 0.0, -1.0]},
        "port: expected a normal that points out of the housing (z > 0), got (0.0, 0.0, -1.0)",
    ),
    "round box": (
        {"hull__edge_radius_mm": 65.0},
        "hull: expected edge_radius_mm below half the smallest side (65), got 65",
    ),
}


@pytest.mark.parametrize(("edits", "expected"), BAD_VALUES.values(), ids=BAD_VALUES.keys())
def test_a_bad_value_is_named_with_what_was_expected(edits, expected):
    (problem,) = problems_of(changed(**edits))
    assert problem.startswith(expected)


@pytest.mark.parametrize("section", ["fold_mirror", "gaze_mirror", "joints", "servos", "hull", "mount"])
def test_mirror_sections_come_all_or_none(section):
    (problem,) = problems_of(changed(**{section: GONE}))
    assert problem.endswith(f"or none; missing: {section}")


def test_a_dome_holds_the_pinhole_and_its_aperture():
    dome = {"shape": "dome", "material": "pmma", "inner_radius_mm": 50.0, "thickness_mm": 5.0}
    outside = dome | {"centre_mm": [30.0, 40.0, 0.0], "aperture_diameter_mm": 90.0}
    assert problems_of(changed(port=outside)) == [
        "port: expected the pinhole inside the dome: centre_mm is 50 mm away from it, but inner_radius_mm is 50"
    ]
    assert problems_of(changed(port=dome | {"aperture_diameter_mm": 101.0})) == [
        "port: expected an aperture of at most the inner diameter 100 mm, got aperture_diameter_mm = 101"
    ]


def test_a_servo_of_your_own_has_its_pulses_in_order():
    servo = AQUA2["servos"]["pan"]
    catalogued = Rig.load("aqua2").gaze.servos.pan.model_dump(mode="json", exclude_none=True)
    numbers = catalogued | {"name": "mine", "pulse_us": [2250.0, 750.0]}
    assert isinstance(servo, str)
    assert problems_of(changed(servos__pan=numbers)) == [
        "servos.pan: expected pulse_us as shortest and longest, got [2250.0, 750.0]"
    ]


def test_several_problems_are_said_at_once():
    document = changed(
        camera__widht_px=640,
        camera__width_px="640",
        camera__roll_deg="level",
        joints__pan__min_deg=80.0,
        joints__pan__offset_deg="none",
        water__jerlov_type="9Z",
        mount=GONE,
    )
    found = problems_of(document)
    assert {problem.split(":")[0] for problem in found} == {
        "camera.widht_px = 640",
        "camera.width_px = '640'",
        "camera.roll_deg = 'level'",
        "joints.pan",
        "joints.pan.offset_deg = 'none'",
        "water.jerlov_type = '9Z'",
        "(whole file)",
    }
    assert len(found) == 7


def test_a_value_taken_out_does_not_make_a_problem_of_its_own():
    """The default radius, 20 mm, would not fit this hull; the file does not say 20."""
    assert problems_of(changed(hull__edge_radius_mm="soft", hull__height_mm=30.0)) == [
        "hull.edge_radius_mm = 'soft': expected a number"
    ]


def test_the_error_says_where_it_comes_from():
    with pytest.raises(
        RigError, match=r"^rig\.toml: 1 problem\n  camera\.fx_px = -1: expected a number greater than 0$"
    ):
        Rig.parse(tomlkit.dumps(changed(camera__fx_px=-1)), source="rig.toml", folder=Path())
    with pytest.raises(RigError, match=r"^rig\.toml: 2 problems\n"):
        Rig.parse(tomlkit.dumps(changed(camera__fx_px=-1, name=3)), source="rig.toml", folder=Path())


def test_a_long_value_is_cut():
    problem = Problem(place="name", value="x" * 1000, expected="less")
    assert len(str(problem)) < 120


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[camera\nwidth_px = 3", "line 1, column 8: expected valid TOML: "),
        ("name = ", "end of document: expected valid TOML: "),
        ("a = 1\na = 2\n", "line 2, column 6: expected valid TOML: "),
    ],
)
def test_a_syntax_error_is_said_with_its_line(text, expected):
    with pytest.raises(RigError) as caught:
        Rig.parse(text, source="rig.toml", folder=Path())
    (problem,) = caught.value.problems
    assert str(problem).startswith(expected)


@given(
    section=st.sampled_from(["camera", "port", "water", "fold_mirror", "joints", "servos", "hull", "mount", "name"]),
    value=st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
        max_leaves=5,
    ),
)
def test_no_document_ends_in_anything_but_a_rig_or_problems(section, value):
    rig, problems = validated(Rig, AQUA2 | {section: value})
    assert (rig is None) == bool(problems)
    assert all(str(problem) for problem in problems)


LAMP = {"position_mm": [1.0, 2.0, 3.0], "angle_deg": 50.0, "luminous_flux_lm": 100.0}
BAD_LAMPS = {
    "two numbers": ({"position_mm": [1.0, 2.0]}, "lamps[1].position_mm = [1.0, 2.0]: expected a list of 3 numbers"),
    "missing": ({"angle_deg": GONE}, "lamps[1].angle_deg: expected a value, but the key is missing"),
    "unknown": ({"angel_deg": 50.0}, "lamps[1].angel_deg = 50.0: expected a known key; did you mean 'angle_deg'?"),
}


@pytest.mark.parametrize(("edit", "message"), BAD_LAMPS.values(), ids=BAD_LAMPS)
def test_the_wrong_lamp_and_its_key_are_named(edit, message):
    bad = {key: value for key, value in (LAMP | edit).items() if value is not GONE}
    assert problems_of(changed(lamps=[LAMP, bad])) == [message]


def test_a_file_name_with_nul_is_refused():
    assert problems_of(changed(camera__response_file="a\0b.csv"))[-1] == (
        "camera.response_file = 'a\\x00b.csv': expected a file's name without NUL"
    )


def test_of_many_unknown_keys_the_first_hundred_are_told():
    """In a time that grows with the file, not with its square."""
    text = "".join(f"unknown_{k} = 1\n" for k in range(10_000)) + preset_path("aqua2").read_text(encoding="utf-8")
    with pytest.raises(RigError) as caught:
        Rig.parse(text, source="rig.toml", folder=Path())
    problems = [str(problem) for problem in caught.value.problems]
    assert problems[0].startswith("unknown_0 = 1: expected one of the known keys camera, ")
    assert problems[100:] == ["(whole file): expected fewer problems: these are the first 100"]


BEYOND_MEASURE = {
    "mirror": ({"gaze_mirror__width_mm": 1e12}, "gaze_mirror.width_mm = 1000000000000.0: "),
    "focal length": ({"camera__fx_px": 1e300}, "camera.fx_px = 1e+300: "),
    "place": ({"camera__position_mm": [0.0, -1e300, 0.0]}, "camera.position_mm = [0.0, -1e+300, 0.0]: "),
    "angle": ({"camera__yaw_deg": 1e9}, "camera.yaw_deg = 1000000000.0: "),
}


@pytest.mark.parametrize(("edit", "place"), BEYOND_MEASURE.values(), ids=BEYOND_MEASURE)
def test_numbers_beyond_measure_are_refused_with_their_key(edit, place):
    assert problems_of(changed(**edit)) == [f"{place}expected a number from -1,000,000 to 1,000,000"]


def test_a_number_so_small_that_nothing_can_be_divided_by_it_is_refused():
    (problem,) = problems_of(changed(gaze_mirror__width_mm=5e-324))
    assert problem == "gaze_mirror.width_mm = 5e-324: expected 0, or a number of at least 1e-30 in size"


def test_joints_and_seeds_beyond_measure_are_refused_with_their_key():
    document = changed(joints__pan__max_deg=1e9, image_sensor={"pattern_seed": 10**900})
    seed, joint = problems_of(document)
    assert joint == "joints.pan.max_deg = 1000000000.0: expected a number less than or equal to 360"
    assert seed.startswith("image_sensor.pattern_seed = 1000") and seed.endswith("of at most 9223372036854775807")


def test_an_error_goes_from_one_process_to_another():
    error = RigError("rig.toml", [Problem(place="name", value=3, expected="a name")])
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), again.problems) == (RigError, str(error), error.problems)
