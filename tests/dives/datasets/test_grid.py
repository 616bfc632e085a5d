"""The grid of a data set: every combination equally often, each sample by its number alone."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from dives.datasets.dataset import DatasetError, parse_dataset
from dives.datasets.pieces import SAMPLES_A_PIECE, pieces
from optics.workers.shards import Shard

LISTS = """
name = "lists"
samples = {samples}
seed = {seed}
[scene]
rig = "aqua2"
depth_m = [3, 6, 9]
cloud = [0, 1]
[joints]
q1_deg = [-30, 0, 30, 60]
"""


def dataset(samples=1000, seed=0):
    return parse_dataset(LISTS.format(samples=samples, seed=seed), source="lists", folder=Path("/"))


def test_every_combination_comes_once_in_each_round():
    grid = dataset().grid
    points = [(*grid.scene(int(grid.scene_of(i))).values(), *grid.listed(i).values()) for i in range(24, 48)]
    assert grid.points == 24
    assert set(Counter(points).values()) == {1}
    assert len(points) == len(set(points)) == 24


def test_the_seed_shuffles_the_grid_and_more_samples_change_nothing():
    few, many, other = dataset(10).grid, dataset(1000).grid, dataset(10, seed=1).grid
    numbers = np.arange(10)
    assert few.scene_of(numbers).tolist() == many.scene_of(numbers).tolist() != other.scene_of(numbers).tolist()


def test_pieces_are_of_one_scene_and_hold_each_sample_once():
    whole = dataset()
    found = pieces(whole)
    assert sorted(index for piece in found for index in piece.indices) == list(range(1000))
    for piece in found:
        assert set(whole.grid.scene_of(list(piece.indices)).tolist()) == {piece.scene}
        assert len(piece.indices) <= SAMPLES_A_PIECE


@pytest.mark.parametrize("of", [1, 3, 100])
def test_shards_are_the_pieces_in_turn(of):
    whole = dataset()
    parts = [pieces(whole, Shard(number, of)) for number in range(1, of + 1)]
    assert [piece for part in parts for piece in part] == pieces(whole)


def test_a_grid_that_nobody_counts_is_refused():
    values = list(range(1001))
    text = LISTS.format(samples=1, seed=0).replace("[3, 6, 9]", "3").replace("[-30, 0, 30, 60]", "0")
    text = text.replace("cloud", f"world_seed = {values}\nwind = {{ azimuth_deg = {values} }}\ncloud")
    with pytest.raises(DatasetError, match="2,004,002"):
        parse_dataset(text, source="lists", folder=Path("/"))
