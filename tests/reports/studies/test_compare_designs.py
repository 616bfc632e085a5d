"""Two rigs side by side: what differs is what was changed, and the numbers are those of each alone."""

from __future__ import annotations

import json
from types import SimpleNamespace

import pytest
from matplotlib.figure import Figure

from optics.sizing.trade_off import swept_sphere_m3
from reports.studies import compare_designs as study
from reports.studies.compare_designs import DesignComparison, compare_designs
from rigs import Rig

AQUA2 = Rig.load("aqua2")
BURIED = AQUA2.with_gaze(mount={"base_anchor_mm": (270.0, 60.0, 500.0)}).model_copy(update={"name": "buried"})


@pytest.fixture(scope="module")
def compared() -> DesignComparison:
    with pytest.MonkeyPatch.context() as patched:
        # Few poses: what is tested here does not depend on them.
        patched.setattr(study, "POSES", 5)
        return compare_designs(AQUA2, BURIED.with_gaze(gaze_mirror={"height_mm": 110.0}))


def figure(compared: DesignComparison, name: str) -> study.Figure:
    return next(each for each in compared.figures if each.name == name)


def test_keys_that_differ_are_those_that_were_changed(compared: DesignComparison) -> None:
    keys = {each.key: (each.first, each.second) for each in compared.keys}
    assert keys == {
        "gaze_mirror.height_mm": (100.0, 110.0),
        "mount.base_anchor_mm": ([276.0, 60.0, -65.0], [270.0, 60.0, 500.0]),
    }


def test_numbers_are_those_of_each_rig(compared: DesignComparison) -> None:
    height = figure(compared, "M2 height")
    assert (height.first, height.second, height.change, height.unit) == (100.0, 110.0, 10.0, "mm")
    sphere = figure(compared, "sphere that M2 sweeps")
    assert sphere.first == pytest.approx(1000 * swept_sphere_m3(AQUA2.gaze.gaze_mirror))
    assert figure(compared, "resolution in the middle of the image").change == 0


def test_what_cannot_be_made_is_said_and_has_no_numbers(compared: DesignComparison) -> None:
    assert compared.first.problems == ()
    assert any("mount.base_anchor_mm" in problem for problem in compared.second.problems)
    if compared.second.coverage is None:
        assert figure(compared, "coverage of the sphere").second is None
        assert any("no mount can be made" in problem for problem in compared.second.problems)


def test_the_folder_holds_page_images_and_numbers(compared: DesignComparison, tmp_path, monkeypatch) -> None:
    # How a rig is drawn beside its hull is tested with `show`.
    monkeypatch.setattr(study, "show_rig", lambda rig: SimpleNamespace(standing=rig))
    monkeypatch.setattr(study, "standing_figure", lambda standing: Figure(figsize=(1, 1)))
    same = DesignComparison(first=compared.first, second=compared.first)
    files = same.write(tmp_path / "out")
    names = ["a_coverage.png", "a_rig.png", "b_coverage.png", "b_rig.png", "compare.html", "compare.json"]
    assert sorted(file.name for file in files) == sorted([*names, "coverage_of_both.png"])
    assert all(file.is_file() for file in files)
    page = (tmp_path / "out/compare.html").read_text(encoding="utf-8")
    assert page.count("data:image/png") == 5
    assert "aqua2 (A)" in page
    assert json.loads((tmp_path / "out/compare.json").read_text(encoding="utf-8"))["keys"] == []
