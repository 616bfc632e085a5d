"""The design report of aqua2, made once: what it holds, and that it can be interrupted and repeated."""

import csv
import json
import re
import shutil
from collections import Counter
from datetime import UTC, datetime
from functools import partial
from html import unescape
from urllib.parse import unquote

import numpy as np
import pytest
from pydantic import TypeAdapter
from pypdf import PdfReader

from cad.checks.assembly_checks import MountChecks
from cad.checks.printing.orientation import print_findings
from cad.export import mount
from dives.dive import varied
from dives.validation import validation_dive
from optics.coverage.openings.openings import Opening
from optics.coverage.outcome import Outcome
from reports.pages.dive import CAPTIONS, DiveResults
from reports.pages.mount import MountResults
from reports.pages.report_files import write_pages
from reports.progress import Stages
from reports.studies import design as study
from reports.studies import mount_export
from reports.studies.design import STAGES, MapGrid, design
from rigs import Rig, RigError
from scenes import exterior
from scenes.baking.light_quality import LightQuality
from scenes.exterior import VIEWPOINTS

RIG = Rig.load("aqua2")

DIVE = varied(validation_dive(RIG), frames=6).model_copy(update={"world": "blue"})
"""A minute of the reef takes as long as all the rest; that a dive ends in the page does not depend on its length."""


GRID = MapGrid(poses=15, columns=48, rows=36)
"""Tables, summary and page agree on any grid; how good the numbers are is tested in tests/optics/coverage."""

DAY = int(datetime(2026, 11, 3, 12, tzinfo=UTC).timestamp())

SLOW_FILES = ("write_drawings", "assembly_steps", "write_steps", "write_robot")
"""Of an export: tests/cad/export look at them. What the report says of a mount does not depend on them."""


OPENING = Opening(
    patch=0,
    key="gaze_mirror.width_mm",
    before=80.0,
    after=120.0,
    unit="mm",
    also="",
    gained_sr=0.1,
    share=0.18,
    net_sr=0.2,
)
"""What to change takes seconds on any grid; tests/optics/coverage and the coverage report's tests look at it."""


OUTSIDE_SAMPLES = 4
"""Of the pictures from outside: with a user's 64 they take seconds, and nothing here looks at their noise."""


report = partial(design, RIG, dive=DIVE, grid=GRID, quality=LightQuality.coarse())


def made_design(folder, log):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study, "blind_openings", lambda *_, **__: [OPENING])
        patch.setattr(exterior, "SAMPLES", OUTSIDE_SAMPLES)
        patch.setenv("SOURCE_DATE_EPOCH", str(DAY))
        return report(folder, log=log)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("design") / "aqua2"
    lines = []
    with pytest.MonkeyPatch.context() as patch:
        for name in SLOW_FILES:
            patch.setattr(mount, name, lambda *_: None)
        made_design(folder, lines.append)
    return folder, lines


