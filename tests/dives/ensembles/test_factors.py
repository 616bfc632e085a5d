"""Effects of factors: closed forms, sums that add up, and least squares as another way to the same."""

from __future__ import annotations

import csv
import io
from itertools import product

import numpy as np
import pytest
from scipy.stats import f_oneway

from dives.ensembles.factors import effects, effects_csv, effects_table, levels_csv
from dives.ensembles.members import Choice, members
from tests.dives.ensembles.test_tables import failed, outcome

WATERS, SIZES = ("IB", "II", "III"), (0.1, 0.2)


def grid(number, seeds=3):
    """Outcomes of waters by sizes by seeds, of which `number(water, size, seed)` is the metric."""
    choices = [Choice(key="jerlov_type", values=WATERS), Choice(key="target.diameter_m", values=SIZES)]
    return [
        outcome(
            member,
            visible_fraction=number(*map(member.settings.get, ("jerlov_type", "target.diameter_m")), member.seed),
        )
        for member in members(choices, seeds=range(seeds))
    ]


def found_of(outcomes):
    return {" x ".join(each.factors): each for each in effects(outcomes, "visible_fraction")}


def test_factors_that_add_have_no_interaction():
    """Of a_i + b_j the sums of squares are those of the parts alone."""
    a, b = {"IB": 0.0, "II": 3.0, "III": 6.0}, {0.1: 0.0, 0.2: 2.0}
    found = found_of(grid(lambda water, size, seed: a[water] + b[size]))
    # Variances 6 and 1.
    assert found["jerlov_type"].share == pytest.approx(6 / 7)
    assert found["target.diameter_m"].share == pytest.approx(1 / 7)
    assert found["jerlov_type x target.diameter_m"].share == pytest.approx(0, abs=1e-12)
    assert [level.interval.estimate for level in found["jerlov_type"].levels] == pytest.approx([1.0, 4.0, 7.0])
    assert all(each.probability is None for each in found.values())  # nothing is left to chance


def test_what_only_both_do_is_their_interaction():
    """1 where exactly one of two is raised: neither size nor its absence does anything by itself."""
    found = found_of(grid(lambda water, size, seed: float((water == "IB") != (size == 0.1)) * (water != "III")))
    assert found["target.diameter_m"].share == pytest.approx(0, abs=1e-12)
    cells = found["jerlov_type x target.diameter_m"].levels
    assert [level.interval.estimate for level in cells] == [0, 1, 1, 0, 0, 0]
    assert sum(each.share for each in found.values()) == pytest.approx(1)


def test_shares_and_probabilities_are_those_of_least_squares():
    """Sums of squares as what each group of columns explains beyond those before it, which are orthogonal here."""
    rng = np.random.default_rng(3)
    noise = {cell: rng.normal() for cell in product(WATERS, SIZES, range(4))}
    numbers = {cell: value + (cell[0] == "III") + 2 * (cell[1] == 0.2) for cell, value in noise.items()}
    found = found_of(grid(lambda *cell: numbers[cell], seeds=4))
    y = np.array(list(numbers.values()))
    water = np.array([[cell[0] == name for name in WATERS] for cell in numbers], dtype=float)
    size = np.array([[cell[1] == value for value in SIZES] for cell in numbers], dtype=float)
    both = (water[:, :, None] * size[:, None, :]).reshape(len(y), -1)

    def left(*columns):
        matrix = np.column_stack([np.ones(len(y)), *columns])
        return float(((y - matrix @ np.linalg.lstsq(matrix, y, rcond=None)[0]) ** 2).sum())

    whole = left()
    explained = [left() - left(water), left(water) - left(water, size), left(water, size) - left(water, size, both)]
    assert [each.share for each in found.values()] == pytest.approx([value / whole for value in explained])
    # Beside another code, where it has the same question: one factor alone.
    alone = [
        outcome(m, visible_fraction=float(k))
        for k, m in enumerate(members([Choice(key="variant", values=("default", "paper"))], seeds=range(4)))
    ]
    (effect,) = effects(alone, "visible_fraction")
    assert effect.probability == pytest.approx(f_oneway(range(4), range(4, 8)).pvalue)


def test_a_dive_that_failed_leaves_means_and_no_shares():
    outcomes = grid(lambda water, size, seed: 1.0 + seed)
    outcomes[0] = failed(outcomes[0].member)
    found = found_of(outcomes)
    assert found["jerlov_type"].share is None
    assert found["jerlov_type"].levels[0].interval.count == 5
    assert effects_table(list(found.values()))[1] == ["jerlov_type", "-"]


def test_what_three_do_together_is_left():
    """1 where an odd number of three is raised."""
    keys = ("cloud", "depth_m", "sun.elevation_deg")
    chosen = members([Choice(key=key, values=(0, 1)) for key in keys], seeds=range(2))
    odd = [outcome(member, visible_fraction=float(sum(member.settings.values()) % 2)) for member in chosen]
    assert [each.share for each in effects(odd, "visible_fraction")] == pytest.approx([0] * 6, abs=1e-12)


def test_tables_hold_it():
    a = {"IB": 0.0, "II": 3.0, "III": 6.0}
    found = effects(grid(lambda water, size, seed: a[water] + 0.1 * seed), "visible_fraction")
    rows = list(csv.DictReader(io.StringIO(effects_csv(found))))
    assert [row["effect"] for row in rows] == ["jerlov_type", "target.diameter_m", "jerlov_type x target.diameter_m"]
    assert float(rows[0]["probability"]) < 1e-9
    levels = list(csv.DictReader(io.StringIO(levels_csv(found))))
    assert levels[-1]["level"] == "III x 0.2"
    assert len(levels) == 3 + 2 + 6
    assert effects_table(found)[1][1] == "100 % *"
