"""Which dives an ensemble holds: combinations, random points, names, and what is refused."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dives.ensembles.members import Choice, Member, Range, folder_name, members, parsed_setting, parsed_variation
from rigs.documents.changes import with_values


def test_every_choice_meets_every_other_and_every_seed():
    found = members(
        [Choice(key="variant", values=("default", "paper")), Choice(key="depth_m", values=(2.0, 5.0, 9.0))],
        seeds=[0, 7],
    )
    assert len(found) == 2 * 3 * 2
    assert len({member.name for member in found}) == 12
    assert found[0] == Member(settings={"variant": "default", "depth_m": 2.0}, seed=0)
    assert [member.seed for member in found[:4]] == [0, 7, 0, 7]
    assert found[0].name == "variant=default,depth_m=2.0,seed=0"


def test_an_ensemble_of_seeds_alone():
    assert [member.name for member in members([], seeds=range(3))] == ["seed=0", "seed=1", "seed=2"]


def test_random_points_fill_their_ranges_evenly():
    """A Latin hypercube of n points has one in each n-th of each range."""
    spans = [Range(key="a", low=-1, high=1), Range(key="b.c", low=10, high=30)]
    found = members(spans, seeds=[0], points=20, points_seed=4)
    for span in spans:
        values = np.sort([member.settings[span.key] for member in found])
        shares = (values - span.low) / (span.high - span.low)
        assert (np.floor(shares * 20) == np.arange(20)).all()
    assert found == members(spans, seeds=[0], points=20, points_seed=4)
    assert found != members(spans, seeds=[0], points=20, points_seed=5)


def test_points_are_the_same_for_all_choices():
    """Otherwise choices could not be compared pair by pair."""
    found = members([Choice(key="variant", values=("a", "b")), Range(key="x", low=0, high=1)], seeds=[0], points=3)
    assert [member.settings["x"] for member in found[:3]] == [member.settings["x"] for member in found[3:]]


@pytest.mark.parametrize(
    ("text", "variation"),
    [
        ("variant=default,paper", Choice(key="variant", values=("default", "paper"))),
        ("depth_m = 2, 5.5", Choice(key="depth_m", values=(2, 5.5))),
        ("snow=true,false", Choice(key="snow", values=(True, False))),
        ("world=reef", Choice(key="world", values=("reef",))),
        (
            "target.path.velocity_m_per_s=[1, 0, 0],[0, 1, 0]",
            Choice(key="target.path.velocity_m_per_s", values=([1, 0, 0], [0, 1, 0])),
        ),
        ("a.b=1e-3..2", Range(key="a.b", low=1e-3, high=2)),
        ("a=-0.5..0.5", Range(key="a", low=-0.5, high=0.5)),
        ("jerlov_type=I,IB,3C", Choice(key="jerlov_type", values=("I", "IB", "3C"))),
    ],
)
def test_variations_are_read(text, variation):
    assert parsed_variation(text) == variation


@pytest.mark.parametrize("text", ["variant", "=1", "a=", " = "])
def test_what_is_no_variation_is_refused(text):
    with pytest.raises(ValueError, match="expected KEY=VALUE"):
        parsed_variation(text)


def test_a_range_needs_numbers():
    with pytest.raises(ValueError, match="a: expected numbers on both sides"):
        parsed_variation("a=b..c")


def test_settings_reach_into_tables():
    base = tomllib.loads("depth_m = 3\n[target]\nshape = 'ball'\n[target.path]\nshape = 'circle'")
    changed = with_values(base, {"target.path.radius_m": 2.0, "sun.elevation_deg": 40, "depth_m": 4})
    assert changed == {
        "depth_m": 4,
        "target": {"shape": "ball", "path": {"shape": "circle", "radius_m": 2.0}},
        "sun": {"elevation_deg": 40},
    }
    assert base["depth_m"] == 3


def test_a_key_through_a_number_is_refused():
    with pytest.raises(ValueError, match=r"depth_m\.x: expected a table at 'depth_m', got 3"):
        with_values({"depth_m": 3}, {"depth_m.x": 1})


def test_every_problem_of_an_ensemble_at_once():
    variations = [
        Choice(key="a", values=(1, 1)),
        Choice(key="seed", values=(1,)),
        Range(key="b", low=2, high=1),
        Range(key="b", low=0, high=np.inf),
    ]
    with pytest.raises(ValueError, match="b: expected one variation of a key, got 2") as error:
        members(variations, seeds=[3, 3])
    for part in (
        "a: expected one or more different",
        "seed: expected the seeds by",
        "got 2..1",
        "got 2 ranges and 0 points",
        "[3, 3]",
    ):
        assert part in str(error.value)


@pytest.mark.parametrize("seeds", [[], [-1], [2, 2]])
def test_seeds_are_different_and_not_negative(seeds):
    with pytest.raises(ValueError, match="different seeds, none negative"):
        members([], seeds=seeds)


@given(
    st.dictionaries(
        st.text(min_size=1, max_size=20),
        st.one_of(st.text(max_size=200), st.floats(allow_nan=False), st.booleans()),
        max_size=4,
    ),
    st.dictionaries(st.text(min_size=1, max_size=20), st.one_of(st.text(max_size=200), st.integers()), max_size=4),
)
def test_names_are_folders_and_tell_settings_apart(settings, others):
    name = folder_name(settings)
    assert len(name.encode()) < 255
    assert "/" not in name and "\0" not in name and name not in {".", ".."}
    assert folder_name({"a": "1", "b": "2"}) != folder_name({"a": "1,b=2"})
    assert (folder_name(others) == name) == (
        {k: str(v) for k, v in others.items()} == {k: str(v) for k, v in settings.items()}
    )


def test_one_value_of_a_key_is_read_alone():
    assert parsed_setting("target.start.azimuth_deg=52") == ("target.start.azimuth_deg", 52)
    for several in ("depth_m=3,4", "depth_m=3..4"):
        with pytest.raises(ValueError, match=f"{several}: expected one value"):
            parsed_setting(several)