def rows_of(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_everything_an_engineer_needs_is_there(made):
    folder, lines = made
    for name in ("report.html", "report.pdf", "summary.json", "coverage/poses.csv", "coverage/coverage.png"):
        assert (folder / name).stat().st_size > 1000, name
    portraits = {f"outside_{name}" for name in VIEWPOINTS}
    assert {path.stem for path in (folder / "views").iterdir()} == set(study.GAZES_DEG) | portraits
    assert (folder / "mount/aqua2.step").is_file()
    assert (folder / "mount/parts/yoke.stl").is_file()
    assert (folder / "mount/checks/checks.csv").is_file()
    assert (folder / "mount/loads/masses.csv").is_file()
    stages = [line.split()[0] for line in lines if not line.startswith(("export: ", "checks: "))]
    assert [stage for stage in dict.fromkeys(stages) if stage in STAGES] == list(STAGES)
    assert (folder / "dive/log.parquet").is_file()
    assert (folder / "dive/overlay.mp4").is_file()
    assert not list(folder.rglob("*.partial*"))


def test_report_opens_without_a_network(made):
    """Self-contained: no address but data URIs and files of the folder, no script."""
    html = (made[0] / "report.html").read_text(encoding="utf-8")
    dive_images = len(CAPTIONS) + len(list((made[0] / "dive/key_frames").iterdir()))
    sources = re.findall(r"""src\s*=\s*["']([^"']*)""", html)
    assert len(sources) == len(study.GAZES_DEG) + len(VIEWPOINTS) + 6 + dive_images
    assert all(source.startswith("data:image/png;base64,") for source in sources)
    assert not re.search(r"https?://|<script|@import|url\(", html)


def test_every_link_leads_to_a_file(made):
    folder = made[0]
    html = (folder / "report.html").read_text(encoding="utf-8")
    links = {unquote(link) for link in re.findall(r'href="([^"]*)"', html)}
    assert links > {"summary.json", "views/ahead.png", "mount/aqua2.step", "mount/bom.csv", "dive/overlay.mp4"}
    assert [link for link in links if not (folder / link).is_file()] == []


def test_the_page_begins_with_what_the_design_is_judged_to_be(made):
    """A dive of six images does not find its ball: one failure, and the design has failed."""
    folder = made[0]
    html = (folder / "report.html").read_text(encoding="utf-8")
    standing = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["standing"]
    marks = f"rig {standing['rig_digest']}, mirrorgaze {standing['version']}"
    assert f"<p>Revision not stated, {marks}, 2026-11-03.</p>" in html
    manifest = json.loads((folder / "mount/manifest.json").read_text(encoding="utf-8"))
    assert manifest["rig"]["sha256"].startswith(standing["rig_digest"])
    assert "<h2>Verdict: fail (1 of 5)</h2>" in html
    assert not standing["dive"]["passed"]
    assert standing["dive"]["sentences"][0].startswith("never acquired: ")
    assert f"<td>dive</td><td>{standing['dive']['sentences'][0]}</td>" in html


def test_every_number_of_page_and_pdf_comes_from_the_summary(made, tmp_path):
    """Of summary and images alone both come out the same to the byte; another number in the summary is in both."""
    folder = tmp_path / "aqua2"
    shutil.copytree(made[0], folder, ignore=lambda _, names: [name for name in names if is_data(name)])
    for name in ("report.html", "report.pdf"):
        (folder / name).unlink()
    write_pages(folder)
    for name in ("report.html", "report.pdf"):
        assert (folder / name).read_bytes() == (made[0] / name).read_bytes(), name
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    summary["coverage"]["covered_fraction"] = 0.12345
    (folder / "summary.json").write_text(json.dumps(summary), encoding="utf-8")
    write_pages(folder)
    assert "<b>12.3%</b>" in (folder / "report.html").read_text(encoding="utf-8")
    assert "12.3%" in pdf_text(folder / "report.pdf")


def is_data(name):
    return name != "summary.json" and name.endswith((".json", ".csv", ".parquet", ".toml", ".md"))


def test_page_and_pdf_have_the_same_numbers(made):
    """In any order: a PDF has no tables, only words at places."""
    html = (made[0] / "report.html").read_text(encoding="utf-8")
    words = unescape(re.sub(r"<[^>]*>", " ", re.sub(r"(?s)<style>.*?</style>|<title>.*?</title>", "", html)))
    assert numbers_in(words) == numbers_in(pdf_text(made[0] / "report.pdf"))


def numbers_in(words):
    return Counter(re.findall(r"\d+(?:\.\d+)?", words))


def pdf_text(path):
    """Words of a PDF without the foot of its pages; a line ends where the paper does, also within a file's name."""
    pages = (page.extract_text() for page in PdfReader(path).pages)
    return " ".join(page.replace("\u200b", "")[: page.rindex("aqua2: design report")] for page in pages)


def test_summary_agrees_with_the_tables(made):
    """Two ways to the same number: the summary's from the arrays, these from the CSV files."""
    folder = made[0]
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["coverage"]
    sphere = rows_of(folder / "coverage/sphere.csv")
    covered = sum(row["poses"] != "0" for row in sphere) / len(sphere)
    assert covered == pytest.approx(summary["covered_fraction"], abs=1e-12)
    poses = rows_of(folder / "coverage/poses.csv")
    assert len(poses) == summary["poses"] == GRID.poses**2
    usable = np.reshape([float(row["usable_solid_angle_sr"]) for row in poses], (GRID.poses, -1))
    mean = np.trapezoid(np.trapezoid(usable, axis=1)) / (GRID.poses - 1) ** 2
    assert mean == pytest.approx(summary["usable_solid_angle_sr"]["mean"], rel=1e-5)
    cells = GRID.columns * GRID.rows
    names = [f"{outcome.name.lower()}_cells" for outcome in Outcome]
    assert all(sum(int(row[name]) for name in names) == cells for row in poses[::7])
    # Eq. 5 of the paper, on a pose away from the zenith.
    row = next(row for row in poses if row["q1_deg"] == "-77.5000")
    assert float(row["azimuth_deg"]) == pytest.approx(-77.5, abs=1e-4)
    assert float(row["elevation_deg"]) == pytest.approx(2 * float(row["q2_deg"]), abs=1e-4)


def test_checks_and_loads_are_on_the_page(made):
    """The page has the summary's figures; every check is of a mount that was exported, so none failed."""
    folder = made[0]
    mount = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["mount"]
    assert {finding["verdict"] for finding in mount["checks"]} == {"passed"}
    html = (folder / "report.html").read_text(encoding="utf-8")
    for check, counts, _ in mount["check_rows"]:
        assert f"<td>{check}</td><td>{counts}</td>" in html
    for servo in mount["loads"]["servos"]:
        assert f'<td>{servo["servo"]}</td><td class="number">{servo["off_balance_water_n_m"]:.3f}</td>' in html


def test_views_show_where_they_look(made):
    views = json.loads((made[0] / "summary.json").read_text(encoding="utf-8"))["views"]["views"]
    for view in views:
        azimuth, elevation = study.GAZES_DEG[view["name"]]
        turn = (view["gaze_deg"]["azimuth"] - azimuth + 180) % 360 - 180
        assert turn == pytest.approx(0, abs=1e-9)
        assert view["gaze_deg"]["elevation"] == pytest.approx(elevation, abs=1e-9)
        assert view["region_px"]["gaze"] > 10_000
    seen = {view["name"]: view["target_px"] for view in views}
    # The tank's ball hangs on the gaze axis of this view, to the centimetre: 5 px at 2 m.
    assert seen["target"] == pytest.approx([319.5, 239.5], abs=5)


def test_a_second_run_changes_nothing_and_repeats_nothing(made, tmp_path):
    folder, _ = made
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    lines = []
    made_design(folder, lines.append)
    assert lines == [f"{stage}: done before" for stage in STAGES]
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def test_the_page_shows_what_was_made_and_says_what_was_not(made, tmp_path):
    folder = tmp_path / "aqua2"
    lines = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study, "blind_openings", lambda *_, **__: [OPENING])
        page = report(folder, log=lines.append, only=["coverage"])
    assert "gaze_mirror.width_mm: 80 → 120 mm" in page.read_text(encoding="utf-8")
    assert lines == ["coverage ...", f"{page} shows coverage"]
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert summary["coverage"] == json.loads((made[0] / "summary.json").read_text(encoding="utf-8"))["coverage"]
    assert [name for name in STAGES if summary[name] is None] == list(STAGES[1:])
    html = page.read_text(encoding="utf-8")
    assert "Not made: sizing, outside, mount, tolerance, views, dive." in html
    assert html.count("<img") == 2
    assert "Dive:" not in html
    assert "views/*.png" not in html


