"""A small search into a folder: front, rig files that can be built, summary; interrupted and repeated."""

from __future__ import annotations

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from cad.assembly.assembly import build_assembly
from cad.checks.assembly_checks import assembly_problems
from optics.feasibility.feasibility import feasibility_problems
from optics.search import search
from optics.search.objectives import OBJECTIVES, design_of
from optics.search.score import Grid
from optics.workers.run import open_workers
from reports.studies.searching import design_search
from reports.studies.searching.design_search import Wanted, apply_design, search_into
from rigs import Rig, RigError, preset_path

SMALL = Grid(pan_steps=7, tilt_steps=9, columns=16, rows=12, nside=8)

WANTED = Wanted(objectives=("coverage", "area", "resolution"), designs=100, seed=1, factor=1.15, count=2)


@pytest.fixture(scope="module", autouse=True)
def coarser():
    """Scores are coarser than users': what is tested here does not depend on it."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(search, "GRID", SMALL)
        patched.setattr(search, "DERIVATIVE_GRID", SMALL)
        patched.setattr(design_search, "GRID", SMALL)
        yield


@pytest.fixture(scope="module")
def problems():
    """What was found wrong with the mount of each design that `made` has built."""
    return {}


@pytest.fixture(scope="module")
def made(tmp_path_factory, coarser, problems):
    folder = tmp_path_factory.mktemp("search") / "out"
    find = design_search._problem

    def remembered(rig, design):
        return problems.setdefault(tuple(design), find(rig, design))

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(design_search, "_problem", remembered)
        summary = search_into(Rig.load("aqua2"), preset_path("aqua2"), folder, WANTED, log=lambda line: None)
    return folder, summary


def test_the_folder_holds_the_front(made):
    folder, summary = made
    with (folder / "front.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == summary.front > 5
    assert [row["rig"] for row in rows if row["rig"]] == [item.file for item in summary.chosen]
    assert json.loads((folder / "summary.json").read_text(encoding="utf-8")) == summary.as_dict()
    assert (folder / "search.png").stat().st_size > 5000
    assert not list(folder.rglob("*.partial*"))


def test_rig_files_keep_comments_and_can_be_built(made):
    folder, summary = made
    item = summary.chosen[0]
    file = folder / item.file
    assert "# nominal (d1 of figure 3)" in file.read_text(encoding="utf-8")
    rig = Rig.load(file)
    assert rig.name == file.stem
    np.testing.assert_array_equal(design_of(rig), list(item.design_mm.values()))
    assert feasibility_problems(rig) == []
    assert assembly_problems(build_assembly(rig)) == []


def test_every_objective_has_a_figure_whether_it_was_searched_by_or_not(made):
    _, summary = made
    for item in (summary.own, *summary.chosen):
        assert set(item.figures) == set(OBJECTIVES)
        assert {name: item.figures[name] for name in WANTED.objectives} == item.scores
    # The middle of a flat port magnifies by the index of water: f / n pixels per radian.
    assert summary.pixels_per_degree == pytest.approx(500 * 1.339 * np.pi / 180, rel=2e-3)


def test_a_design_is_written_into_the_users_file(made, tmp_path):
    _, summary = made
    file = tmp_path / "mine.toml"
    file.write_text(preset_path("aqua2").read_text(encoding="utf-8"), encoding="utf-8")
    apply_design(summary, 1, file)
    np.testing.assert_array_equal(design_of(Rig.load(file)), list(summary.chosen[0].design_mm.values()))
    assert "# nominal (d1 of figure 3)" in file.read_text(encoding="utf-8")
    before = file.read_bytes()
    with pytest.raises(ValueError, match=f"1 to {len(summary.chosen)}, got 9"):
        apply_design(summary, 9, file)
    near = summary.chosen[0].design_mm | {"fold_mirror.distance_mm": 30.0}
    impossible = replace(summary.chosen[0], design_mm=near)
    with pytest.raises(RigError, match="M1"):
        apply_design(replace(summary, chosen=[impossible]), 1, file)
    assert file.read_bytes() == before


def test_a_second_run_computes_nothing_and_changes_nothing(made, monkeypatch):
    folder, summary = made
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    monkeypatch.setattr(design_search, "build_assembly", None)
    lines = []
    again = search_into(Rig.load("aqua2"), preset_path("aqua2"), folder, WANTED, log=lines.append)
    assert again == summary
    assert [line for line in lines[:-1] if not line.endswith("done before")] == []
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def test_an_interrupted_search_ends_the_same(made, problems, tmp_path, monkeypatch):
    """As the one that nobody interrupted. Building mounts takes seconds: what was found of them then is remembered."""

    def interrupt(rig, design):
        raise KeyboardInterrupt

    def run():
        lines = []
        search_into(Rig.load("aqua2"), preset_path("aqua2"), tmp_path / "out", WANTED, log=lines.append)
        return lines

    monkeypatch.setattr(design_search, "_problem", interrupt)
    with pytest.raises(KeyboardInterrupt):
        run()
    assert not (tmp_path / "out/summary.json").exists()
    monkeypatch.setattr(design_search, "_problem", lambda rig, design: problems[tuple(design)])
    assert run()[0] == "own design: done before"
    for name in ("front.csv", "summary.json", "search.png"):
        assert (tmp_path / "out" / name).read_bytes() == (made[0] / name).read_bytes(), name


def test_workers_find_the_same(made, problems, tmp_path, monkeypatch):
    """Scores of two processes; of the mounts they are told what was found."""
    monkeypatch.setattr(design_search, "_problem", lambda rig, design: problems[tuple(design)])
    with open_workers(workers=2) as workers:
        search_into(
            Rig.load("aqua2"), preset_path("aqua2"), tmp_path / "out", WANTED, workers=workers, log=lambda line: None
        )
    for name in ("front.csv", "summary.json", "search.png"):
        assert (tmp_path / "out" / name).read_bytes() == (made[0] / name).read_bytes(), name


def test_wrong_wishes_are_sentences(tmp_path):
    with pytest.raises(ValueError, match="two or more of the objectives"):
        Wanted(objectives=("coverage",))
    with pytest.raises(ValueError, match="count > 0"):
        Wanted(objectives=("coverage", "area"), count=0)
    for rig, wanted, message in (
        ("bench", WANTED, "expected a rig with mirrors"),
        ("aqua2", Wanted(objectives=("coverage", "area"), factor=0.5), "a factor above 1"),
    ):
        with pytest.raises(ValueError, match=message):
            search_into(Rig.load(rig), preset_path(rig), tmp_path / "x", wanted, log=lambda line: None)
    assert not (tmp_path / "x").exists()
