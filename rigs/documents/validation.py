"""From parsed TOML to a specification, such as a rig, or to everything that is wrong, in the words of the file."""

from __future__ import annotations

import difflib
import functools
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from pydantic import ValidationError

from rigs.documents.problems import Problem
from rigs.section import Section

Key = str | int
Keys = tuple[Key, ...]
Specified = TypeVar("Specified", bound=Section)

MOST_PROBLEMS = 100
"""Nobody reads more, and a file of a hundred thousand unknown keys has as many."""

WHOLE_FILE = "(whole file)"
"""Place of a problem that is not about one key."""

EXPECTATIONS = {
    "model_type": "a table",
    "model_attributes_type": "a table",
    "dict_type": "a table",
    "tuple_type": "a list of numbers",
    "float_type": "a number",
    "int_type": "a whole number",
    "finite_number": "a finite number",
    "string_type": "text in quotes",
    "path_type": "text in quotes",
    "string_pattern_mismatch": "lower-case letters, digits, - and _, beginning with a letter or a digit",
}
"""What pydantic's error types mean in a TOML file, where its own words would speak of Python."""

TAG_KEYS = ("model", "shape", "motion")
"""Keys that say which kind of camera, port, hull, path or motion a section describes."""


def validated(kind: type[Specified], document: Mapping[str, Any]) -> tuple[Specified | None, list[Problem]]:
    """Validate parsed TOML against a specification.

    A section is looked at as a whole only when each of its values is good. So what is wrong is reported, taken out,
    and the rest is looked at again, until nothing is left to take out.

    Returns
    -------
    specified : Section or None
        The rig (or what else is specified), when there is no problem.
    problems : list of Problem
        Every problem.
    """
    problems: dict[tuple[Keys, str], Problem] = {}
    removed: set[Keys] = set()
    rest = document
    while True:
        try:
            specified = kind.model_validate(rest)
        except ValidationError as error:
            details = [(_keys_in(rest, detail), detail) for detail in kind.errors_in_file(error)]
        else:
            break
        for keys, detail in details:
            if len(problems) == MOST_PROBLEMS:
                more = Problem(
                    place=WHOLE_FILE, value=None, expected=f"fewer problems: these are the first {MOST_PROBLEMS}"
                )
                return None, [*problems.values(), more]
            if not _follows_from(removed, keys, detail):
                problems.setdefault((keys, detail["type"]), _problem(keys, detail, rest, kind))
        wrong = {_removable(keys) for keys, detail in details if _can_go(keys, detail, rest)}
        if not wrong - removed:
            break
        rest = _without(rest, wrong)
        removed |= wrong
    return (None if problems else specified), list(problems.values())


def _problem(keys: Keys, detail: Any, document: Mapping[str, Any], kind: type[Section]) -> Problem:
    place, value, error = _dotted(keys), detail["input"], detail["type"]
    if error == "extra_forbidden":
        return Problem(place=place, value=value, expected=_known_key(keys, document, kind))
    if error == "too_long" or (error == "missing" and isinstance(detail["loc"][-1], int)):
        length = next(node["minItems"] for node in _nodes_at(keys, document, kind) if "minItems" in node)
        return Problem(place=place, value=value, expected=f"a list of {length} numbers")
    if error == "missing":
        return Problem(place=place, value=None, expected="a value, but the key is missing")
    if error.startswith("union_tag"):
        tag = str(detail["ctx"]["discriminator"]).strip("'")
        return Problem(
            place=_dotted((*keys, tag)), value=value.get(tag), expected=f"one of {_tags(keys, document, kind)}"
        )
    expected = EXPECTATIONS.get(error)
    if expected is None:
        message = detail["msg"].removeprefix("Value error, ")
        expected = message.removeprefix("Input should be ").removeprefix("expected ")
    if error.startswith(("greater_than", "less_than")):
        expected = f"a number {expected}"
    return Problem(place=place, value=value, expected=expected)


def _dotted(keys: Keys) -> str:
    steps = [f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys]
    return "".join(steps).removeprefix(".") or WHOLE_FILE


