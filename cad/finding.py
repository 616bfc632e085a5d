"""What one check of a mount found: a figure, its limit, where, and whether it is good."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from rigs import Problem


class Verdict(StrEnum):
    """How a check ended."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_RUN = "not run"


class Sense(StrEnum):
    """On which side of its limit a figure is good."""

    AT_LEAST = "at least"
    AT_MOST = "at most"


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One figure of one check.

    Attributes
    ----------
    check : str
        What was checked: ``clearance``, ``wall thickness``, ...
    subject : str
        Part or parts it is about.
    figure : float or None
        What was measured, in `unit`; None when nothing could be.
    unit : str
        Unit of figure and limit.
    limit : float or None
        What the figure is held against; None for a figure that is only told.
    sense : Sense
        On which side of the limit it is good.
    place : str
        Where: a point of the part, joint values.
    note : str
        What a reader should know besides.
    problem : Problem or None
        What is wrong, with the key or part to change; None when nothing is.
    ran : bool
        False when the check could not be made on this machine; the note says why.
    """

    check: str
    subject: str
    figure: float | None = None
    unit: str = ""
    limit: float | None = None
    sense: Sense = Sense.AT_LEAST
    place: str = ""
    note: str = ""
    problem: Problem | None = None
    ran: bool = True

    @property
    def verdict(self) -> Verdict:
        """Passed, failed or not run."""
        if not self.ran:
            return Verdict.NOT_RUN
        return Verdict.PASSED if self.problem is None else Verdict.FAILED

    def __str__(self) -> str:
        words = [self.subject]
        if self.figure is not None:
            words.append(f"{self.figure:.4g} {self.unit}".rstrip())
        if self.limit is not None:
            words.append(f"({self.sense} {self.limit:g})")
        text = f"{self.check}: {' '.join(words)}"
        return "; ".join([text, *filter(None, (self.place, self.note))])
