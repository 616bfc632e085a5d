"""Dive files: what is wrong with them is told at once, in the words of the file."""

import tomllib

import pytest

from dives.dive import Dive, DiveError, parse_dive, preset_names, varied
from dives.specification import overridden
from dives.trajectories.attitude_sensor import AttitudeSettings
from rigs.documents.problems import Problem
from scenes.baking.light_quality import LightQuality
from tracking.perception import RED_BALL

GOOD = """
name = "trial"
rig = "aqua2"
world = "tank"
depth_m = 5.0
duration_s = 2.0

[robot]
motion = "hover"

[target.path]
shape = "straight"
start_m = [2.0, 0.5, 0.0]
velocity_m_per_s = [0.0, 0.1, 0.0]
"""


def changed(**values):
    """The good file with top-level lines in place of its own, or more of them."""
    lines = [line for line in GOOD.strip().splitlines() if line.partition(" =")[0] not in values]
    head = lines.index("[robot]")
    own = [f"{key} = {value}" for key, value in values.items()]
    return "\n".join([*lines[:head], *own, *lines[head:]])


def problems(text, tmp_path) -> list[Problem]:
    with pytest.raises(DiveError) as caught:
        parse_dive(text, source="trial.toml", folder=tmp_path)
    return list(caught.value.problems)


@pytest.mark.parametrize("name", preset_names())
def test_presets_are_good_dives_and_come_back_from_their_own_text(name, tmp_path):
    dive = Dive.load(name)
    assert dive.name == name
    assert parse_dive(dive.as_toml(), source=name, folder=tmp_path) == dive


def test_presets_ship_with_the_package():
    """Hatchling takes all files of the packages that are listed; a .gitignore could still leave some out."""
    assert {"spiral", "sunlit", "prediction", "dark", "wide-hue"} <= set(preset_names())


def test_every_problem_is_told_at_once_with_its_place_and_value(tmp_path):
    """Single values, names that do not exist, and a path that leaves the water, in one message."""
    text = changed(
        duration_s="0.0", frame_rate_hz="-30.0", jerlov_type='"9C"', variant='"best"', colour='"red"', world='"pool"'
    ).replace("[0.0, 0.1, 0.0]", "[0.0, 0.0, 1.0]")
    found = {problem.place: problem for problem in problems(text, tmp_path)}
    assert found.keys() == {
        "duration_s",
        "frame_rate_hz",
        "colour",
        "variant",
        "world",
        "jerlov_type",
        "target.path",
    }
    assert found["duration_s"].value == 0.0
    assert "greater than 0" in found["duration_s"].expected
    assert found["frame_rate_hz"].value == -30.0
    assert "paper-literal" in found["variant"].expected
    assert "solonenko-mobley" in found["jerlov_type"].expected
    # 5 m deep, rising by 1 m/s, radius 0.1 m: the top reaches the surface after 4.9 s.
    assert "at 4.9" in found["target.path"].expected


def test_a_path_that_is_wrong_hides_nothing_else(tmp_path):
    text = changed(world='"pool"', jerlov_type='"9C"', depth_m="-5.0").replace('"straight"', '"orbit"')
    places = [problem.place for problem in problems(text, tmp_path)]
    assert sorted(places) == ["depth_m", "jerlov_type", "target.path.shape", "world"]


def test_a_target_stays_or_goes(tmp_path):
    """Of a target that stays the position is named; with both, or with neither, nothing is known."""
    head, path = GOOD.split("[target.path]\n")
    (problem,) = problems(f"{head}[target]\nposition_m = [0.3, 0.0, 0.0]", tmp_path)
    assert (problem.place, "keeps off the hull" in problem.expected) == ("target.position_m", True)
    (problem,) = problems(f"{head}[target]\nposition_m = [2.0, 0.0, 0.0]\n[target.path]\n{path}", tmp_path)
    assert (problem.place, "got both" in problem.expected) == ("target", True)
    (problem,) = problems(f"{head}[target]\ncolour = 'red'", tmp_path)
    assert (problem.place, "got none" in problem.expected) == ("target", True)