def test_a_stage_that_was_made_before_stays_on_the_page(made, tmp_path):
    copy = tmp_path / "aqua2"
    shutil.copytree(made[0], copy)
    lines = []
    report(copy, log=lines.append, only=["views"])
    assert lines == ["views: done before"]
    for name in ("report.html", "report.pdf", "summary.json"):
        assert (copy / name).read_bytes() == (made[0] / name).read_bytes(), name


def test_an_interrupted_run_goes_on_and_ends_the_same(made, tmp_path, monkeypatch):
    """Interrupted in the views, the mount is not made again, and the page is the same to the byte.

    The mount, which takes most of the time, is copied; so is the dive, whose bytes tests/dives compares.
    """
    folder = tmp_path / "aqua2"

    def copied_mount(checked, target, log):
        shutil.copytree(made[0] / "mount", target / "mount")
        data = json.loads((made[0] / "summary.json").read_text(encoding="utf-8"))["mount"]
        result = TypeAdapter(MountResults).validate_python(data)
        return result, [target / file for file in result.files]

    def copied_dive(rig, dive, target, log, quality):
        shutil.copytree(made[0] / study.DIVE, target / study.DIVE)
        data = json.loads((made[0] / "summary.json").read_text(encoding="utf-8"))["dive"]
        return TypeAdapter(DiveResults).validate_python(data), []

    monkeypatch.setattr(study, "_dive", copied_dive)
    monkeypatch.setattr(study, "_checked_mount", lambda rig, log: None)
    with monkeypatch.context() as patched:
        patched.setattr(study, "_mount", copied_mount)
        patched.setattr(study, "render_with", _interrupt)
        with pytest.raises(KeyboardInterrupt):
            made_design(folder, lambda line: None)
    assert "Not made: views, dive." in (folder / "report.html").read_text(encoding="utf-8")
    lines = []
    made_design(folder, lines.append)
    before = STAGES.index("views")
    assert lines[: before + 1] == [*(f"{stage}: done before" for stage in STAGES[:before]), "views ..."]
    for name in ("report.html", "summary.json", "coverage/poses.csv", "views/target.png"):
        assert (folder / name).read_bytes() == (made[0] / name).read_bytes(), name


