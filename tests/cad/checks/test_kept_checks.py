"""Checks that are kept: as they were made, and only when all is in order."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cad.assembly.assembly import Assembly
from cad.checks import kept_checks as module
from cad.checks.assembly_checks import MountChecks
from cad.checks.kept_checks import CHECKS_VERSION, kept_checks
from rigs import Problem

RECORDED_REL = 1e-5
"""Of the sum of all figures, some 20,000: two tenths of a millimetre for a gap."""


def test_kept_checks_are_what_would_be_found_today(built: Assembly, checked: MountChecks, check_recorded) -> None:
    check_recorded(
        f"checks of {built.rig.name}",
        CHECKS_VERSION,
        rel=RECORDED_REL,
        figures=np.array([finding.figure or 0.0 for finding in checked.findings]),
        limits=np.array([finding.limit or 0.0 for finding in checked.findings]),
        checks=np.array([f"{finding.check}: {finding.subject}" for finding in checked.findings]),
    )


def test_a_mount_in_order_is_checked_once(
    aqua2: Assembly, checked: MountChecks, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def counted(assembly: Assembly, **how: object) -> MountChecks:
        asked.append(assembly.rig)
        return checked

    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path))
    monkeypatch.setattr(module, "assembly_checks", counted)
    assert kept_checks(aqua2).steps is checked.steps is not None
    assert kept_checks(aqua2) == checked
    assert len(asked) == 1
    # The bed shapes no part, and is what a check holds them against.
    other = aqua2.rig.with_gaze(mount={"printer_bed_mm": (100.0, 100.0, 100.0)})
    kept_checks(replace(aqua2, rig=other))
    assert len(asked) == 2


def test_what_is_wrong_is_looked_at_again(
    aqua2: Assembly, checked: MountChecks, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = Problem(place="yoke", value=None, expected="another yoke")
    bad = MountChecks(findings=(replace(checked.findings[0], problem=problem), *checked.findings[1:]))
    found = iter([bad, checked])
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path))
    monkeypatch.setattr(module, "assembly_checks", lambda assembly, **how: next(found))
    assert kept_checks(aqua2) == bad
    assert kept_checks(aqua2) == checked
