"""A short attack: damaged rigs, dives, hulls, caches and journals, each drawn by seed.

Rationale: `./run attack` does the same for hours, and kills commands and fills disks besides.

Expected behaviour: each case is refused with a sentence or goes through; nothing is lost, no mistake of ours shows.
"""

from __future__ import annotations

import importlib

import pytest

from benchmarks.attack.builds import SETTLED
from benchmarks.attack.running import drawn
from benchmarks.attack.verdicts import LostError, Tally, judged

CASES = {"rigs": 200, "dives": 12, "hulls": 30, "caches": 300, "journals": 300}
FILL_THE_CACHE = ("caches", "hulls")
SEED = 24


@pytest.fixture
def apart(tmp_path):
    """A folder for the files of an attack."""
    folder = tmp_path / "files"
    folder.mkdir()
    return folder


@pytest.mark.parametrize("name", sorted(CASES))
def test_what_is_damaged_is_refused_with_a_sentence_or_does_no_harm(apart, name, tmp_path, monkeypatch):
    if name in FILL_THE_CACHE:
        monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path / "cache"))
    case = importlib.import_module(f"benchmarks.attack.{name}").prepare(apart)
    tally = Tally(name)
    for number in range(CASES[name]):
        tally.add(str(number), judged(lambda number=number: case(drawn(SEED, name, number))))
    assert tally.tried == CASES[name]
    assert tally.tracebacks == tally.lost == 0, "\n".join(tally.stories)


@pytest.mark.parametrize("kept_bytes", [0, 10_000_000])
def test_mounts_that_stay_in_memory_are_lost(tmp_path, monkeypatch, kept_bytes):
    kept = []
    monkeypatch.setattr("cad.assembly.assembly.build_assembly", lambda rig: kept.append(b"x" * kept_bytes))
    case = importlib.import_module("benchmarks.attack.builds").prepare(tmp_path)
    tally = Tally("builds")
    for number in range(SETTLED + 10):
        tally.add(str(number), judged(lambda number=number: case(drawn(SEED, "builds", number))))
    assert bool(tally.lost) is bool(kept_bytes)


def test_the_same_case_is_the_same_damage():
    assert drawn(1, "rigs", 7).randbytes(32) == drawn(1, "rigs", 7).randbytes(32)
    assert drawn(1, "rigs", 7).randbytes(32) != drawn(1, "rigs", 8).randbytes(32)


@pytest.mark.parametrize(
    ("raised", "outcome"),
    [
        (None, "through"),
        (FileNotFoundError(2, "not there", "x"), "refused"),
        (KeyError("x"), "traceback"),
        (LostError("gone"), "lost"),
    ],
)
def test_what_is_counted_as_what(raised, outcome):
    def case():
        if raised is not None:
            raise raised

    tally = Tally("any")
    tally.add("0", judged(case))
    assert judged(case).outcome == outcome
    assert tally.held == (outcome in ("through", "refused"))
