"""`mirrorgaze size`: what it prints, what it writes, and that it writes nothing it should not."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app
from rigs import Rig, load_document, preset_path, save_document

LEVEL = ("--elevation-deg", "-10", "30", "--azimuth-deg", "-40", "40")


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


@pytest.fixture
def own(tmp_path, monkeypatch):
    """A rig file of one's own, with a comment behind a number that will change."""
    monkeypatch.chdir(tmp_path)
    document = load_document(preset_path("aqua2"))
    document["name"] = "mine"
    save_document(document, tmp_path / "mine.toml")
    return tmp_path / "mine.toml"


def test_sizes_are_printed_for_people_and_machines(own):
    result = mirrorgaze("size", "mine.toml", *LEVEL)
    assert result.exit_code == 0, result.stderr
    assert result.stdout.startswith(
        "mine.toml: a window of 128 x 96 px, azimuth -40 to 40, elevation -10 to 30 degrees"
    )
    assert "M2 octagon" in result.stdout and "cm²" in result.stdout and "the present mirrors pass" in result.stdout
    # The coating is the one that the bill of materials names.
    assert "buy: one order, cut to size from front-surface float glass, protected aluminium" in result.stdout
    assert result.stdout.splitlines()[-1].strip() == "the same with --apply writes them into mine.toml"
    answer = json.loads(mirrorgaze("size", "mine.toml", *LEVEL, "--json").stdout)
    driver = answer["drivers"][-1]
    assert f"M2 height {driver['length_mm']:.1f} mm: at azimuth {driver['azimuth_deg']:.0f}, " in result.stdout
    assert answer["met"] is True and answer["bindings"] == []
    assert answer["window_px"] == [255.5, 191.5, 383.5, 287.5]
    width, height = (answer["mirrors"]["M2"][side] for side in ("width_mm", "height_mm"))
    assert f"{answer['outlines']['M2']['rectangle']['area_cm2']:.1f} cm²" in result.stdout
    assert answer["outlines"]["M2"]["rectangle"]["area_cm2"] <= width * height / 100


def test_apply_changes_the_four_numbers_and_keeps_the_comments(own):
    before = own.read_text(encoding="utf-8").splitlines()
    result = mirrorgaze("size", "mine.toml", *LEVEL, "--apply")
    assert result.exit_code == 0, result.stderr
    after = own.read_text(encoding="utf-8").splitlines()
    changed = [(a, b) for a, b in zip(before, after, strict=True) if a != b]
    assert [b.split(" =")[0] for _, b in changed] == ["width_mm", "height_mm", "width_mm", "height_mm"]
    assert all(a.partition("#")[2] == b.partition("#")[2] for a, b in changed)
    rig = Rig.load(own)
    answer = json.loads(mirrorgaze("size", "mine.toml", *LEVEL, "--json").stdout)
    for name, mirror in (("M1", rig.gaze.fold_mirror), ("M2", rig.gaze.gaze_mirror)):
        assert answer["mirrors"][name] == mirror.model_dump(include={"outline", "width_mm", "height_mm"})
    assert answer["present_mirrors_pass"] == 1
    assert [file.name for file in own.parent.iterdir()] == ["mine.toml"]


def test_another_outline_is_applied_with_its_sides(own):
    """An ellipse holds what a rectangle need not: both of its sides are longer, its area less than theirs."""
    rectangles = json.loads(mirrorgaze("size", "mine.toml", *LEVEL, "--json").stdout)["mirrors"]
    result = mirrorgaze("size", "mine.toml", *LEVEL, "--outline", "ellipse", "--apply")
    assert result.exit_code == 0, result.stderr
    gaze = Rig.load(own).gaze
    for name, mirror in (("M1", gaze.fold_mirror), ("M2", gaze.gaze_mirror)):
        assert mirror.outline == "ellipse"
        assert mirror.width_mm > rectangles[name]["width_mm"] and mirror.height_mm > rectangles[name]["height_mm"]
    assert json.loads(mirrorgaze("size", "mine.toml", *LEVEL, "--json").stdout)["present_mirrors_pass"] == 1