def test_target_in_the_hull_is_told_with_the_time(tmp_path):
    """aqua2's hull reaches from x = -0.325 to 0.325 m: a ball of 0.1 m touches it from x = 0.425 m on."""
    text = changed(duration_s="10.0").replace("[2.0, 0.5, 0.0]", "[1.425, 0.0, 0.0]")
    (problem,) = problems(text.replace("[0.0, 0.1, 0.0]", "[-0.5, 0.0, 0.0]"), tmp_path)
    assert problem.place == "target.path"
    # (1.425 - 0.425) / 0.5 = 2 s; at the rear it leaves at x = -0.425 m, 3.7 s on its way.
    assert "hull" in problem.expected
    first, last = (float(problem.expected.split(word)[1].split()[0]) for word in (" from ", " to "))
    assert first == pytest.approx(2.0, abs=0.05)
    assert last == pytest.approx(3.7, abs=0.05)


def test_a_fast_path_through_the_hull_is_not_missed_between_two_frames(tmp_path):
    """At 40 m/s the target is 1.3 m farther from one frame to the next."""
    text = changed().replace("[2.0, 0.5, 0.0]", "[10.0, 0.0, 0.0]").replace("[0.0, 0.1, 0.0]", "[-40.0, 0.0, 0.0]")
    (problem,) = problems(text, tmp_path)
    assert "hull" in problem.expected


@pytest.mark.parametrize(
    ("before", "after", "place", "expected"),
    [
        ('rig = "aqua2"', 'rig = "bench"', "rig", "mirrors"),
        ('rig = "aqua2"', 'rig = "aqua3"', "rig", "aqua2"),
        ('motion = "hover"', 'motion = "drift"', "robot.motion", "'file', 'hover', 'waypoints'"),
        (
            'shape = "straight"',
            'shape = "zigzag"',
            "target.path.shape",
            "'circle', 'file', 'spiral', 'straight', 'waypoints'",
        ),
        ("velocity_m_per_s", "speed", "target.path.velocity_m_per_s", "missing"),
        ("depth_m = 5.0", "depth_m = 0.1", "depth_m", "greater than or equal to 0.5"),
        ("depth_m = 5.0", "depth_m = nan", "depth_m", "finite"),
        ("[robot]", "[attitude]\nnoise_deg = -0.1\n[robot]", "attitude.noise_deg", "greater than or equal to 0"),
        ("[robot]", "[attitude]\nlatency_ms = 600\n[robot]", "attitude.latency_ms", "less than or equal to 500"),
        ("[robot]", "[attitude]\ngyro = 1.0\n[robot]", "attitude.gyro", "known keys drift_deg_per_min"),
        ("duration_s = 2.0", "duration_s = 2.0\nframe_rate_hz = 100.0", "frame_rate_hz", "480 rows within a frame"),
        ("[robot]", "[detector]\nopening_px = 4\n[robot]", "detector", "odd opening_px"),
        ("[robot]", 'video = "h264"\n[offline_detector]\naspect_max = 4.0\n[robot]', "video", "ffv1"),
        ('world = "tank"', 'world = "none.ply"', "world", "a file that is there"),
        (
            'motion = "hover"',
            'motion = "waypoints"\npoints_m = [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]\nspeed_m_per_s = 0.1',
            "robot.points_m[0]",
            "begins at the robot's start",
        ),
        (
            'motion = "hover"',
            'motion = "waypoints"\npoints_m = [[0.0, 0.0, 0.0]]\nspeed_m_per_s = 0.1',
            "robot",
            "at least 2 points",
        ),
    ],
)
def test_single_problem(before, after, place, expected, tmp_path):
    text = GOOD.replace(before, after)
    found = problems(text, tmp_path)
    assert place in {problem.place for problem in found}
    assert expected in next(problem for problem in found if problem.place == place).expected


def test_a_robot_of_which_nothing_is_said_hovers(tmp_path):
    unsaid = GOOD.replace('[robot]\nmotion = "hover"\n', "")
    assert "robot" not in unsaid
    assert parse_dive(unsaid, source="x", folder=tmp_path) == parse_dive(GOOD, source="x", folder=tmp_path)


