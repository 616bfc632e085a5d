"""What a key of a data set's file may be: one value, a list, a range, or a table that says how it is drawn.

A list is an axis of the set's grid: each of its values comes with all those of the other lists. What is drawn is drawn
again for every sample. A range is written as those of ensembles are (`dives.ensembles.members`): ``"-60..60"``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import Field, GetCoreSchemaHandler, TypeAdapter, ValidationError, model_validator
from pydantic_core import core_schema

from dives.ensembles.members import RANGE
from rigs.section import NotNegative, Number, Positive, Section

WAYS = 'a number, a list of numbers, a range "low..high", or a table (low and high, mean and deviation, or values)'

MOST_REDRAWS = 1000
"""Of a number outside its limits."""


class Distribution(ABC):
    """How the values of a key are spread over samples."""

    grid: tuple[Any, ...] = ()
    """Values of an axis of the grid; empty for what is drawn."""

    @abstractmethod
    def draw(self, rng: np.random.Generator) -> Any:
        """One value."""

    @abstractmethod
    def ends(self) -> tuple[float, float]:
        """Lowest and highest number that may be drawn."""

    def all_values(self) -> tuple[float, ...] | None:
        """All numbers that may come; None where they are without end."""
        return None

    @abstractmethod
    def document(self) -> Any:
        """As a file says it."""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        as_in_file = core_schema.plain_serializer_function_ser_schema(cls.document)
        return core_schema.is_instance_schema(cls, serialization=as_in_file)


class Fixed(Distribution):
    """One value."""

    def __init__(self, value: float):
        self.value = value

    def draw(self, rng: np.random.Generator) -> float:
        """The value; nothing is drawn."""
        return self.value

    def all_values(self) -> tuple[float, ...]:
        """The value."""
        return (self.value,)

    def ends(self) -> tuple[float, float]:
        """The value twice."""
        return self.value, self.value

    def document(self) -> float:
        """The value."""
        return self.value


class Listed(Distribution):
    """Values of an axis of the grid."""

    def __init__(self, values: tuple[float, ...]):
        self.grid = values

    def draw(self, rng: np.random.Generator) -> float:
        """Never: the grid says which it is."""
        raise NotImplementedError

    def all_values(self) -> tuple[float, ...]:
        """The values."""
        return self.grid

    def ends(self) -> tuple[float, float]:
        """Smallest and largest."""
        return min(self.grid), max(self.grid)

    def document(self) -> list[float]:
        """The values."""
        return list(self.grid)


class Table(Section, Distribution):
    """What a table says."""

    def document(self) -> dict[str, Any]:
        """The table."""
        return self.model_dump(mode="json")


class Uniform(Table):
    """Evenly spread between two numbers, or with `log` the logarithm is."""

    low: Number
    high: Number
    log: bool = False

    @model_validator(mode="after")
    def _is_a_range(self) -> Uniform:
        if not self.low < self.high:
            raise ValueError(f"expected low < high, got {self.low:g} and {self.high:g}")
        if self.log and self.low <= 0:
            raise ValueError(f"expected low > 0 with log = true, got {self.low:g}")
        return self

    def draw(self, rng: np.random.Generator) -> float:
        """A number between the two."""
        if self.log:
            return float(np.exp(rng.uniform(np.log(self.low), np.log(self.high))))
        return float(rng.uniform(self.low, self.high))

    def ends(self) -> tuple[float, float]:
        """The two numbers."""
        return self.low, self.high


class Normal(Table):
    """Spread normally about a mean; what is outside the limits is drawn again."""

    mean: Number
    deviation: Positive
    low: Number
    high: Number

    @model_validator(mode="after")
    def _mean_is_inside(self) -> Normal:
        if not self.low <= self.mean <= self.high:
            raise ValueError(f"expected low <= mean <= high, got {self.low:g}, {self.mean:g}, {self.high:g}")
        return self

    def draw(self, rng: np.random.Generator) -> float:
        """A number between the limits."""
        for _ in range(MOST_REDRAWS):
            value = float(rng.normal(self.mean, self.deviation))
            if self.low <= value <= self.high:
                return value
        return self.mean

    def ends(self) -> tuple[float, float]:
        """The limits."""
        return self.low, self.high


class Weighted(Table):
    """Some numbers, each with its weight."""

    values: Annotated[tuple[Number, ...], Field(min_length=1)]
    weights: tuple[NotNegative, ...]

    @model_validator(mode="after")
    def _each_has_a_weight(self) -> Weighted:
        if len(self.values) != len(self.weights) or not sum(self.weights) > 0:
            raise ValueError(f"expected a weight for each of {len(self.values)} values, not all 0, got {self.weights}")
        return self

    def draw(self, rng: np.random.Generator) -> float:
        """One of them."""
        return self.values[int(rng.choice(len(self.values), p=np.divide(self.weights, sum(self.weights))))]

    def all_values(self) -> tuple[float, ...]:
        """The values."""
        return self.values

    def ends(self) -> tuple[float, float]:
        """Smallest and largest."""
        return min(self.values), max(self.values)


@dataclass(frozen=True)
class Drawn:
    """Marks a key whose numbers are spread over samples, and lie between two, the two included."""

    low: float = -np.inf
    high: float = np.inf

    def read(self, value: Any) -> Distribution:
        """Distribution that a file says; `ValueError` when it is none, or reaches beyond the ends."""
        found = _read(value)
        lowest, highest = found.ends()
        if not self.low <= lowest <= highest <= self.high:
            raise ValueError(f"expected numbers from {self.low:g} to {self.high:g}, or ranges of them")
        return found

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_before_validator_function(
            self.read,
            handler(source),
            json_schema_input_schema=handler.generate_schema(Accepted),
        )


Accepted = Number | Annotated[list[Number], Field(min_length=1)] | str | Uniform | Normal | Weighted

_NUMBER, _NUMBERS = TypeAdapter(Number), TypeAdapter(Annotated[tuple[Number, ...], Field(min_length=1)])


def _read(value: Any) -> Distribution:
    if isinstance(value, Distribution):
        return value
    try:
        if isinstance(value, Mapping):
            kind = Normal if "mean" in value else Weighted if "values" in value else Uniform
            return kind.model_validate(value)
        if isinstance(value, str):
            return _range(value)
        if isinstance(value, list | tuple):
            return Listed(_different(_NUMBERS.validate_python(tuple(value))))
        return Fixed(_NUMBER.validate_python(value))
    except ValidationError as error:
        raise ValueError(f"expected {WAYS}{_said(error)}") from None


def _range(text: str) -> Uniform:
    span = RANGE.fullmatch(text.strip())
    try:
        ends = (float(span["low"]), float(span["high"])) if span else None
    except ValueError:
        ends = None
    if ends is None:
        raise ValueError(f"expected {WAYS}")
    return Uniform(low=ends[0], high=ends[1])


def _different(values: tuple[float, ...]) -> tuple[float, ...]:
    if len(set(values)) != len(values):
        raise ValueError("expected a list of different numbers")
    return values


def _said(error: ValidationError) -> str:
    """What is wrong inside a table, in brackets; nothing for what is no table."""
    details = [
        f"{'.'.join(map(str, detail['loc']))}: {detail['msg'].removeprefix('Value error, ')}"
        if detail["loc"]
        else detail["msg"].removeprefix("Value error, ")
        for detail in error.errors(include_url=False)
    ]
    return f" ({'; '.join(details)})"
