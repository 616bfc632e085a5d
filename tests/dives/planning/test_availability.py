"""When a target can be seen: past hull and mount, world and decoys."""

import numpy as np
import pytest

from dives.dive import parse_dive
from dives.planning.availability import COVERED_VERSION, NSIDE, availability, covered_cells, crosses_ball
from optics.coverage.sphere import cell_directions
from optics.layout import Layout
from rigs import Rig

TIMES_S = np.arange(60) / 30
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


def dive(tmp_path, more=""):
    return parse_dive(DIVE + more, source="trial", folder=tmp_path)


def test_a_segment_crosses_a_ball_by_its_distance():
    """From (0, 0, 0) to (2, 0, 0): a ball beside it, one behind its end, one half inside."""
    start, end = np.zeros((3, 3)), np.array([[2.0, 0.0, 0.0]] * 3)
    centres = np.array([[1.0, 0.5, 0.0], [2.5, 0.0, 0.0], [1.0, 0.39, 0.0]])
    assert crosses_ball(start, end, centres, 0.4).tolist() == [False, False, True]


def test_a_target_ahead_is_available_and_one_below_the_robot_is_not(tmp_path):
    """Mirrors alone, without hull and mount: aqua2's gaze does not get steeply down."""
    sinking = DIVE.replace("[2.0, 0.0, 0.0]", "[0.8, 0.0, 2.0]").replace("[0.0, 0.0, 0.0]", "[0.0, 0.0, -2.2]")
    there = availability(parse_dive(sinking, source="trial", folder=tmp_path), RIG, [], TIMES_S)
    elevation_deg = np.degrees(np.arcsin(there.direction[:, 2]))
    assert there.available[elevation_deg > -50].all()
    assert not there.available[elevation_deg < -76].any()
    assert (elevation_deg < -76).any()


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
    hidden = ~availability(dive(tmp_path, decoy), RIG, [], TIMES_S).available
    assert hidden.sum() / 30 == pytest.approx(0.3, abs=0.05)
    assert hidden[30]


def test_a_wall_before_the_target_hides_it(tmp_path):
    """The tank's wall is 4 m ahead: a target 1 m behind it is hidden, one before it is not."""
    walled = DIVE.replace('"blue"', '"tank"')
    for far_m, available in ((3.0, True), (5.0, False)):
        text = walled.replace("[2.0, 0.0, 0.0]", f"[{far_m}, 2.5, 0.0]")
        trial = parse_dive(text, source="trial", folder=tmp_path)
        assert availability(trial, RIG, [], TIMES_S).available.all() == available


def test_recorded(check_recorded):
    """Counts of covered cells by ring of elevation: bare mirrors, without hull and mount."""
    rings = np.bincount(
        np.digitize(cell_directions(NSIDE)[covered_cells(RIG, []), 2], np.linspace(-1, 1, 13)), minlength=14
    )
    check_recorded("covered directions", COVERED_VERSION, rel=1e-3, rings=rings)