def test_a_rig_that_is_not_there_is_named_once(tmp_path):
    (problem,) = problems(GOOD.replace('rig = "aqua2"', 'rig = "aqua3"'), tmp_path)
    assert problem.expected.startswith("a preset (aqua-shell, aqua2, ")
    assert problem.expected.endswith("did you mean 'aqua2'?")


def test_robot_above_the_surface(tmp_path):
    """0.5 m deep, heaving by 0.6 m: for some phase of the sine it comes out."""
    text = GOOD.replace("depth_m = 5.0", "depth_m = 0.5").replace("duration_s = 2.0", "duration_s = 20.0")
    text += "\n[robot.sway]\namplitude_m = [0.0, 0.0, 0.6]\n"
    assert any(problem.place == "robot" and "surface" in problem.expected for problem in problems(text, tmp_path))


def test_no_toml_and_no_such_dive(tmp_path):
    (problem,) = problems("name = ", tmp_path)
    assert "valid TOML" in problem.expected
    with pytest.raises(FileNotFoundError, match="did you mean 'spiral'"):
        Dive.load("spirale")


def test_files_beside_the_dive_are_found(tmp_path):
    (tmp_path / "mine.toml").write_text(open_preset("aqua2"), encoding="utf-8")
    dive = parse_dive(GOOD.replace('"aqua2"', '"mine.toml"'), source="trial", folder=tmp_path)
    assert dive.rig == str(tmp_path / "mine.toml")


def open_preset(name):
    from rigs import preset_path

    return preset_path(name).read_text(encoding="utf-8")


def test_camera_runs_at_the_dives_frame_rate(tmp_path):
    dive = parse_dive(changed(frame_rate_hz="15.0"), source="trial", folder=tmp_path)
    sensor = dive.load_rig().image_sensor
    assert sensor is not None
    assert sensor.frame_rate_hz == 15.0
    assert dive.frames == 30


def test_detector_overrides_change_only_what_they_name(tmp_path):
    text = GOOD.replace("[robot]", "[detector]\naspect_max = 4.0\n[detector.window]\nhue_to_deg = 40.0\n[robot]")
    dive = parse_dive(text, source="trial", folder=tmp_path)
    settings = dive.detector_settings()
    assert settings.aspect_max == 4.0
    assert settings.window.hue_to_deg == 40.0
    assert settings.window.hue_from_deg == RED_BALL.window.hue_from_deg
    assert overridden(RED_BALL, type(dive.detector)()) == RED_BALL


def test_varied_cuts_and_chooses(tmp_path):
    dive = parse_dive(GOOD, source="trial", folder=tmp_path)
    assert varied(dive, variant="paper", frames=7).frames == 7
    assert varied(dive, frames=1000).frames == dive.frames
    with pytest.raises(ValueError, match="'best': expected one of"):
        varied(dive, variant="best")


def test_an_empty_attitude_section_is_a_sensor_with_the_defaults(tmp_path):
    dive = parse_dive(GOOD + "\n[attitude]\n", source="trial", folder=tmp_path)
    assert dive.attitude == AttitudeSettings(noise_deg=0.05, drift_deg_per_min=0.17, latency_ms=5.0)
    assert parse_dive(dive.as_toml(), source="trial", folder=tmp_path) == dive
    assert parse_dive(GOOD, source="trial", folder=tmp_path).attitude is None


def test_defaults_are_written_out(tmp_path):
    document = tomllib.loads(parse_dive(GOOD, source="trial", folder=tmp_path).as_toml())
    assert document["video"] == "ffv1"
    assert document["robot"]["sway"]["period_s"] == [8.0, 8.0, 8.0]


FILES = GOOD.replace(
    """shape = "straight"
start_m = [2.0, 0.5, 0.0]
velocity_m_per_s = [0.0, 0.1, 0.0]
""",
    """shape = "file"
file = "target.csv"
""",
)


