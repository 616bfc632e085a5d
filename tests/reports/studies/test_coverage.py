"""The coverage report of aqua2, made once on a coarse grid: what it holds, and that it can be interrupted."""

from __future__ import annotations

import csv
import json
import re

import numpy as np
import pytest

from optics.coverage.outcome import Outcome
from optics.coverage.sphere import cell_count, cell_directions
from reports.figures.plotting import OUTCOME_NAMES
from reports.studies import coverage as module
from reports.studies.coverage import coverage_report
from rigs import Rig

STEP_DEG = 8.0


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("coverage") / "aqua2"
    lines = []
    coverage_report(Rig.load("aqua2"), folder, step_deg=STEP_DEG, log=lines.append)
    return folder, lines


def rows_of(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def numbers_of(folder):
    return json.loads((folder / "coverage.json").read_text(encoding="utf-8"))


def test_everything_a_colleague_needs_is_there(made):
    folder, lines = made
    tables = ("poses.csv", "sphere.csv", "blind.csv", "openings.csv", "convergence.csv")
    for name in ("coverage.html", "coverage.json", *tables, *module.FIGURES):
        assert (folder / name).stat().st_size > 300, name
    stages = [line for line in lines if not line.startswith("  ")]
    assert stages[:3] == ["coverage ...", "convergence ...", "report ..."]
    assert not list(folder.rglob("*.partial*"))


def test_page_opens_without_a_network(made):
    html = (made[0] / "coverage.html").read_text(encoding="utf-8")
    sources = re.findall(r"""(?:src|href)\s*=\s*["']([^"']*)""", html)
    assert len(sources) == len(module.FIGURES)
    assert all(source.startswith("data:image/png;base64,") for source in sources)
    assert not re.search(r"https?://|<script|@import|url\(", html)
    assert "nan" not in re.sub(r"base64,[^\"]*", "", html)


def test_page_json_and_tables_agree(made):
    """Three ways to the same numbers: the arrays, the CSV files, and the words of the page."""
    folder = made[0]
    maps = numbers_of(folder)["coverage"]
    sphere = rows_of(folder / "sphere.csv")
    assert len(sphere) == cell_count(module.NSIDE)
    seen = np.array([int(row["poses"]) for row in sphere])
    assert (seen > 0).mean() == pytest.approx(maps["covered_fraction"], abs=1e-12)
    assert np.median(seen[seen > 0]) == maps["poses_seeing_a_direction"]["median"]
    causes = [row["blind_because_of"] for row in sphere]
    for cause, fraction in maps["blind_fraction_by_cause"].items():
        assert causes.count(cause) / len(causes) == pytest.approx(fraction, abs=1e-12)
    assert sum(maps["blind_fraction_by_cause"].values()) == pytest.approx(1 - maps["covered_fraction"])
    blind = rows_of(folder / "blind.csv")
    assert sum(float(row["solid_angle_sr"]) for row in blind) / (4 * np.pi) == pytest.approx(
        1 - maps["covered_fraction"], abs=1e-6 * len(blind)
    )
    html = (folder / "coverage.html").read_text(encoding="utf-8")
    assert f"<b>{maps['covered_fraction']:.1%}</b>" in html
    limits = maps["covered_range"]
    assert limits["low"] <= maps["covered_fraction"] <= limits["half_step_fraction"] <= limits["high"]
    assert f"{limits['low']:.1%} to {limits['high']:.1%} with finer steps" in html


def test_changes_that_open_patches_are_listed_by_what_they_gain(made):
    folder = made[0]
    maps = numbers_of(folder)["coverage"]
    rows = rows_of(folder / "openings.csv")
    assert [row["change"] for row in rows] == [opening["key"] for opening in maps["openings"]]
    gained = [float(row["gained_sr"]) for row in rows]
    assert gained == sorted(gained, reverse=True)
    for opening in maps["openings"]:
        patch = maps["blind_patches"][opening["patch"]]
        assert opening["gained_sr"] == pytest.approx(opening["share"] * patch["solid_angle_sr"])
        assert opening["net_sr"] >= 0
    html = (folder / "coverage.html").read_text(encoding="utf-8")
    assert f"{rows[0]['change']}: {rows[0]['before']} → {rows[0]['after']} {rows[0]['unit']}" in html


def test_cells_stand_where_the_table_says(made):
    sphere = rows_of(made[0] / "sphere.csv")
    directions = cell_directions(module.NSIDE)
    for k in (0, 427, 20_000, 49_151):
        azimuth, elevation = (np.radians(float(sphere[k][name])) for name in ("azimuth_deg", "elevation_deg"))
        found = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
        # Four decimals of a degree.
        np.testing.assert_allclose(found, directions[k], atol=2e-6)
        assert sphere[k]["healpix_ring"] == str(k)


def test_every_part_of_the_image_is_accounted_for(made):
    maps = numbers_of(made[0])["coverage"]
    assert sum(maps["share_of_image"].values()) == pytest.approx(1)
    regions = maps["mean_solid_angle_by_region_sr"]
    seen = maps["mean_solid_angle_sr"]
    assert regions["gaze"]["seen"] == pytest.approx(seen["seen"])
    assert sum(regions["fold"].values()) == pytest.approx(seen["missed_m2"] + seen["back_of_mirror"])
    assert sum(regions["direct"].values()) == pytest.approx(seen["missed_m1"])
    # The bracket of M1 stands in the direct view of this rig, the hull does not.
    assert regions["direct"]["fold_bracket"] > 0
    assert regions["direct"]["hull"] == 0


def test_a_second_run_repeats_nothing_and_another_step_everything(made, tmp_path):
    folder, _ = made
    before = {path: path.read_bytes() for path in folder.iterdir()}
    lines = []
    coverage_report(Rig.load("aqua2"), folder, step_deg=STEP_DEG, log=lines.append)
    assert lines[:2] == ["coverage: done before", "convergence: done before"]
    assert {path: path.read_bytes() for path in folder.iterdir()} == before
    stages = module.Stages.open(folder, Rig.load("aqua2"), lines.append, settings="coverage and openings 4.0")
    assert not stages.done


def test_an_interrupted_run_goes_on_and_ends_the_same(made, tmp_path, monkeypatch):
    """Interrupted in the study, the coverage is not computed again, and every file is the same to the byte."""
    folder = tmp_path / "aqua2"
    with monkeypatch.context() as patched:
        patched.setattr(module, "convergence", _interrupt)
        with pytest.raises(KeyboardInterrupt):
            coverage_report(Rig.load("aqua2"), folder, step_deg=STEP_DEG, log=lambda line: None)
    assert not (folder / "coverage.html").exists()
    lines = []
    coverage_report(Rig.load("aqua2"), folder, step_deg=STEP_DEG, log=lines.append)
    assert lines[0] == "coverage: done before"
    for path in made[0].iterdir():
        assert (folder / path.name).read_bytes() == path.read_bytes(), path.name


@pytest.mark.parametrize("step_deg", [0.0, -1.0, 0.2, 91.0, float("nan"), float("inf")])
def test_steps_out_of_range_are_refused_and_nothing_is_written(step_deg, tmp_path):
    with pytest.raises(ValueError, match=r"expected a step of the joints from 0\.25 to 90 degrees"):
        coverage_report(Rig.load("aqua2"), tmp_path / "out", step_deg=step_deg, log=lambda line: None)
    assert not (tmp_path / "out").exists()


def test_a_rig_without_mirrors_has_no_report(tmp_path):
    with pytest.raises(ValueError, match="expected a rig with mirrors, got 'bench'"):
        coverage_report(Rig.load("bench"), tmp_path / "out", step_deg=8.0, log=lambda line: None)
    assert not (tmp_path / "out").exists()


def test_every_outcome_has_a_name_and_a_colour():
    assert set(OUTCOME_NAMES) == set(Outcome)


def _interrupt(*arguments, **options):
    raise KeyboardInterrupt
