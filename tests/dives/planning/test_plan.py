"""A dive's plan against paths whose rates and gaps are known."""

from __future__ import annotations

import numpy as np
import pytest

from dives.dive import parse_dive
from dives.planning.plan import STEP_S, plan_dive
from optics.layout import Layout
from rigs import Rig

RIG = Rig.load("aqua2")
EYE_M = Layout.from_rig(RIG).body_from_gimbal.translation

CIRCLE = """
name = "round"
rig = "aqua2"
world = "blue"
depth_m = 5.0
duration_s = {duration_s}

[robot]
motion = "hover"

[target.path]
shape = "circle"
centre_m = [{x}, {y}, {z}]
radius_m = 2.0
start_bearing_deg = -40.0
turning_deg_per_s = {rate}
"""


def planned(tmp_path, rate, duration_s, more=""):
    """A target that goes round the gaze mirror, level; mirrors alone, without hull and mount."""
    x, y, z = EYE_M
    text = CIRCLE.format(x=x, y=y, z=z, rate=rate, duration_s=duration_s) + more
    return plan_dive(parse_dive(text, source="round", folder=tmp_path), RIG, [])


@pytest.mark.parametrize(("rate", "kept_up"), [(50.0, True), (70.0, False)])
def test_a_circle_about_the_mirror_has_the_circles_rate(tmp_path, rate, kept_up):
    """aqua2's servos turn at 60 degrees/s."""
    plan = planned(tmp_path, rate, 1.0)
    np.testing.assert_allclose(plan.rate_deg_per_s[1:-1], rate, rtol=2e-3)
    np.testing.assert_allclose(plan.availability.distance_m, 2.0, atol=1e-9)
    assert plan.within_speeds[1:-1].all() == kept_up
    assert plan.numbers()["within_speeds_fraction"] == pytest.approx(1.0 if kept_up else 0.0, abs=0.11)


def test_a_gap_says_when_and_why(tmp_path):
    """A ball of 0.5 m stands 1 m ahead of the mirror; the target passes behind it at 20 degrees/s after 2 s."""
    x, y, z = EYE_M
    decoy = f"""
[[decoys]]
diameter_m = 0.5
position_m = [{x + 1.0}, {y}, {z}]
"""
    plan = planned(tmp_path, 20.0, 4.0, decoy)
    gap = next(gap for gap in plan.gaps if gap.reason == "a decoy hides it")
    half_s = np.degrees(np.arcsin(0.25)) / 20.0
    assert (gap.from_s, gap.to_s) == pytest.approx((2.0 - half_s, 2.0 + half_s), abs=2 * STEP_S)
    numbers = plan.numbers()
    assert numbers["behind_decoy_fraction"] == pytest.approx(2 * half_s / 4.0, abs=0.02)
    fractions = ("available", "not_shown", "behind_world", "behind_decoy")
    assert sum(numbers[f"{name}_fraction"] for name in fractions) == pytest.approx(1.0)
