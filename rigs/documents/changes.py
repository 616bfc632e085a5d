"""Values of a document changed by name, and a TOML file brought up to date with its comments kept."""

from __future__ import annotations

import copy
from collections.abc import Mapping, MutableMapping
from typing import Any

ARGUMENT = "__"
"""Between table and key in the name of an argument: Python's names have no dots."""


def with_values(document: Mapping[str, Any], changes: Mapping[str, Any], separator: str = ".") -> dict[str, Any]:
    """Copy of a document with the values of keys such as ``gaze_mirror.width_mm`` replaced, added, or, by None, gone.

    Raises
    ------
    ValueError
        When a name leads through something that is no table.
    """
    changed = copy.deepcopy(dict(document))
    for name, value in changes.items():
        *tables, key = name.split(separator)
        place: Any = changed
        for table in tables:
            place = place.setdefault(table, {})
            if not isinstance(place, dict):
                raise ValueError(f"{name}: expected a table at {table!r}, got {place!r}")
        if value is None:
            place.pop(key, None)
        else:
            place[key] = copy.deepcopy(value)
    return changed


def bring_up_to_date(document: MutableMapping[str, Any], before: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    """Change what differs between two sets of values in the document that said the first; all else stays as written."""
    for key in before.keys() - now.keys():
        document.pop(key, None)
    for key, value in now.items():
        old = before.get(key)
        if value == old:
            continue
        if isinstance(value, Mapping) and isinstance(old, Mapping) and isinstance(document.get(key), MutableMapping):
            bring_up_to_date(document[key], old, value)
        else:
            document[key] = value
