"""What becomes of a case, and the count of all."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

SLOW_S = 5.0
"""Of processor time: how busy the machine is does not count."""

TOLD = 20
"""How many cases that went wrong are kept with their stories."""


class LostError(Exception):
    """A result that is wrong, gone, or another one than without the attack, and nobody said so."""


class RefusedError(Exception):
    """Problems that a command would tell, in its words."""


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What became of a case.

    Attributes
    ----------
    outcome : str
        "through", "refused" (with a sentence), "traceback" (a mistake of ours) or "lost".
    spent_s : float
        Processor time.
    story : str
        What was said; of a mistake its traceback.
    """

    outcome: str
    spent_s: float
    story: str = ""


@dataclass
class Tally:
    """Counts of an attack's cases."""

    name: str
    tried: int = 0
    refused: int = 0
    through: int = 0
    tracebacks: int = 0
    lost: int = 0
    slow: int = 0
    slowest_s: float = 0.0
    stories: list[str] = field(default_factory=list)

    def add(self, case: str, verdict: Verdict) -> None:
        """Count a case, and keep its story when it went wrong."""
        count = "tracebacks" if verdict.outcome == "traceback" else verdict.outcome
        self.tried += 1
        setattr(self, count, getattr(self, count) + 1)
        is_slow = verdict.spent_s > SLOW_S
        self.slow += is_slow
        self.slowest_s = max(self.slowest_s, verdict.spent_s)
        if (is_slow or verdict.outcome in ("traceback", "lost")) and len(self.stories) < TOLD:
            self.stories.append(f"{case}: {verdict.outcome} in {verdict.spent_s:.1f} s: {verdict.story}")

    @property
    def held(self) -> bool:
        """Whether nothing was lost, no mistake of ours showed, and none was slow."""
        return self.tracebacks == self.lost == self.slow == 0

    def as_dict(self) -> dict[str, Any]:
        """For machines."""
        return {**asdict(self), "held": self.held}


def judged(case: Callable[[], None]) -> Verdict:
    """Run a case, by the rules that the command line has for what it raises."""
    # The attack's own process begins before anything of ours is loaded.
    from optics.kernels.faults import Fault, fault_of, sentence_of

    start = time.process_time()
    outcome, story = "through", ""
    try:
        case()
    except LostError as error:
        outcome, story = "lost", str(error)
    except RefusedError as error:
        outcome, story = "refused", str(error)
    except Exception as error:
        if fault_of(error) is Fault.BUG:
            outcome, story = "traceback", "".join(traceback.format_exception(error))
        else:
            outcome, story = "refused", sentence_of(error)
    if outcome == "refused" and not story.strip():
        outcome, story = "lost", "refused without a word"
    return Verdict(outcome=outcome, spent_s=time.process_time() - start, story=story)
