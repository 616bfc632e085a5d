"""The reachable directions: closed forms by hand, counting on a sphere, and the inverse as the judge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optics.gaze import inverse_gaze
from optics.layout import Layout
from optics.workspace import reached, workspace_fraction
from rigs import Joint, Rig

AQUA2 = Rig.load("aqua2")
LAYOUT = Layout.from_rig(AQUA2)

DIRECTIONS = 40_000

ROUNDING = 1e-12


def fibonacci(count):
    """Points of equal area each, on a spiral (Swinbank & Purser 2006, Q. J. R. Meteorol. Soc. 132, 1769)."""
    index = np.arange(count) + 0.5
    z = 1 - 2 * index / count
    turn = np.pi * (1 + np.sqrt(5)) * index
    return np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)


def limits(pan, tilt, **changes):
    return replace(
        LAYOUT,
        pan=Joint(min_deg=pan[0], max_deg=pan[1], **changes),
        tilt=Joint(min_deg=tilt[0], max_deg=tilt[1], **changes),
    )


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
    assert workspace_fraction(limits(pan, tilt)) == pytest.approx(expected, abs=ROUNDING)


@st.composite
def ranges(draw):
    lowest = draw(st.floats(-300, 250))
    return lowest, draw(st.floats(lowest + 1, min(lowest + 400, 359)))


@given(pan=ranges(), tilt=ranges(), offset=st.floats(-90, 90), sign=st.sampled_from([1, -1]))
def test_the_closed_form_agrees_with_counting(pan, tilt, offset, sign):
    """The boundary crosses some cells of the spiral: at most its length times their width, of a few thousand."""
    layout = limits(pan, tilt, offset_deg=offset, sign=sign)
    share = reached(layout, fibonacci(DIRECTIONS)).mean()
    # Four meridians and four parallels of up to 2 pi, cells of sqrt(4 pi / n), half of them right by chance.
    assert workspace_fraction(layout) == pytest.approx(share, abs=0.01)


@given(pan=ranges(), tilt=ranges(), azimuth=st.floats(-3.1, 3.1), elevation=st.floats(-1.5, 1.5))
def test_what_is_reached_is_what_has_an_inverse(pan, tilt, azimuth, elevation):
    layout = limits(pan, tilt)
    direction = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    # At a limit rounding decides; a thousandth of a degree inside and outside must agree with themselves.
    narrow, wide = (limits((pan[0] + way, pan[1] - way), (tilt[0] + way, tilt[1] - way)) for way in (1e-3, -1e-3))
    if len(inverse_gaze(narrow, azimuth, elevation)):
        assert reached(layout, [direction])[0]
    if not len(inverse_gaze(wide, azimuth, elevation)):
        assert not reached(layout, [direction])[0]


def test_the_attitude_of_the_camera_turns_the_workspace_but_not_its_size():
    camera = AQUA2.camera.model_copy(update={"yaw_deg": 25.0, "pitch_deg": -15.0, "roll_deg": 40.0})
    turned = Layout.from_rig(AQUA2.model_copy(update={"camera": camera}))
    assert workspace_fraction(turned) == pytest.approx(workspace_fraction(LAYOUT), abs=ROUNDING)
    share = reached(turned, fibonacci(DIRECTIONS)).mean()
    assert share == pytest.approx(workspace_fraction(LAYOUT), abs=2e-3)
