"""What every section of a rig file is made of: the base class and the kinds of numbers."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    Strict,
    ValidationError,
    ValidationInfo,
    field_validator,
)
from pydantic_core import ErrorDetails

# Strict: TOML has types of its own, so "640" and true are mistakes, not numbers.
Number = Annotated[FiniteFloat, Strict()]
Whole = Annotated[int, Strict()]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
Vector3 = tuple[Number, Number, Number]


def _not_zero(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    if vector == (0.0, 0.0, 0.0):
        raise ValueError("expected a direction, got three zeros")
    return vector


def _check_measure(value: Any) -> None:
    if isinstance(value, tuple):
        for each in value:
            _check_measure(each)
    elif isinstance(value, float) and abs(value) > LARGEST_NUMBER:
        raise ValueError(f"expected a number from {-LARGEST_NUMBER:,.0f} to {LARGEST_NUMBER:,.0f}")
    elif isinstance(value, float) and 0 < abs(value) < SMALLEST_NUMBER:
        raise ValueError(f"expected 0, or a number of at least {SMALLEST_NUMBER:g} in size")
    elif isinstance(value, int) and abs(value) > LARGEST_WHOLE:
        raise ValueError(f"expected a whole number of at most {LARGEST_WHOLE}")


Direction = Annotated[Vector3, AfterValidator(_not_zero)]
"""A vector of any length but zero."""


LARGEST_NUMBER = 1e6
"""A kilometre in millimetres; no angle, time, luminous flux or price of a part is larger."""

SMALLEST_NUMBER = 1e-30
"""But for zero: what is divided by a smaller one may be no number any more."""

LARGEST_WHOLE = 2**63 - 1
"""Seeds are the largest whole numbers, and this is the largest that kernels count with."""

CLOCK_TIMES = frozenset({"start_s"})
"""Times of a file's own clock, which may count from 1970."""


class Section(BaseModel):
    """Base of every section: frozen, no unknown keys, no NaN or infinity, no number beyond all measure."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @field_validator("*")
    @classmethod
    def _is_within_measure(cls, value: Any, info: ValidationInfo) -> Any:
        if info.field_name not in CLOCK_TIMES:
            _check_measure(value)
        return value

    @classmethod
    def errors_in_file(cls, error: ValidationError) -> list[ErrorDetails]:
        """What pydantic found wrong with a document, each at its place in the file."""
        return error.errors(include_url=False)
