"""What is wrong with a file: every problem at once, each with its place, its value and what was expected."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

LONGEST_VALUE = 80
"""Longer values are cut when a problem is printed."""


@dataclass(frozen=True, kw_only=True)
class Problem:
    """One thing that is wrong.

    Attributes
    ----------
    place : str
        Dotted key in the file, such as ``camera.position_mm[1]``.
    value : Any
        What was found there; None when nothing was.
    expected : str
        What should have been there.
    """

    place: str
    value: Any
    expected: str

    def __str__(self) -> str:
        if self.value is None or isinstance(self.value, Mapping):
            return f"{self.place}: expected {self.expected}"
        value = repr(self.value)
        if len(value) > LONGEST_VALUE:
            value = f"{value[: LONGEST_VALUE - 3]}..."
        return f"{self.place} = {value}: expected {self.expected}"

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return asdict(self) | {"message": str(self)}


class SpecificationError(ValueError):
    """A specification that cannot be used; `problems` holds everything that is wrong with it.

    Parameters
    ----------
    source : str
        File or preset it came from.
    problems : iterable of Problem
        At least one.
    """

    def __init__(self, source: str, problems: Iterable[Problem]):
        self.source = source
        self.problems = tuple(problems)
        lines = [f"{source}: {len(self.problems)} problem{'s' if len(self.problems) != 1 else ''}"]
        super().__init__("\n  ".join(lines + [str(problem) for problem in self.problems]))

    def __reduce__(self) -> tuple[Any, ...]:
        # An exception is remade from its message alone: one that a process of a pool raised would end the pool.
        return type(self), (self.source, self.problems)


class RigError(SpecificationError):
    """A rig that cannot be used."""
