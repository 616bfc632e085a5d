"""A data set made by workers: the same bytes as by one process, and a sample that kills them costs itself alone.

The rig has no mirrors and the water nothing in it, so that nothing is lit.
"""

import json

import pytest

from dives.datasets import pieces, run
from dives.datasets.dataset import parse_dataset
from dives.datasets.run import make_dataset
from optics.workers.run import SET_ASIDE, Ended, Failure
from tests.dives.datasets.conftest import files_of

BENCH = """
name = "bench"
samples = 8
seed = 2
[scene]
rig = "bench"
world = "blue"
depth_m = 4.0
[target]
colour = ["red", "yellow"]
azimuth_deg = "-10..10"
[image]
width_px = 64
height_px = 48
"""


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    return parse_dataset(BENCH, source="bench", folder=tmp_path_factory.mktemp("bench"))


@pytest.fixture(scope="module")
def alone(bench, tmp_path_factory):
    """Files of the set made by this process."""
    folder = tmp_path_factory.mktemp("alone") / "set"
    make_dataset(bench, folder)
    return files_of(folder)


def test_two_workers_make_the_same_bytes(bench, alone, tmp_path):
    told = []
    made = make_dataset(bench, tmp_path / "set", workers=2, progress=lambda done, of: told.append((done, of)))
    assert made.is_whole and made.broken == {}
    assert files_of(tmp_path / "set") == alone
    assert told == [(0, 8), (4, 8), (8, 8)]


class Deadly:
    """Stands in for workers: what holds one sample kills them before it is written."""

    def __init__(self, poison):
        self.poison = poison

    def __call__(self, *, workers, scheduler):
        return self

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def run(self, function, jobs):
        for name, (*arguments, scene, indices) in jobs.items():
            before = indices[: indices.index(self.poison)] if self.poison in indices else indices
            if before:
                function(*arguments, scene, before)
            failure = None if before == indices else Failure(sentence=SET_ASIDE, trace="")
            yield Ended(name=name, value=None, failure=failure)


def test_a_sample_that_kills_workers_costs_itself_alone(bench, alone, tmp_path, monkeypatch):
    folder, told = tmp_path / "set", []
    poison = pieces.pieces(bench)[0].indices[1]
    monkeypatch.setattr(run, "open_workers", Deadly(poison))
    made = make_dataset(bench, folder, workers=2, progress=lambda done, of: told.append((done, of)))
    assert (made.done, made.files) == (7, ())
    assert made.broken == {f"scene 0, sample {poison}": SET_ASIDE}
    assert told[-1] == (7, 8)
    monkeypatch.undo()
    assert make_dataset(bench, folder).is_whole
    assert files_of(folder) == alone


def test_a_sample_that_raises_is_named_after_the_others(bench, alone, tmp_path, monkeypatch):
    folder, real = tmp_path / "set", pieces.rendered

    def rendered(scene, sample):
        if sample.index == 3:
            raise ZeroDivisionError("nobody foresaw it")
        return real(scene, sample)

    monkeypatch.setattr(pieces, "rendered", rendered)
    made = make_dataset(bench, folder)
    (sentence,) = made.broken.values()
    assert (made.done, sentence) == (7, "sample 3: ZeroDivisionError: nobody foresaw it")
    monkeypatch.undo()
    make_dataset(bench, folder)
    assert files_of(folder) == alone
    assert json.loads(files_of(folder)["manifest.json"])["samples"] == 8