def test_apply_writes_nothing_when_the_request_cannot_be_met(own):
    before = own.read_bytes()
    result = mirrorgaze("size", "mine.toml", "--window", "0.9", "--elevation-deg", "-65", "0", "--apply")
    assert result.exit_code == 1
    assert "cannot be met, grazing incidence on M2: at " in result.stdout
    assert "would fit: " in result.stdout
    assert own.read_bytes() == before


def test_apply_writes_nothing_when_the_mirrors_do_not_fit_the_printer(own):
    document = load_document(own)
    document["mount"]["printer_bed_mm"] = [50.0, 60.0, 80.0]
    save_document(document, own)
    before = own.read_bytes()
    result = mirrorgaze("size", "mine.toml", *LEVEL, "--apply")
    assert result.exit_code == 1
    assert "mirrorgaze:" not in result.stderr
    assert "cannot be met, printer bed: M2 of " in result.stdout
    assert own.read_bytes() == before


def test_presets_are_not_written(own):
    before = preset_path("aqua2").read_bytes()
    for rig in ("aqua2", str(preset_path("aqua2"))):
        result = mirrorgaze("size", rig, *LEVEL, "--apply")
        assert result.exit_code == 2
        assert "is a preset; copy it first: mirrorgaze new my-rig --from aqua2" in result.stderr
    assert preset_path("aqua2").read_bytes() == before


def test_output_holds_outlines_and_trade_off(own, monkeypatch):
    from reports.studies import sizing

    # Two by two designs: what they are is tested elsewhere.
    monkeypatch.setattr(sizing, "DISTANCE_FACTORS", (1.0, 1.2))
    result = mirrorgaze("size", "mine.toml", *LEVEL, "-o", "out", "--outline", "octagon")
    assert result.exit_code == 0, result.stderr
    files = sorted(file.name for file in (own.parent / "out").iterdir())
    assert files == ["outlines.json", "outlines.png", "trade_off.csv", "trade_off.png"]
    assert len((own.parent / "out" / "trade_off.csv").read_text(encoding="utf-8").splitlines()) == 5


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--window", "wide"], "window wide: expected a fraction (0.2), pixels (320x240), degrees"),
        (
            ["--azimuth-deg", "40", "-40"],
            "expected a range of azimuth from a lower to a higher angle, got 40 to -40 deg",
        ),
        (["--elevation-deg", "0", "120"], "expected elevations between -90 and 90 deg, got 0 to 120"),
        (["--margin-mm", "-1"], "expected margin_m of at least 0, got -0.001"),
        (["--outline", "star"], "'--outline': 'star' is not one of 'rectangle', 'octagon', 'ellipse'"),
        (["-o", "mine.toml"], "expected a folder to write into"),
    ],
)
def test_bad_input_is_a_sentence(own, arguments, words):
    before = own.read_bytes()
    result = mirrorgaze("size", "mine.toml", *arguments)
    assert (result.exit_code, words in result.stderr) == (2, True), result.stderr
    assert own.read_bytes() == before
    assert [file.name for file in own.parent.iterdir()] == ["mine.toml"]


def test_a_rig_without_mirrors_is_refused():
    result = mirrorgaze("size", "bench")
    assert (result.exit_code, "expected a rig with mirrors, got 'bench'" in result.stderr) == (2, True)


def test_what_is_ordered_and_applied_can_be_mounted(own):
    """For one pixel ahead the light needs less of M1 than its cell does, whose least side an octagon's is 30 mm."""
    ahead = ("--window", "0.01", "--azimuth-deg", "-1", "1", "--elevation-deg", "-1", "1", "--outline", "octagon")
    result = mirrorgaze("size", "mine.toml", *ahead, "--apply")
    assert result.exit_code == 0, result.stderr
    mirror = Rig.load("mine.toml").gaze.fold_mirror
    assert (mirror.width_mm, mirror.height_mm) == (30, 30)
    assert "M1 30 x 30 x 3 mm" in result.stdout