def test_a_path_file_is_found_beside_the_dive_and_is_part_of_it(tmp_path):
    from dives.runner import identity_of

    (tmp_path / "target.csv").write_text("time_s,x_m,y_m,z_m\n0,2,0,0\n5,2,1,0\n", encoding="utf-8")
    dive = parse_dive(FILES, source="trial", folder=tmp_path)
    assert dive.target.path.file == str(tmp_path / "target.csv")
    before = identity_of(dive, dive.load_rig())
    (tmp_path / "target.csv").write_text("time_s,x_m,y_m,z_m\n0,2,0,0\n5,2,2,0\n", encoding="utf-8")
    assert identity_of(dive, dive.load_rig()) != before


def test_the_light_is_part_of_a_dive_unless_it_is_full(small_dive):
    """So that what was dived before it could be chosen stays finished."""
    from dives.runner import identity_of

    rig = small_dive.load_rig()
    full, draft = (identity_of(small_dive, rig, light) for light in (LightQuality.full(), LightQuality.draft()))
    assert identity_of(small_dive, rig) == full != draft


@pytest.mark.parametrize(
    ("rows", "more", "place", "expected"),
    [
        ("0,2,0,0\n5,2,no,0\n", "", "target.path.file target.csv, line 3, y_m", "a finite number"),
        ("0,2,0,0\n5,2,1,0\n", "start_s = 5.0", "target.path.start_s", "from 0 s on and before 5 s"),
        ("0,2,0,0\n5,2,1,0\n", 'frame = "map"', "target.path.frame", "[robot] has none"),
        ("0,2,0,0\n1,-2,0,0\n", "", "target.path", "keeps off the hull"),
    ],
)
def test_what_is_wrong_with_a_path_file(rows, more, place, expected, tmp_path):
    (tmp_path / "target.csv").write_text("time_s,x_m,y_m,z_m\n" + rows, encoding="utf-8")
    (problem,) = problems(f"{FILES}{more}\n", tmp_path)
    assert problem.place == place
    assert expected in problem.expected


DECOY = '\n[[decoys]]\ndiameter_m = 0.3\ncolour = "blue"\nposition_m = [1.5, 0.0, 0.0]\n'


def test_decoys_have_size_colour_and_place(tmp_path):
    dive = parse_dive(GOOD + DECOY, source="trial", folder=tmp_path)
    (decoy,) = dive.decoys
    ball = decoy.load_shape()
    assert (ball.radius_m, ball.material.name) == (0.15, "PRINT_BLUE")
    assert parse_dive(dive.as_toml(), source="trial", folder=tmp_path) == dive


@pytest.mark.parametrize(
    ("before", "after", "place", "expected"),
    [
        ('"blue"', '"pink"', "decoys[0].colour", "'red'"),
        ("position_m", "place_m", "decoys[0].place_m", "known key"),
        ("[1.5, 0.0, 0.0]", "[1.5, 0.0, 4.9]", "decoys[0]", "below the surface"),
        ("[1.5, 0.0, 0.0]", "[0.4, 0.0, 0.0]", "decoys[0]", "keeps off the hull"),
        ('colour = "blue"', 'shape = "fish"', "decoys[0].shape", "for a ball only"),
    ],
)
def test_what_is_wrong_with_a_decoy(before, after, place, expected, tmp_path):
    found = {problem.place: problem for problem in problems(GOOD + DECOY.replace(before, after), tmp_path)}
    assert expected in found[place].expected


def test_keys_can_be_given_other_values():
    from dives.dive import loaded_with

    dive = loaded_with("spiral", {"world": "blue", "target.start.azimuth_deg": 52.0})
    assert (dive.world, dive.target.start.azimuth_deg) == ("blue", 52.0)
    with pytest.raises(DiveError, match=r"target\.start\.azimuth = 52.0: expected a known key"):
        loaded_with("spiral", {"target.start.azimuth": 52.0})


def test_a_learned_detector_lies_beside_the_dive_and_is_read_with_it(tmp_path):
    text = GOOD + '\n[detector]\nonnx = "ball.onnx"\n'
    (problem,) = problems(text, tmp_path)
    assert problem.place == "detector"
    assert problem.expected == "a model of ONNX, got no file ball.onnx"
    (tmp_path / "ball.onnx").write_bytes(b"not a model")
    (problem,) = problems(text, tmp_path)
    assert "a model of ONNX in" in problem.expected
