"""Whether a mount can be put together: a removal path for every piece and a key for every screw, at their step."""

from __future__ import annotations

from collections.abc import Sequence

from cad.checks.sequence.lines import CONTACT_LINES, LINE_MM
from cad.checks.sequence.screw_keys import KEYS_MM
from cad.checks.sequence.steps import Drive, Step
from cad.finding import Finding, Sense

PATH_CHECK = "removal path"
SCREW_CHECK = "screw access"


def sequence_findings(steps: Sequence[Step]) -> list[Finding]:
    """One finding for each step, then one for each screw."""
    findings = [_way(number, step) for number, step in enumerate(steps, 1)]
    return findings + [_screw(number, drive) for number, step in enumerate(steps, 1) for drive in step.driven]


def check_steps(steps: Sequence[Step]) -> None:
    """Raise `ValueError` where a piece has no removal path or a screw no key, with all steps and parts concerned."""
    wrong = [
        f"step {number}, {step.part}: {problem}" for number, step in enumerate(steps, 1) for problem in step.problems
    ]
    if wrong:
        raise ValueError("the mount cannot be put together:\n" + "\n".join(wrong))


def _way(number: int, step: Step) -> Finding:
    """Figure: how many pieces have no removal path."""
    turns = sum(len(move.path_m) > 1 for move in step.moves)
    return Finding(
        check=PATH_CHECK,
        subject=f"step {number}, {step.part}",
        figure=float(len(step.blocked)),
        unit="pieces without one",
        limit=0.0,
        sense=Sense.AT_MOST,
        note=f"{len(step.moves)} moves, {turns} of them round a corner; contacts narrower than "
        f"{CONTACT_LINES * LINE_MM:g} mm are fits",
        problem=step.blocked[0] if step.blocked else None,
    )


def _screw(number: int, drive: Drive) -> Finding:
    """Figure: how long the arm of the key is that gets to the head, or 0."""
    _, long, short = KEYS_MM[drive.screw.thread_mm]
    return Finding(
        check=SCREW_CHECK,
        subject=drive.screw.name,
        figure=(long, short, 0.0)[len(drive.hit)],
        unit="mm",
        limit=short,
        place=f"step {number}",
        note="; ".join(f"{end} hits {others}" for end, others in drive.hit.items()),
        problem=drive.problem,
    )
