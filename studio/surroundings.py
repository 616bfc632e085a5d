"""What is around the rig in the studio: world, water, sun, and what the camera's image shows of it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Literal, get_args

if TYPE_CHECKING:
    from rigs import Rig
    from scenes.stage.scene import Scene

WORLDS = ("tank", "reef", "blue")
TARGETS = ("ball", "buoy", "diver", "fish")
RIGS_WATER = "the rig's"

Overlay = Literal["none", "regions", "labels", "distance"]
OVERLAYS: tuple[Overlay, ...] = get_args(Overlay)

OPTIONS = {
    "world": "--world",
    "target": "--target",
    "depth_m": "--depth-m",
    "water": "--water",
    "sun_elevation_deg": "--sun-elevation-deg",
    "sun_azimuth_deg": "--sun-azimuth-deg",
    "cloud": "--cloud",
}
"""Of `mirrorgaze render`, by what they set."""


@dataclass(frozen=True)
class Surroundings:
    """World and light, as `mirrorgaze render` takes them.

    Attributes
    ----------
    world, target : str
    depth_m : float
    water : str
        Jerlov type, or `RIGS_WATER`.
    sun_elevation_deg, sun_azimuth_deg : float
    cloud : float
        Covered share of the sky.
    """

    world: str = "tank"
    target: str = "ball"
    depth_m: float = 5.0
    water: str = RIGS_WATER
    sun_elevation_deg: float = 60.0
    sun_azimuth_deg: float = 120.0
    cloud: float = 0.0

    def scene(self, rig: Rig) -> Scene:
        """Scene of a rig; `ValueError` with all that is wrong."""
        # The page's process renders nothing.
        from scenes.light.sun import Sun  # noqa: PLC0415
        from scenes.stage.scene import make_scene  # noqa: PLC0415

        return make_scene(
            rig,
            world=self.world,
            target=self.target,
            depth_m=self.depth_m,
            jerlov_type=None if self.water == RIGS_WATER else self.water,
            sun=Sun(elevation_deg=self.sun_elevation_deg, azimuth_deg=self.sun_azimuth_deg),
            cloud=self.cloud,
        )

    def options(self) -> list[str]:
        """Options of `mirrorgaze render` that say the same."""
        usual = Surroundings()
        changed = (each.name for each in fields(self) if getattr(self, each.name) != getattr(usual, each.name))
        return [word for name in changed for word in (OPTIONS[name], _word(getattr(self, name)))]


def _word(value: str | float) -> str:
    return value if isinstance(value, str) else f"{value:g}"
