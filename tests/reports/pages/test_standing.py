"""What a design is judged to be, from results that are made up."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from cad.export.printing.prints import PlatePrint, Prints
from dives import Verdict
from optics.feasibility.requirements import Judged, Outcome
from reports.pages.standing import Standing, overall, standing_rows
from reports.pages.tolerance import ToleranceResults

PLATE = PlatePrint(parts=(), time_s=1800, plastic_g=60, warnings=())
TOLERANCE = ToleranceResults(
    samples=9,
    built_deg={},
    calibrated_deg={},
    built_rms_deg=2.0,
    calibrated_rms_deg=0.9,
    ranking=(),
    figure="tolerance/tolerances.png",
)
MOUNT = SimpleNamespace(
    checks=[{"verdict": "passed"}, {"verdict": "passed"}, {"verdict": "not run"}],
    check_rows=[("clearance", "", ""), ("walls", "", "")],
    prints=Prints(sliced=True, parts=(), plates=(PLATE, PLATE)),
    loads={"servos": [{"servo": "pan", "margin": 2.6}, {"servo": "tilt", "margin": 5.8}]},
)
PASSED = Verdict(passed=True, sentences=("held",))


def standing(dive=PASSED, *outcomes):
    requirements = [
        Judged(name=f"wish {number}", required="at least 1", achieved="2", outcome=outcome)
        for number, outcome in enumerate(outcomes)
    ]
    return Standing(
        date="2026-11-03",
        revision="B",
        rig_digest="abc",
        version="0",
        dive=dive,
        gaze_error_limit_deg=1.0,
        requirements=tuple(requirements),
    )


def test_a_design_that_passes_everything_passes():
    rows = standing_rows(standing(PASSED, Outcome.PASS), MOUNT, TOLERANCE)
    assert [(str(outcome), what) for outcome, what, _ in rows] == [
        ("pass", "mount"),
        ("pass", "torque"),
        ("pass", "prints"),
        ("pass", "tolerance"),
        ("pass", "dive"),
        ("pass", "wish 0"),
    ]
    assert rows[0][2] == "2 figures within their limits in 2 checks, 0 beyond"
    assert rows[1][2] == "the pan servo has 2.6 times what it needs, at least 2 required"
    assert overall(rows) == "pass"


@pytest.mark.parametrize(
    ("found", "mount", "words"),
    [
        (standing(PASSED, Outcome.FAIL, Outcome.OPEN), MOUNT, "fail (1 of 7)"),
        (standing(Verdict(passed=False, sentences=("lost",))), MOUNT, "fail (1 of 5)"),
        (standing(None, Outcome.PASS), MOUNT, "pass, as far as it was judged (1 of 6 were not)"),
        (standing(), None, "pass, as far as it was judged (1 of 3 were not)"),
    ],
)
def test_one_failure_fails_and_what_was_not_judged_is_said(found, mount, words):
    assert overall(standing_rows(found, mount, TOLERANCE)) == words


def test_a_weak_servo_fails():
    weak = SimpleNamespace(**{**vars(MOUNT), "loads": {"servos": [{"servo": "tilt", "margin": 1.9}]}})
    assert overall(standing_rows(standing(), weak, TOLERANCE)) == "fail (1 of 5)"


def row_of(what, mount=MOUNT, tolerance=TOLERANCE, **changes):
    rows = standing_rows(replace(standing(), **changes), mount, tolerance)
    return next(row for row in rows if row[1] == what)


def test_hours_that_no_slicer_told_are_not_judged_and_warnings_fail():
    def row(prints):
        return row_of("prints", SimpleNamespace(**{**vars(MOUNT), "prints": prints}))

    warned = replace(PLATE, warnings=("Empty layer.",))
    assert row(Prints(sliced=True, parts=(), plates=(warned, PLATE)))[0] is Outcome.FAIL
    outcome, _, words = row(Prints(sliced=False, parts=(), plates=(PLATE, PLATE)))
    assert outcome is Outcome.OPEN
    assert words == "2 plates, 1.0 h, 120 g with supports, by an estimate that is within 23%; no slicer here"


def test_tolerances_are_judged_by_what_the_rig_requires():
    assert row_of("tolerance")[0] is Outcome.PASS
    assert row_of("tolerance", gaze_error_limit_deg=0.8)[0] is Outcome.FAIL
    assert row_of("tolerance", gaze_error_limit_deg=None)[0] is Outcome.OPEN
    assert row_of("tolerance", tolerance=None)[0] is Outcome.OPEN
