"""How finely the light between surfaces is found."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray

AREA_POWER = 0.7
"""Of the area around a place, in its number of directions.

The variance of what one place receives is found to fall with its directions to the power of 3/2. For a given sum of
directions that of the light on all of a mesh, to which places add the squares of their areas, is least at the power
2 / (3/2 + 1) = 0.8, and the mean of that of the points of its surface at 1 / (3/2 + 1) = 0.4. Of 0.6, 0.7 and 0.8 an
image of aqua2 in open water (1C, overcast) has the least noise in red with this: 0.08 % of its mean, 0.28 and 0.18 with
the others, each over eight turns of the directions.
"""

MOST_OVER_FEWEST = 32
"""How many times the fewest directions a place looks out in at most: one must not take all of them."""


@dataclass(frozen=True, kw_only=True)
class LightQuality:
    """Rays, directions, points and iterations of what is found once for a scene; part of the key of what is kept.

    Attributes
    ----------
    rays, iteration_rays : int
        Of a reflection that is kept, and of those until they settle, divided among the places on the surfaces.
    fewest_directions : int
        In which a place looks out, however many there are.
    reflections : int
        Between the surfaces of a robot that are followed at most.
    settled : float
        Reflections end when one changes the light by less than this share of its mean.
    iterations : int
        Times at most that the light on a world and in the water around it are found in turn.
    iterations_settled : float
        Share by which the last iteration may change either. In turbid water each changes them by half of what the one
        before did: about that share is missing at the end.
    grid_points : int
        At most, along each axis, where the light is known that the water around a world scatters.
    sample_directions : int
        In which a point looks at the robot: this number over the robot, and again about the line of sight.
    line_points : int
        On a line of sight, between the nodes of the robot's shadow in the water.
    """

    rays: int = 1_600_000
    iteration_rays: int = 75_000
    fewest_directions: int = 24
    reflections: int = 16
    settled: float = 0.005
    iterations: int = 16
    iterations_settled: float = 0.0025
    grid_points: int = 24
    sample_directions: int = 64
    line_points: int = 2

    @classmethod
    def full(cls) -> LightQuality:
        """What images are rendered with."""
        return cls()

    @classmethod
    def draft(cls) -> LightQuality:
        """For a first look, in a tenth of the time: some per cent from full light, in the corners of a world more."""
        return cls(
            rays=160_000,
            iteration_rays=10_000,
            fewest_directions=8,
            settled=0.05,
            iterations_settled=0.05,
            grid_points=8,
            sample_directions=24,
            line_points=1,
        )

    @classmethod
    def coarse(cls) -> LightQuality:
        """Noisy light in seconds, for looks at a scene and tests of what does not depend on it."""
        return cls(
            rays=20_000, iteration_rays=5_000, fewest_directions=4, iterations=2, grid_points=6, sample_directions=4
        )

    @classmethod
    def named(cls, name: Literal["full", "draft"]) -> LightQuality:
        """Full or draft, as commands ask for it."""
        return cls.draft() if name == "draft" else cls.full()

    @property
    def name(self) -> str:
        """Such as ``draft``; of another than these three it is ``own``."""
        known = {"full": self.full(), "draft": self.draft(), "coarse": self.coarse()}
        return next((name for name, quality in known.items() if quality == self), "own")

    def directions(self, areas: FloatArray) -> NDArray[np.int64]:
        """In how many directions each of some places looks out for what is kept, given the area around each."""
        return self._shared(self.rays, areas)

    def iteration_directions(self, areas: FloatArray) -> NDArray[np.int64]:
        """In how many until the light has settled."""
        return self._shared(self.iteration_rays, areas)

    def _shared(self, rays: int, areas: FloatArray) -> NDArray[np.int64]:
        """The fewest directions or more, for each place: doubled so often that few numbers occur."""
        share = areas**AREA_POWER
        times = np.clip(rays * share / share.sum() / self.fewest_directions, 1, MOST_OVER_FEWEST)
        return np.asarray(self.fewest_directions * 2 ** np.log2(times).round(), dtype=np.int64)


def light_marks(quality: LightQuality | None) -> dict[str, str]:
    """What says of results in which light they were rendered: ``light``, and nothing where it is full (the default)."""
    return {} if quality in (None, LightQuality.full()) else {"light": quality.name}


def light_identity(quality: LightQuality | None) -> list[dict[str, Any]]:
    """What belongs of it into a digest of what images come from: its numbers, and nothing where it is full."""
    return [] if quality in (None, LightQuality.full()) else [asdict(quality)]
