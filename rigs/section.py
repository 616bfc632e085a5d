"""What every section of a rig file is made of: the base class and the kinds of numbers."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, FiniteFloat, Strict, ValidationError
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


Direction = Annotated[Vector3, AfterValidator(_not_zero)]
"""A vector of any length but zero."""


class Section(BaseModel):
    """Base of every section: frozen, no unknown keys, no NaN or infinity."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @classmethod
    def errors_in_file(cls, error: ValidationError) -> list[ErrorDetails]:
        """What pydantic found wrong with a document, each at its place in the file."""
        return error.errors(include_url=False)
