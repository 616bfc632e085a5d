"""Which dives an ensemble holds: every combination of values, random points of ranges, each with every seed."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from scipy.stats import qmc

from rigs.documents.changes import with_values
from rigs.documents.toml import TomlError, parsed

SEED_KEY = "seed"
"""Of a dive's file."""

RIG_PREFIX = "rig."
"""Of keys of the rig's file, such as ``rig.image_sensor.read_noise_e``."""

LONGEST_NAME = 120
"""Longer names of members are cut; file systems take 255 bytes."""

UNSAFE = re.compile(r"[^A-Za-z0-9_.+-]")
"""What does not go into the name of a folder."""

RANGE = re.compile(r"(?P<low>[^.,\s]\S*?)\.\.(?P<high>\S+)")


@dataclass(frozen=True, kw_only=True)
class Choice:
    """A key of the dive's file and the values it takes, each with all those of the others.

    Attributes
    ----------
    key : str
        Dotted, such as ``loop.variant``.
    values : tuple
    """

    key: str
    values: tuple[Any, ...]


@dataclass(frozen=True, kw_only=True)
class Range:
    """A key of the dive's file that takes random numbers between two.

    Attributes
    ----------
    key : str
        Dotted, such as ``target.speed_m_per_s``.
    low, high : float
    """

    key: str
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class Member:
    """One dive of an ensemble.

    Attributes
    ----------
    settings : dict of str to value
        What differs from the dive's file, by dotted key; without the seed.
    seed : int
    """

    settings: dict[str, Any]
    seed: int

    @property
    def name(self) -> str:
        """Of its folder, the same whatever else is in the ensemble."""
        return folder_name(self.settings | {SEED_KEY: self.seed})

    def document(self, base: Mapping[str, Any]) -> dict[str, Any]:
        """The dive's file with the settings and the seed of this one; those of its rig are left to `rig_settings`."""
        own = {key: value for key, value in self.settings.items() if not key.startswith(RIG_PREFIX)}
        return with_values(base, own | {SEED_KEY: self.seed})

    @property
    def rig_settings(self) -> dict[str, Any]:
        """What differs from the rig's file, by dotted key."""
        return {
            key.removeprefix(RIG_PREFIX): value for key, value in self.settings.items() if key.startswith(RIG_PREFIX)
        }


def members(
    variations: Sequence[Choice | Range], *, seeds: Sequence[int], points: int = 0, points_seed: int = 0
) -> list[Member]:
    """Members of an ensemble: seeds change fastest.

    Parameters
    ----------
    variations : sequence of Choice or Range
    seeds : sequence of int
        Each setting is dived with all of them.
    points : int
        How many random points of the ranges, a Latin hypercube; each is combined with all choices.
    points_seed : int
        Of these points.

    Raises
    ------
    ValueError
        With every variation that cannot be: a key twice, no values, a range without room, ranges without points or
        points without ranges.
    """
    choices = [variation for variation in variations if isinstance(variation, Choice)]
    ranges = [variation for variation in variations if isinstance(variation, Range)]
    problems = list(_problems(choices, ranges, seeds, points))
    if problems:
        raise ValueError("; ".join(problems))
    keys = [choice.key for choice in choices]
    return [
        Member(settings=dict(zip(keys, values, strict=True)) | point, seed=seed)
        for values in product(*(choice.values for choice in choices))
        for point in _points(ranges, points, points_seed)
        for seed in seeds
    ]


def parsed_variation(text: str) -> Choice | Range:
    """Read ``key=value,value`` or ``key=low..high``; values as TOML writes them, words without quotes.

    Raises
    ------
    ValueError
        When it is neither.
    """
    key, equals, values = (part.strip() for part in text.partition("="))
    if not (key and equals and values):
        raise ValueError(f"expected KEY=VALUE,VALUE or KEY=LOW..HIGH, got {text!r}")
    span = RANGE.fullmatch(values)
    if span:
        try:
            return Range(key=key, low=float(span["low"]), high=float(span["high"]))
        except ValueError:
            raise ValueError(f"{key}: expected numbers on both sides of .., got {values!r}") from None
    try:
        return Choice(key=key, values=tuple(parsed(f"v = [{values}]")["v"]))
    except TomlError:
        return Choice(key=key, values=tuple(_value(part.strip()) for part in values.split(",")))


def parsed_setting(text: str) -> tuple[str, Any]:
    """Read ``key=value``, one value; `ValueError` for anything else."""
    variation = parsed_variation(text)
    if not isinstance(variation, Choice) or len(variation.values) != 1:
        raise ValueError(f"{text}: expected one value; `mirrorgaze ensemble --vary` takes more")
    return variation.key, variation.values[0]


def folder_name(settings: Mapping[str, Any]) -> str:
    """Name of a folder that says its settings: legible, and different for different settings."""
    plain = [(str(key), str(value)) for key, value in settings.items()]
    # Commas and equal signs part keys and values, so they cannot be in them.
    safe_parts = [(UNSAFE.sub("_", key), UNSAFE.sub("_", value)) for key, value in plain]
    safe = ",".join(f"{key}={value}" for key, value in safe_parts)
    if safe_parts == plain and len(safe) <= LONGEST_NAME:
        return safe
    digest = hashlib.sha256(json.dumps(dict(settings), default=str).encode()).hexdigest()[:8]
    return f"{safe[: LONGEST_NAME - 9]}-{digest}"


def _points(ranges: Sequence[Range], count: int, seed: int) -> list[dict[str, Any]]:
    if not ranges:
        return [{}]
    unit = qmc.LatinHypercube(len(ranges), rng=np.random.default_rng(seed)).random(count)
    low, high = (np.array([getattr(span, end) for span in ranges]) for end in ("low", "high"))
    keys = [span.key for span in ranges]
    return [dict(zip(keys, point.tolist(), strict=True)) for point in low + unit * (high - low)]


def _problems(choices: Sequence[Choice], ranges: Sequence[Range], seeds: Sequence[int], points: int) -> Iterable[str]:
    keys = [choice.key for choice in choices] + [span.key for span in ranges]
    for key in sorted({key for key in keys if keys.count(key) > 1}):
        yield f"{key}: expected one variation of a key, got {keys.count(key)}"
    if SEED_KEY in keys:
        yield f"{SEED_KEY}: expected the seeds by their own option"
    for choice in choices:
        texts = [repr(value) for value in choice.values]
        if len(set(texts)) != len(texts) or not texts:
            yield f"{choice.key}: expected one or more different values, got {', '.join(texts) or 'none'}"
    for span in ranges:
        if not (np.isfinite([span.low, span.high]).all() and span.low < span.high):
            yield f"{span.key}: expected a range from less to more, got {span.low:g}..{span.high:g}"
    if bool(ranges) != (points > 0):
        yield f"expected points for ranges and ranges for points, got {len(ranges)} ranges and {points} points"
    if not seeds or len(set(seeds)) != len(seeds) or min(seeds) < 0:
        yield f"expected one or more different seeds, none negative, got {list(seeds)}"


def _value(text: str) -> Any:
    try:
        return parsed(f"v = {text}")["v"]
    except TomlError:
        return text
