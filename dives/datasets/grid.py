"""The grid of a data set: which point of it a sample is at, and which scene that is.

Every list of the file is an axis. Sample i is at one of the N points so that of each N samples in a row each is at
another: the points are shuffled by the set's seed. Of clips, the frames of one are at the same point.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dives.datasets.distributions import Distribution
from dives.datasets.specification import DatasetSpecification
from rigs.section import Section

MOST_POINTS = 1_000_000

SHUFFLE = 1
"""Stream of the seed that shuffles the grid; samples have the seed and their number."""

SCENE_KEYS = (
    "scene.rig",
    "scene.world",
    "scene.world_seed",
    "scene.depth_m",
    "scene.water",
    "scene.cloud",
    "scene.sun.elevation_deg",
    "scene.sun.azimuth_deg",
    "scene.wind.speed_m_per_s",
    "scene.wind.azimuth_deg",
    "scene.snow",
    "target.shape",
    "target.colour",
)
"""What makes a scene, in the order in which neighbours share most of their light."""


def value_at(section: Section, key: str) -> Any:
    """Value of a dotted key of a section."""
    for name in key.split("."):
        section = getattr(section, name)
    return section


def distributions(section: Section, prefix: str = "") -> dict[str, Distribution]:
    """All that is drawn, by dotted key, in the order of the file's sections."""
    found: dict[str, Distribution] = {}
    for name in type(section).model_fields:
        value = getattr(section, name)
        if isinstance(value, Distribution):
            found[prefix + name] = value
        elif isinstance(value, Section):
            found |= distributions(value, f"{prefix}{name}.")
        elif isinstance(value, tuple) and value and isinstance(value[0], Section):
            for number, each in enumerate(value):
                found |= distributions(each, f"{prefix}{name}[{number}].")
    return found


@dataclass(frozen=True)
class Grid:
    """Points of a data set: scenes, and in each of them the lists of what else is listed.

    Attributes
    ----------
    scenes : dict of str to tuple
        Values of each axis that makes a scene, by dotted key.
    others : dict of str to tuple
        Of each other axis.
    seed : int
    """

    scenes: Mapping[str, tuple[Any, ...]]
    others: Mapping[str, tuple[Any, ...]]
    seed: int

    @classmethod
    def of(cls, spec: DatasetSpecification) -> Grid:
        """Grid of a specification; `ValueError` when nobody could count its points."""
        values = {key: value_at(spec, key) for key in SCENE_KEYS}
        listed = {key: each.grid for key, each in distributions(spec).items() if each.grid}
        grid = cls({key: each or (None,) for key, each in values.items()}, listed, spec.seed)
        if grid.points > MOST_POINTS:
            raise ValueError(f"expected lists with at most {MOST_POINTS:,} combinations, got {grid.points:,}")
        return grid

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values on each axis, those of the scenes first."""
        return tuple(len(values) for values in (*self.scenes.values(), *self.others.values()))

    @property
    def points(self) -> int:
        """Number of all combinations."""
        points = 1
        for length in self.shape:
            points *= length
        return points

    @property
    def scene_count(self) -> int:
        """Number of combinations of what makes a scene."""
        count = 1
        for values in self.scenes.values():
            count *= len(values)
        return count

    @cached_property
    def _order(self) -> NDArray[np.int64]:
        rng = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(SHUFFLE,)))
        return rng.permutation(self.points)

    def scene_of(self, clips: ArrayLike) -> NDArray[np.int64]:
        """Number of the scene of clips, by their numbers."""
        points = self._order[np.asarray(clips) % self.points]
        return np.asarray(points // (self.points // self.scene_count))

    def scene(self, number: int) -> dict[str, Any]:
        """Values of a scene by dotted key."""
        places = np.unravel_index(number, [len(values) for values in self.scenes.values()])
        return {key: values[place] for (key, values), place in zip(self.scenes.items(), places, strict=True)}

    def listed(self, clip: int) -> dict[str, Any]:
        """Values of the other axes in a clip, by dotted key."""
        places = np.unravel_index(self._order[clip % self.points], self.shape)[len(self.scenes) :]
        return {key: values[place] for (key, values), place in zip(self.others.items(), places, strict=True)}
