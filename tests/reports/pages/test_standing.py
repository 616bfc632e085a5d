"""What a design is judged to be, from results that are made up."""

from types import SimpleNamespace

import pytest

from dives import Verdict
from optics.feasibility.requirements import Judged, Outcome
from reports.pages.standing import Standing, overall, standing_rows

MOUNT = SimpleNamespace(
    checks=[{"verdict": "passed"}, {"verdict": "passed"}, {"verdict": "not run"}],
    check_rows=[("clearance", "", ""), ("walls", "", "")],
    loads={"servos": [{"servo": "pan", "margin": 2.6}, {"servo": "tilt", "margin": 5.8}]},
)
PASSED = Verdict(passed=True, sentences=("held",))


def standing(dive=PASSED, *outcomes):
    requirements = [
        Judged(name=f"wish {number}", required="at least 1", achieved="2", outcome=outcome)
        for number, outcome in enumerate(outcomes)
    ]
    return Standing(
        date="2026-11-03", revision="B", rig_digest="abc", version="0", dive=dive, requirements=tuple(requirements)
    )


def test_a_design_that_passes_everything_passes():
    rows = standing_rows(standing(PASSED, Outcome.PASS), MOUNT)
    assert [(str(outcome), what) for outcome, what, _ in rows] == [
        ("pass", "mount"),
        ("pass", "torque"),
        ("pass", "dive"),
        ("pass", "wish 0"),
    ]
    assert rows[0][2] == "2 figures within their limits in 2 checks, 0 beyond"
    assert rows[1][2] == "the pan servo has 2.6 times what it needs, at least 2 required"
    assert overall(rows) == "pass"


@pytest.mark.parametrize(
    ("found", "mount", "words"),
    [
        (standing(PASSED, Outcome.FAIL, Outcome.OPEN), MOUNT, "fail (1 of 5)"),
        (standing(Verdict(passed=False, sentences=("lost",))), MOUNT, "fail (1 of 3)"),
        (standing(None, Outcome.PASS), MOUNT, "pass, as far as it was judged (1 of 4 were not)"),
        (standing(), None, "pass, as far as it was judged (1 of 2 were not)"),
    ],
)
def test_one_failure_fails_and_what_was_not_judged_is_said(found, mount, words):
    assert overall(standing_rows(found, mount)) == words


def test_a_weak_servo_fails():
    weak = SimpleNamespace(**{**vars(MOUNT), "loads": {"servos": [{"servo": "tilt", "margin": 1.9}]}})
    assert overall(standing_rows(standing(), weak)) == "fail (1 of 3)"
