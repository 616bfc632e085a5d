"""The gaze's workspace, figure 7 of the paper: the share of the sphere that the joints reach, by hand and counted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from optics.gaze.kinematics import inverse_gaze
from optics.layout import Layout
from rigs import Joint, Rig

AQUA2 = Rig.load("aqua2")
LAYOUT = Layout.from_rig(AQUA2)

DIRECTIONS = 2_000

BOUNDARY = 0.02
"""The boundary crosses cells of the spiral: its length times their width, of which half are right by chance."""


def fibonacci(count):
    """Points of equal area each, on a spiral (Swinbank & Purser 2006, Q. J. R. Meteorol. Soc. 132, 1769)."""
    index = np.arange(count) + 0.5
    z = 1 - 2 * index / count
    turn = np.pi * (1 + np.sqrt(5)) * index
    return np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)


def share_reached(layout):
    x, y, z = fibonacci(DIRECTIONS).T
    angles = zip(np.arctan2(y, x).tolist(), np.arcsin(z).tolist(), strict=True)
    return np.mean([len(inverse_gaze(layout, *each)) > 0 for each in angles])


@pytest.mark.parametrize(
    ("pan", "tilt", "expected"),
    [
        # The half sphere of figure 7: 180 degrees of pan, elevation 0 to 180 over the zenith.
        ((-90, 90), (0, 90), 1 / 2),
        # A tilt of 180 degrees covers 360 of elevation: everything (section 2.3, "theoretically").
        ((-90, 90), (-45, 135), 1.0),
        # Front only, a quarter.
        ((-90, 90), (0, 45), 1 / 4),
        # A full pan makes the way over the zenith superfluous: a cap above -30 degrees, (1 + sin 30) / 2.
        ((-180, 180), (-15, 45), 3 / 4),
        # The aqua2: 155 degrees on both sides of the zenith, above -65: 310/360 (1 + sin 65) / 2.
        ((-77.5, 77.5), (-32.5, 122.5), 310 / 360 * (1 + np.sin(np.radians(65))) / 2),
    ],
)
def test_the_share_of_the_sphere_by_hand(pan, tilt, expected):
    joints = {"pan": Joint(min_deg=pan[0], max_deg=pan[1]), "tilt": Joint(min_deg=tilt[0], max_deg=tilt[1])}
    assert share_reached(replace(LAYOUT, **joints)) == pytest.approx(expected, abs=BOUNDARY)


def test_the_attitude_of_the_camera_turns_the_workspace_but_not_its_size():
    camera = AQUA2.camera.model_copy(update={"yaw_deg": 25.0, "pitch_deg": -15.0, "roll_deg": 40.0})
    turned = Layout.from_rig(AQUA2.model_copy(update={"camera": camera}))
    assert share_reached(turned) == pytest.approx(share_reached(LAYOUT), abs=BOUNDARY)
