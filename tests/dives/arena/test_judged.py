"""What a loop made of a dive: when the target could be seen, and what was followed instead."""

import numpy as np
import pyarrow as pa
import pytest

from dives.arena.judged import (
    COVERED_VERSION,
    NSIDE,
    covered_cells,
    crosses_ball,
    followed_thing,
    is_available,
    longest_s,
)
from dives.dive import parse_dive
from dives.metrics.frames import FLAGS, NUMBERS, TEXT, Frames
from optics.coverage.sphere import cell_directions
from optics.layout import Layout
from rigs import Rig

FRAMES = 60
RIG = Rig.load("aqua2")

DIVE = """
name = "trial"
rig = "aqua2"
world = "blue"
depth_m = 5.0
duration_s = 2.0

[robot]
motion = "hover"

[target.path]
shape = "straight"
start_m = [2.0, 0.0, 0.0]
velocity_m_per_s = [0.0, 0.0, 0.0]
"""


def frames(**columns):
    """A log of 2 s in which the target is seen ahead and tracked, but for what a test says otherwise."""
    data = {name: np.zeros(FRAMES) for name in NUMBERS} | {"time_s": np.arange(FRAMES) / 30}
    data |= {"detector_both_px": np.full(FRAMES, 40.0), "target_visible_px": np.full(FRAMES, 50.0)}
    data |= {name: [""] * FRAMES for name in TEXT} | {name: [False] * FRAMES for name in FLAGS}
    return Frames.of(pa.table(data | {"mode": ["track"] * FRAMES, "detected": [True] * FRAMES} | columns))


def dive(tmp_path, more=""):
    return parse_dive(DIVE + more, source="trial", folder=tmp_path)


def test_a_segment_crosses_a_ball_by_its_distance():
    """From (0, 0, 0) to (2, 0, 0): a ball beside it, one behind its end, one half inside."""
    start, end = np.zeros((3, 3)), np.array([[2.0, 0.0, 0.0]] * 3)
    centres = np.array([[1.0, 0.5, 0.0], [2.5, 0.0, 0.0], [1.0, 0.39, 0.0]])
    assert crosses_ball(start, end, centres, 0.4).tolist() == [False, False, True]


def test_what_was_detected_last_is_what_is_followed():
    thing = np.array(["target"] * 20 + ["robot"] * 20 + [""] * 20)
    met = np.where(np.arange(FRAMES) < 20, 40.0, 0.0)
    detected = (np.arange(FRAMES) < 40).tolist()
    found = frames(detector_both_px=met, detected=detected, mode=["track"] * 50 + ["scan"] * 10)
    on = followed_thing(found, thing)
    assert on.tolist() == ["target"] * 20 + ["robot"] * 30 + [""] * 10
    assert longest_s(found, on == "robot") == pytest.approx(1.0)
    assert longest_s(found, on == "decoy") == 0.0


def test_a_target_ahead_is_available_and_one_over_the_zenith_behind_the_hull_is_not(tmp_path):
    """Mirrors alone, without hull and mount: aqua2's gaze does not get steeply down."""
    down = np.where(np.arange(FRAMES) < 30, 0.0, -89.0)
    available = is_available(dive(tmp_path), RIG, [], frames(true_elevation_deg=down))
    assert available.tolist() == [True] * 30 + [False] * 30


def test_a_decoy_before_the_target_hides_it(tmp_path):
    """0.3 m wide, it drifts through the line from the gaze mirror to the target at 1 m/s: hidden for 0.3 s."""
    eye = Layout.from_rig(RIG).body_from_gimbal.translation
    middle = np.mean([eye, [2.0, 0.0, 0.0]], axis=0)
    start = np.subtract(middle, [0.0, 1.0, 0.0]).tolist()
    decoy = f"""
[[decoys]]
diameter_m = 0.3
[decoys.path]
shape = "straight"
start_m = {start}
velocity_m_per_s = [0.0, 1.0, 0.0]
"""
    hidden = ~is_available(dive(tmp_path, decoy), RIG, [], frames())
    assert hidden.sum() / 30 == pytest.approx(0.3, abs=0.05)
    assert hidden[30]


def test_a_wall_before_the_target_hides_it(tmp_path):
    """The tank's wall is 4 m ahead: a target 1 m behind it is hidden, one before it is not."""
    walled = DIVE.replace('"blue"', '"tank"')
    for far_m, available in ((3.0, True), (5.0, False)):
        text = walled.replace("[2.0, 0.0, 0.0]", f"[{far_m}, 2.5, 0.0]")
        trial = parse_dive(text, source="trial", folder=tmp_path)
        assert is_available(trial, RIG, [], frames()).all() == available


def test_recorded(check_recorded):
    """Counts of covered cells by ring of elevation: bare mirrors, without hull and mount."""
    rings = np.bincount(
        np.digitize(cell_directions(NSIDE)[covered_cells(RIG, []), 2], np.linspace(-1, 1, 13)), minlength=14
    )
    check_recorded("covered directions", COVERED_VERSION, rel=1e-3, rings=rings)
