"""What a key of a data set's file may be, and what is drawn then."""

import numpy as np
import pytest
from pydantic import ValidationError
from scipy import stats

from dives.datasets.distributions import Drawn
from dives.datasets.specification import ThingDraws

COUNT = 4000
UNLIKELY = 1e-4
"""A right generator is refused so rarely; the seed is fixed, so that it is now."""


def drawn(value):
    rng = np.random.default_rng(3)
    distribution = Drawn().read(value)
    return np.array([distribution.draw(rng) for _ in range(COUNT)])


def test_one_number_is_itself():
    assert set(drawn(2.5)) == {2.5}


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("-60..60", stats.uniform(-60, 120)),
        ({"low": 1.0, "high": 3.0}, stats.uniform(1, 2)),
        ({"low": 0.5, "high": 8.0, "log": True}, stats.loguniform(0.5, 8)),
        ({"mean": 1.0, "deviation": 2.0, "low": 0.0, "high": 4.0}, stats.truncnorm(-0.5, 1.5, loc=1, scale=2)),
    ],
    ids=["range", "table", "log", "normal"],
)
def test_numbers_are_spread_as_said(value, expected):
    assert stats.kstest(drawn(value), expected.cdf).pvalue > UNLIKELY


def test_weights_say_how_often():
    values = drawn({"values": [1.0, 2.0, 5.0], "weights": [1, 0, 3]})
    assert set(values) == {1.0, 5.0}
    assert stats.binomtest(int((values == 5).sum()), COUNT, 0.75).pvalue > UNLIKELY


def test_a_list_is_an_axis_of_the_grid():
    assert Drawn().read([0.0, 5.0]).grid == (0.0, 5.0)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("near", "a range"),
        ("1..x", "a range"),
        ("5..1", "low < high"),
        ([], "a list of numbers"),
        ([1.0, 1.0], "different"),
        (True, "a number"),
        ({"low": 0.0, "high": 1.0, "log": True}, "low > 0"),
        ({"mean": 9.0, "deviation": 1.0, "low": 0.0, "high": 1.0}, "mean"),
        ({"mean": 0.5, "deviation": -1.0, "low": 0.0, "high": 1.0}, "deviation"),
        ({"values": [1.0], "weights": [0.0]}, "weight"),
        ({"low": 0.0, "high": 1.0, "lgo": True}, "lgo"),
        ("0..2000", "from 0.05 to 1000"),
        ([0.01], "from 0.05 to 1000"),
    ],
    ids=str,
)
def test_what_is_none_of_them_is_refused(value, words):
    with pytest.raises(ValidationError, match=words):
        ThingDraws(distance_m=value)


def test_the_schema_says_what_may_be_written():
    properties = ThingDraws.model_json_schema()["properties"]
    kinds = {each.get("type", "table") for each in properties["distance_m"]["anyOf"]}
    assert kinds == {"number", "array", "string", "table"}
    assert properties["distance_m"]["default"] == 2.0
