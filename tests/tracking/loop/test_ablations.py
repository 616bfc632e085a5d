"""The default without one of its parts: nothing else differs, and each is a loop that follows."""

from dataclasses import fields, replace

import pytest

from tests.tracking.loop.test_loop import WAIT_S, Dive, open_spiral
from tracking.loop.ablations import ABLATIONS, LOOPS
from tracking.loop.variants import VARIANTS


def values(loop):
    """Of the loop and, one by one, of its behaviour."""
    of = {field.name: getattr(loop, field.name) for field in fields(loop)}
    behaviour = of.pop("behaviour")
    return of | {field.name: getattr(behaviour, field.name) for field in fields(behaviour)}


@pytest.mark.parametrize("name", ABLATIONS)
def test_one_part_is_taken_away(name):
    default, paper, found = values(VARIANTS["default"]), values(VARIANTS["paper"]), values(ABLATIONS[name])
    assert found["name"] == name
    changed = {key for key in found if found[key] != default[key]} - {"name"}
    assert changed
    assert all(found[key] == paper[key] for key in changed)


def test_every_part_of_the_default_is_taken_away_once():
    """But for the functional check, which the arena's dives leave out, and for how long a target is predicted."""
    default, paper = values(VARIANTS["default"]), values(VARIANTS["paper"])
    parts = {key for key in default if default[key] != paper[key]} - {"name", "check_s", "predict_frames"}
    taken = {key for each in ABLATIONS.values() for key, value in values(each).items() if value != default[key]}
    assert taken - {"name"} == parts


def test_names_say_what_is_missing_and_are_told_apart():
    assert "default-without-contrast" in ABLATIONS
    assert len(LOOPS) == len(VARIANTS) + len(ABLATIONS)


@pytest.mark.parametrize("name", ABLATIONS)
def test_each_follows_a_target(name):
    """With the raster that the path's start is made for: the target is found within `WAIT_S`."""
    dive = Dive(replace(ABLATIONS[name].without_check(), likely_first=False)).run(open_spiral, WAIT_S + 2.0)
    assert set(dive.modes(WAIT_S + 1.0)) == {"t"}