def test_a_changed_rig_is_made_again(made, tmp_path):
    folder = tmp_path / "aqua2"
    rig = Rig.load("aqua2")
    stages = Stages.open(folder, rig, lambda line: None)
    stages.run("mount", dict, lambda: ({"parts": []}, []))
    wider = rig.with_gaze(gaze_mirror={"width_mm": 81.0})
    assert Stages.open(folder, rig, lambda line: None).done
    assert not Stages.open(folder, wider, lambda line: None).done


def test_a_folder_with_something_else_is_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(FileExistsError, match="expected a new folder, an empty one or that of an earlier run"):
        design(Rig.load("aqua2"), tmp_path, log=lambda line: None)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_rig_without_mirrors_has_no_report(tmp_path):
    with pytest.raises(ValueError, match="expected a rig with mirrors, got 'bench'"):
        design(Rig.load("bench"), tmp_path / "out", log=lambda line: None)
    assert not (tmp_path / "out").exists()


def test_a_mount_that_does_not_fit_the_printer_is_named(tmp_path, monkeypatch):
    """The bed is a key of the rig: the problem names it, and nothing is written. One part is checked."""

    def base_check(assembly, **_):
        mesh = assembly.part("gimbal_base").mesh
        return MountChecks(findings=tuple(print_findings(mesh, assembly.rig.gaze.mount)))

    monkeypatch.setattr(mount_export, "kept_checks", base_check)
    rig = Rig.load("aqua2")
    small = rig.with_gaze(mount={"printer_bed_mm": (100.0, 100.0, 100.0)})
    with pytest.raises(RigError, match="printer_bed_mm"):
        design(small, tmp_path / "out", log=lambda line: None)
    assert not (tmp_path / "out").exists()


def _interrupt(*arguments, **options):
    raise KeyboardInterrupt
