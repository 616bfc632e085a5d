"""A checked export: its reports are in the folder and the manifest, and nothing is written when a check fails."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from cad.assembly.meshes import rig_meshes
from cad.checks.assembly_checks import MountChecks
from cad.checks.printing.slicer import NO_SLICER, Slice
from cad.checks.sequence.steps import Step
from cad.export import mount
from cad.export.printing import plate_slices
from cad.export.printing.plates import print_plates, write_plates
from cad.finding import Finding, Verdict
from mirrorgaze.cli import app
from optics.mesh import Role
from reports.studies import mount_export
from reports.studies.mount_export import checked_mount, export_checked_mount
from rigs import Problem, Rig, RigError

GOOD = Finding(check="wall thickness", subject="yoke", figure=1.2, unit="mm", limit=0.8)
PROBLEM = Problem(place="mount.wall_mm", value=0.4, expected="walls of 0.8 mm or more")
BAD = Finding(check="wall thickness", subject="yoke", figure=0.4, unit="mm", limit=0.8, problem=PROBLEM)

STEPS = (Step(title="Screw the base to the hull", part="gimbal_base", present=(), moves=(), driven=(), blocked=()),)


@pytest.fixture
def found(monkeypatch):
    """Let the checks find what a test says."""

    def find(*findings):
        monkeypatch.setattr(mount_export, "kept_checks", lambda *_, **__: MountChecks(findings=findings, steps=STEPS))

    return find


def test_reports_are_in_the_folder_and_in_its_manifest(found, tmp_path, monkeypatch):
    """The slow files of an export are left out: tests/cad/export looks at them."""
    found(GOOD)
    for slow in ("write_drawings", "write_robot"):
        monkeypatch.setattr(mount, slow, lambda *_: None)
    drawn = []
    monkeypatch.setattr(mount, "write_steps", lambda _, steps, __: drawn.append(steps))
    made = checked_mount(Rig.load("aqua2"), log=lambda line: None, slicing=False)
    assert made.checks.findings == (GOOD,)
    files = export_checked_mount(made, tmp_path / "out", log=lambda line: None)
    names = {path.relative_to(tmp_path / "out").as_posix() for path in files}
    reports = {"checks/checks.csv", "checks/checks.png"}
    reports |= {f"loads/{name}" for name in ("masses.csv", "ballast.csv", "torques.csv", "torques.png")}
    assert reports <= names
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text(encoding="utf-8"))
    assert reports <= manifest["files"].keys()
    assert "yoke,passed,1.2" in (tmp_path / "out/checks/checks.csv").read_text(encoding="utf-8")
    assert drawn == [STEPS], "the steps that the checks found are those that are drawn"


def test_nothing_is_written_when_a_check_fails(found, tmp_path):
    found(GOOD, BAD)
    result = CliRunner().invoke(app, ["export", "aqua2", "-o", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert f"aqua2: 1 problem\n  {PROBLEM}" in result.stderr
    assert not list(tmp_path.iterdir())


def test_a_servo_that_is_too_weak_is_named(found):
    """A thousandth of the rating is below what the flow alone asks for: 0.118 of 0.353 N m in `loads.md`."""
    found(GOOD)
    rig = Rig.load("aqua2")
    weak = rig.gaze.servos.pan.model_copy(update={"torque_n_m": rig.gaze.servos.pan.torque_n_m / 1000})
    rig = rig.with_gaze(servos={"pan": weak})
    with pytest.raises(RigError, match=r"servos\.pan"):
        checked_mount(rig, log=lambda line: None, slicing=False)


def test_the_plates_that_are_written_are_sliced_and_parts_where_one_warns(monkeypatch, tmp_path):
    rig = Rig.load("bluerov2")
    printed = [mesh for mesh in rig_meshes(rig) if mesh.role is Role.MOUNT]
    plates = print_plates(rig, printed)
    sliced = []

    def slice_stl(program, stl, mount):
        sliced.append(stl)
        return Slice(time_s=3600.0, mass_g=100.0, support_layers=0, warnings=("too tall",) if len(sliced) == 1 else ())

    monkeypatch.setattr(plate_slices, "slicer_path", lambda: "slicer")
    monkeypatch.setattr(plate_slices, "slice_stl", slice_stl)
    monkeypatch.setattr(plate_slices, "slice_finding", lambda mesh, mount: Finding(check="slicer", subject=mesh.name))
    warned, *rest = plate_slices.plate_findings(rig, printed)
    written = [path for path in write_plates(rig, printed, tmp_path) if path.suffix == ".stl"]
    assert [path.read_bytes() for path in written] == sliced
    assert warned.problem.value == "too tall"
    names = [mesh.name for mesh in plates[0]]
    assert all(name in warned.subject for name in names)
    alone, others = rest[: len(names)], rest[len(names) :]
    assert [finding.subject for finding in alone] == names
    assert [finding.problem for finding in others] == [None] * (len(plates) - 1)


def test_without_a_slicer_one_finding_says_so(monkeypatch):
    monkeypatch.setattr(plate_slices, "slicer_path", lambda: None)
    (finding,) = plate_slices.plate_findings(Rig.load("bluerov2"), [])
    assert finding.verdict is Verdict.NOT_RUN
    assert finding.note == NO_SLICER
