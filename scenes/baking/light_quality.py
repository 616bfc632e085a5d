"""How finely the light between surfaces is found."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal


@dataclass(frozen=True, kw_only=True)
class LightQuality:
    """Rays, directions, points and iterations of what is found once for a scene; part of the key of what is kept.

    Attributes
    ----------
    rays, iteration_rays : int
        Of a reflection that is kept, and of those until they settle, divided among the places on the surfaces.
    fewest_directions, most_directions : int
        In which a place looks out.
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

    rays: int = 4_000_000
    iteration_rays: int = 150_000
    fewest_directions: int = 24
    most_directions: int = 96
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
            rays=400_000,
            iteration_rays=50_000,
            fewest_directions=8,
            most_directions=24,
            settled=0.05,
            iterations_settled=0.05,
            grid_points=8,
            sample_directions=24,
            line_points=1,
        )

    @classmethod
    def coarse(cls) -> LightQuality:
        """Noisy light in seconds, for looks at a scene and tests of what does not depend on it."""
        return cls(fewest_directions=4, most_directions=4, iterations=2, grid_points=6, sample_directions=4)

    @classmethod
    def named(cls, name: Literal["full", "draft"]) -> LightQuality:
        """Full or draft, as commands ask for it."""
        return cls.draft() if name == "draft" else cls.full()

    @property
    def name(self) -> str:
        """Such as ``draft``; of another than these three it is ``own``."""
        known = {"full": self.full(), "draft": self.draft(), "coarse": self.coarse()}
        return next((name for name, quality in known.items() if quality == self), "own")

    def directions(self, places: int) -> int:
        """In how many each of some places looks out for what is kept."""
        return self._shared(self.rays, places)

    def iteration_directions(self, places: int) -> int:
        """In how many until the light has settled."""
        return self._shared(self.iteration_rays, places)

    def _shared(self, rays: int, places: int) -> int:
        return min(max(rays // places, self.fewest_directions), self.most_directions)


def light_marks(quality: LightQuality | None) -> dict[str, str]:
    """What says of results in which light they were rendered: ``light``, and nothing where it is full (the default)."""
    return {} if quality in (None, LightQuality.full()) else {"light": quality.name}


def light_identity(quality: LightQuality | None) -> list[dict[str, Any]]:
    """What belongs of it into a digest of what images come from: its numbers, and nothing where it is full."""
    return [] if quality in (None, LightQuality.full()) else [asdict(quality)]
