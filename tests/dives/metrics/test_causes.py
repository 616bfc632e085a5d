"""Why a target was not found: each cause where it must be the answer, and what goes before what."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dives.metrics.causes import Cause, blown_and_dark, cause_of_loss

SEEN = {
    "found": False,
    "full_px": 100.0,
    "hull_px": 0,
    "mount_px": 0,
    "world_px": 0,
    "visible_px": 100,
    "smallest_px": 10.0,
}


@pytest.mark.parametrize(
    ("case", "cause"),
    [
        ({"found": True, "visible_px": 0}, Cause.NONE),
        ({"visible_px": 0}, Cause.NOT_IN_VIEW),
        ({"visible_px": 0, "full_px": np.nan}, Cause.NOT_IN_VIEW),
        ({"visible_px": 0, "at_speed_limit": True}, Cause.SLEWING),
        ({"visible_px": 0, "hull_px": 60, "at_speed_limit": True}, Cause.HIDDEN_BY_HULL),
        ({"visible_px": 9, "hull_px": 20, "mount_px": 60}, Cause.HIDDEN_BY_MOUNT),
        ({"visible_px": 5, "hull_px": 20, "world_px": 60}, Cause.HIDDEN_BY_WORLD),
        # 9 seen, 20 behind the hull, 30 behind the mount: 41 are outside.
        ({"visible_px": 9, "hull_px": 20, "mount_px": 30}, Cause.NOT_IN_VIEW),
        ({"full_px": 9.9, "visible_px": 9}, Cause.TOO_SMALL),
        # A small target, most of it seen, but not enough.
        ({"full_px": 12.0, "visible_px": 8}, Cause.TOO_SMALL),
        # A disc of 100 px is 11.28 px wide.
        ({"smear_px": 11.3}, Cause.SLEWING),
        ({"smear_px": 11.2}, Cause.COLOUR),
        ({"saturated_share": 0.6, "dark_share": 0.1}, Cause.SATURATED),
        ({"saturated_share": 0.1, "dark_share": 0.6}, Cause.TOO_DARK),
        ({"saturated_share": np.nan, "dark_share": np.nan}, Cause.COLOUR),
        ({}, Cause.COLOUR),
    ],
)
def test_each_cause(case, cause):
    assert cause_of_loss(**(SEEN | case)) is cause


@given(
    full_px=st.floats(0, 1e4),
    shares=st.tuples(*[st.floats(0, 1)] * 4),
    smear_px=st.floats(0, 100),
    image=st.tuples(st.floats(0, 1), st.floats(0, 1)),
    at_speed_limit=st.booleans(),
)
def test_what_is_not_found_has_a_cause(full_px, shares, smear_px, image, at_speed_limit):
    whole = max(sum(shares), 1.0)
    hull_px, mount_px, world_px, visible_px = (full_px * share / whole for share in shares)
    cause = cause_of_loss(
        found=False,
        full_px=full_px,
        hull_px=hull_px,
        mount_px=mount_px,
        world_px=world_px,
        visible_px=visible_px,
        smallest_px=10.0,
        at_speed_limit=at_speed_limit,
        smear_px=smear_px,
        saturated_share=image[0],
        dark_share=image[1],
    )
    assert cause is not Cause.NONE
    lost_on_the_way = cause in {
        Cause.NOT_IN_VIEW,
        Cause.HIDDEN_BY_WORLD,
        Cause.HIDDEN_BY_HULL,
        Cause.HIDDEN_BY_MOUNT,
        Cause.TOO_SMALL,
    }
    assert lost_on_the_way or cause is Cause.SLEWING or visible_px >= 10.0
    assert not lost_on_the_way or visible_px < 10.0


def test_the_names_are_those_of_the_log():
    assert {str(cause) for cause in Cause} == {
        "",
        "not in view",
        "hidden by hull",
        "hidden by mount",
        "hidden by world",
        "too dark",
        "saturated",
        "colour",
        "too small",
        "slewing",
    }


def test_blown_and_dark_pixels_are_counted():
    pixels = np.array(
        [[255, 255, 200], [255, 30, 20], [255, 255, 255], [39, 10, 10], [40, 10, 10]],
        dtype=np.uint8,
    )
    # The first and third have two channels at 255, one with red alone keeps its hue; only 39 is below 40.
    assert blown_and_dark(pixels, value_min=40) == (2 / 5, 1 / 5)


def test_no_pixels_have_no_shares():
    assert np.isnan(blown_and_dark(np.empty((0, 3), dtype=np.uint8), value_min=40)).all()
