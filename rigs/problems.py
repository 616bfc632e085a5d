"""What is wrong with a rig file: every problem at once, each with its place, its value and what was expected."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationError


LONGEST_VALUE = 80
"""Longer values (whole tables) are cut when a problem is printed."""


@dataclass(frozen=True, kw_only=True)
class Problem:
    """One thing that is wrong: the dotted key, the value found there, and what was expected instead."""

    place: str
    value: Any
    expected: str

    def __str__(self) -> str:
        value = repr(self.value)
        if len(value) > LONGEST_VALUE:
            value = f"{value[: LONGEST_VALUE - 3]}..."
        return f"{self.place} = {value}: expected {self.expected}"


class RigError(ValueError):
    """A rig that cannot be used; `problems` holds everything that is wrong with it.

    Parameters
    ----------
    source : str
        File or preset the rig came from.
    problems : iterable of Problem
        At least one.
    """

    def __init__(self, source: str, problems: Iterable[Problem]):
        self.source = source
        self.problems = tuple(problems)
        lines = [f"{source}: {len(self.problems)} problem{'s' if len(self.problems) != 1 else ''}"]
        super().__init__("\n  ".join(lines + [str(problem) for problem in self.problems]))


def problems_from_validation(
    error: ValidationError, document: Mapping[str, Any], model: type[BaseModel]
) -> list[Problem]:
    """Turn what pydantic found into problems, with a suggestion for every unknown key."""
    return [_problem(detail, document, model) for detail in error.errors(include_url=False)]


def _problem(detail: Any, document: Mapping[str, Any], model: type[BaseModel]) -> Problem:
    keys = _keys_in_document(detail["loc"], document)
    place = ".".join(str(key) for key in keys) or "(whole file)"
    value = detail["input"]
    if detail["type"] == "extra_forbidden":
        return Problem(place=place, value=value, expected=_known_keys(keys, document, model))
    if detail["type"] == "missing":
        return Problem(place=place, value=None, expected="a value, but the key is missing")
    if detail["type"].startswith("union_tag"):
        tag = str(detail["ctx"]["discriminator"]).strip("'")
        choices = detail["ctx"].get("expected_tags") or ", ".join(_tags(keys, document, model))
        return Problem(place=f"{place}.{tag}", value=value.get(tag), expected=f"one of {choices}")
    message = detail["msg"].removeprefix("Value error, ")
    expected = message.removeprefix("Input should be ").removeprefix("expected ")
    if detail["type"].startswith(("greater_than", "less_than")):
        expected = f"a number {expected}"
    return Problem(place=place, value=value, expected=expected)


def _tags(keys: list[Any], document: Mapping[str, Any], model: type[BaseModel]) -> list[str]:
    nodes = _nodes_at(keys, document, model)
    return sorted(repr(field["const"]) for n in nodes for field in n.get("properties", {}).values() if "const" in field)


def _keys_in_document(location: tuple[Any, ...], document: Mapping[str, Any]) -> list[Any]:
    """Drop from pydantic's location the tags of discriminated unions: they are not keys of the file."""
    keys: list[Any] = []
    here: Any = document
    for position, step in enumerate(location):
        last = position == len(location) - 1
        if isinstance(here, Mapping) and (step in here or last):
            keys.append(step)
            here = here.get(step)
        elif isinstance(here, list) and isinstance(step, int):
            keys.append(step)
            here = here[step] if step < len(here) else None
    return keys


def _known_keys(keys: list[Any], document: Mapping[str, Any], model: type[BaseModel]) -> str:
    known = sorted(_fields_at(keys[:-1], document, model))
    close = difflib.get_close_matches(str(keys[-1]), known, n=1, cutoff=0.5)
    if close:
        return f"a known key; did you mean {close[0]!r}?"
    return f"one of the known keys {', '.join(known)}"


def _fields_at(keys: list[Any], document: Mapping[str, Any], model: type[BaseModel]) -> set[str]:
    """Names of the fields that may stand at a place in the file, over all alternatives that fit it."""
    return {name for node in _nodes_at(keys, document, model) for name in node.get("properties", {})}


def _nodes_at(keys: list[Any], document: Mapping[str, Any], model: type[BaseModel]) -> list[dict[str, Any]]:
    schema = model.model_json_schema()
    nodes = [schema]
    here: Any = document
    for key in keys:
        here = here[key]
        nodes = [_resolve(node["properties"][key], schema) for node in nodes if key in node.get("properties", {})]
        nodes = [alternative for node in nodes for alternative in _alternatives(node, schema, here)]
    return nodes


def _alternatives(node: dict[str, Any], schema: dict[str, Any], value: Any) -> list[dict[str, Any]]:
    nested = node.get("oneOf") or node.get("anyOf")
    if nested is None:
        return [node]
    options = [o for option in nested for o in _alternatives(_resolve(option, schema), schema, None)]
    if isinstance(value, Mapping):
        tagged = [option for option in options if _tag_fits(option, value)]
        options = tagged or options
    return options


def _tag_fits(option: dict[str, Any], value: Mapping[str, Any]) -> bool:
    tags = {name: field["const"] for name, field in option.get("properties", {}).items() if "const" in field}
    return bool(tags) and all(value.get(name) == tag for name, tag in tags.items())


def _resolve(node: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    while "$ref" in node:
        node = schema["$defs"][node["$ref"].rsplit("/", 1)[-1]]
    return node
