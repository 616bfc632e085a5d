"""The view that a stowed fold mirror gives back is a finding of the checks."""

from __future__ import annotations

import pytest

from cad.assembly.assembly import Assembly, build_assembly
from cad.checks.clearance import stowing
from cad.checks.clearance.stowing import stowing_findings
from cad.finding import Verdict
from rigs import Rig
from rigs.mounting import StowJoint


def stowable(max_deg: float) -> Assembly:
    return build_assembly(Rig.load("aqua2").with_gaze(joints={"stow": StowJoint(max_deg=max_deg)}))


def test_a_fixed_fold_mirror_has_nothing_to_give_back(aqua2):
    assert stowing_findings(aqua2) == []


def test_a_right_angle_gives_the_whole_view_back():
    """docs/explanation/fold.md: from 75 degrees on aqua2 loses nothing."""
    (finding,) = stowing_findings(stowable(90.0))
    assert (finding.verdict, finding.figure) == (Verdict.PASSED, 0.0)


def test_what_is_lost_is_told_and_refused_above_the_limit(monkeypatch):
    """docs/explanation/fold.md: 7.7 % of aqua2's view at 45 degrees."""
    assembly = stowable(45.0)
    (finding,) = stowing_findings(assembly)
    assert finding.verdict is Verdict.PASSED
    assert finding.figure == pytest.approx(7.7, abs=0.1)
    monkeypatch.setattr(stowing, "LARGEST_LOSS", 0.07)
    (finding,) = stowing_findings(assembly)
    assert finding.verdict is Verdict.FAILED
    assert str(finding.problem).startswith("joints.stow.max_deg = 45.0: expected an angle that takes at most 7%")
