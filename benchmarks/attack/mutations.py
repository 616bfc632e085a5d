"""Damage, drawn by seed: to documents, to text, to bytes."""

from __future__ import annotations

import copy
import json
import math
import random
from collections.abc import Sequence
from typing import Any

MOST_CHANGES = 4

NUMBERS = (
    *(0, -1, 1, 7, 10**6, 10**12, -(10**12), 10**40, 2**63),
    *(0.0, -0.0, 0.5, 1e-9, 1e-300, 5e-324, 1e9, 1e12, 1e300, -1e300, math.inf, -math.inf, math.nan),
)
TEXTS = ("", " ", "red", "../../x", "/", "/dev/null", "\0", "é\u202e🙂", "a" * 2000, "-1", "nan", "\n", "%s{}$(x)")
STRANGE: tuple[Any, ...] = (True, False, [], [[]], {}, {"x": 1}, [1, "two", [3.0]], [0.0] * 3, [math.nan] * 3)
FACTORS = (0.0, 0.01, 0.3, 0.8, 1.2, 3.0, 100.0, -1.0, 1e6)
SEGMENTS = (
    b"\0",
    b"\n",
    b"\xff\xfe",
    b"[[",
    b"]",
    b"= =",
    b"nan",
    b"-1",
    b"1e999",
    b'"""',
    b"#",
    b"{",
    b"\r",
    b",,",
    b"'",
)

Keys = tuple[Any, ...]


def damaged_document(document: dict[str, Any], rng: random.Random) -> dict[str, Any]:
    """A document with a few keys gone, added, or of other values."""
    damaged = copy.deepcopy(document)
    for _ in range(rng.randint(1, MOST_CHANGES)):
        places = list(_places(damaged))
        if not places:
            break
        _change(damaged, rng.choice(places), rng)
    return damaged


def damaged_bytes(content: bytes, rng: random.Random) -> bytes:
    """Bytes cut, flipped, doubled, taken out, or with others in between; at times none, or all of them others."""
    changed = bytearray(content)
    for _ in range(rng.randint(1, MOST_CHANGES)):
        start, end = sorted(rng.randrange(len(changed) + 1) for _ in range(2))
        end = min(end, start + rng.choice((1, 8, 100, 5000)))
        match rng.randrange(7):
            case 0:
                del changed[start:]
            case 1 if changed:
                at = rng.randrange(len(changed))
                changed[at] ^= 1 << rng.randrange(8)
            case 2:
                changed[start:start] = changed[start:end]
            case 3:
                del changed[start:end]
            case 4:
                changed[start:start] = rng.choice(SEGMENTS)
            case 5:
                changed[start:end] = rng.randbytes(end - start)
            case _:
                lines = bytes(changed).split(b"\n")
                rng.shuffle(lines if len(lines) < 50 else lines[:50])
                changed = bytearray(b"\n".join(lines))
    return rng.choice((b"", rng.randbytes(64), b"\0" * 64)) if rng.random() < 0.01 else bytes(changed)


def toml_text(document: dict[str, Any]) -> str:
    """A document as TOML, each top-level table on one line."""
    return "".join(f"{_key(key)} = {_value(value)}\n" for key, value in document.items())


def _places(value: Any, keys: Keys = ()) -> Any:
    """Keys of each value in a document, from its top."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, each in items:
        yield (*keys, key)
        yield from _places(each, (*keys, key))


def _change(document: dict[str, Any], keys: Keys, rng: random.Random) -> None:
    table = document
    for key in keys[:-1]:
        table = table[key]
    key, value = keys[-1], table[keys[-1]]
    match rng.randrange(8):
        case 0:
            del table[key]
        case 1 if isinstance(table, dict):
            table[rng.choice((f"{key}x", "", "é", "gaze", "file", str(key).upper()))] = copy.deepcopy(value)
        case 2:
            table[key] = rng.choice(TEXTS)
        case 3:
            table[key] = copy.deepcopy(rng.choice(STRANGE))
        case 4 if isinstance(value, list):
            table[key] = [*value, *value] if rng.random() < 0.5 else value[: rng.randrange(len(value) + 1)]
        case 5 | 6 if _is_number(value):
            table[key] = value * rng.choice(FACTORS) if rng.random() < 0.5 else value * rng.uniform(0.5, 2.0)
        case _:
            table[key] = rng.choice(NUMBERS)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _key(key: Any) -> str:
    return json.dumps(str(key), ensure_ascii=False)


def _value(value: Any) -> str:
    match value:
        case bool():
            return str(value).lower()
        case str():
            return _key(value)
        case int() | float():
            return repr(value)
        case dict():
            return "{" + ", ".join(f"{_key(key)} = {_value(each)}" for key, each in value.items()) + "}"
        case Sequence():
            return "[" + ", ".join(map(_value, value)) + "]"
        case _:
            return _key(str(value))