def _keys_in(document: Mapping[str, Any], detail: Any) -> Keys:
    """Where in the file an error is: pydantic's location without the tags of unions, which are not keys."""
    keys: list[Key] = []
    here: Any = document
    tags: list[Any] = []
    location = detail["loc"]
    if detail["type"] == "missing" and isinstance(location[-1], int):
        location = location[:-1]  # a list that is too short: the list is what is wrong
    for step in location:
        if step in tags:
            tags = []
            continue
        keys.append(step)
        here = _inside(here, step)
        tags = [here.get(tag) for tag in TAG_KEYS] if isinstance(here, Mapping) else []
    return tuple(keys)


def _inside(here: Any, step: Key) -> Any:
    """Value under a key of a table or at a place of a list; None where there is none."""
    if isinstance(here, Mapping):
        return here.get(str(step))
    return here[step] if isinstance(here, Sequence) and isinstance(step, int) and step < len(here) else None


def _follows_from(removed: set[Keys], keys: Keys, detail: Any) -> bool:
    """Whether an error is there only because a value was taken out: a missing key, or a default that does not fit."""
    names = [gone[-1] for gone in removed if gone[:-1] == keys]
    return keys in removed or any(str(name) in detail["msg"] for name in names)


def _can_go(keys: Keys, detail: Any, document: Mapping[str, Any]) -> bool:
    """Whether an error is about one value: a whole section stays, because others are compared with it."""
    here: Any = document
    for key in keys:
        here = _inside(here, key) if isinstance(here, Mapping) else here
    return bool(keys) and here is not None and (detail["type"] == "extra_forbidden" or not isinstance(here, Mapping))


def _removable(keys: Keys) -> Keys:
    """The key that can be taken out: of a bad entry of a list, the whole list."""
    first_index = next((position for position, key in enumerate(keys) if isinstance(key, int)), len(keys))
    return keys[:first_index]


def _without(document: Mapping[str, Any], places: set[Keys]) -> dict[str, Any]:
    pruned: dict[str, Any] = {}
    for name, value in document.items():
        inner = {keys[1:] for keys in places if keys[0] == name}
        if () in inner:
            continue
        pruned[name] = _without(value, inner) if inner else value
    return pruned


def _known_key(keys: Keys, document: Mapping[str, Any], kind: type[Section]) -> str:
    nodes = _nodes_at(keys[:-1], document, kind)
    known = sorted({name for node in nodes for name in node.get("properties", {})})
    close = difflib.get_close_matches(str(keys[-1]), known, n=1, cutoff=0.7)
    if close:
        return f"a known key; did you mean {close[0]!r}?"
    return f"one of the known keys {', '.join(known)}"


def _tags(keys: Keys, document: Mapping[str, Any], kind: type[Section]) -> str:
    fields = [field for node in _nodes_at(keys, document, kind) for field in node.get("properties", {}).values()]
    return ", ".join(sorted(repr(field["const"]) for field in fields if "const" in field))


def _nodes_at(keys: Keys, document: Mapping[str, Any], kind: type[Section]) -> list[dict[str, Any]]:
    """Parts of the JSON schema that may describe a place in the file: several where a union's tag is wrong."""
    schema = _schema(kind)
    nodes = [schema]
    here: Any = document
    for key in keys:
        here = here[key]
        inner = [
            node["items"] if isinstance(key, int) else node["properties"][key] for node in nodes if _has(node, key)
        ]
        nodes = [_resolve(node, schema) for node in inner]
        nodes = [alternative for node in nodes for alternative in _alternatives(node, schema, here)]
    return nodes


@functools.cache
def _schema(kind: type[Section]) -> dict[str, Any]:
    return kind.model_json_schema()


def _has(node: Mapping[str, Any], key: Key) -> bool:
    return "items" in node if isinstance(key, int) else key in node.get("properties", {})


def _alternatives(node: dict[str, Any], schema: dict[str, Any], value: Any) -> list[dict[str, Any]]:
    nested = node.get("oneOf") or node.get("anyOf")
    if nested is None:
        return [node]
    options = [o for option in nested for o in _alternatives(_resolve(option, schema), schema, None)]
    if isinstance(value, Mapping):
        options = [option for option in options if _tag_fits(option, value)] or options
    return options


def _tag_fits(option: dict[str, Any], value: Mapping[str, Any]) -> bool:
    tags = {name: field["const"] for name, field in option.get("properties", {}).items() if "const" in field}
    return bool(tags) and all(value.get(name) == tag for name, tag in tags.items())


def _resolve(node: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    while "$ref" in node:
        node = schema["$defs"][node["$ref"].rsplit("/", 1)[-1]]
    return node
