"""What is around the robot, as commands take it: the options, and the stage they make."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from rigs import Rig
    from scenes.stage import Stage
    from scenes.sun import Sun

WorldOption = Annotated[
    str, typer.Option("--world", metavar="NAME|FILE", help="tank, reef, blue (open water), a mesh or a Mitsuba scene.")
]
TargetOption = Annotated[
    str, typer.Option("--target", metavar="NAME|FILE", help="'red ball', buoy, diver, fish, or a mesh.")
]
SeedOption = Annotated[int, typer.Option("--seed", help="Of everything random.", min=0)]
DepthOption = Annotated[float, typer.Option("--depth", metavar="M", help="Of the robot below the surface, metres.")]
WaterOption = Annotated[
    str | None, typer.Option("--water", metavar="TYPE", help="Jerlov type; the rig's own water by default.")
]
SunElevationOption = Annotated[
    float | None, typer.Option("--sun-elevation", metavar="DEG", help="Above the horizon; 60 by default.")
]
SunAzimuthOption = Annotated[
    float | None,
    typer.Option(
        "--sun-azimuth", metavar="DEG", help="To the left of the robot's bow (east to north); 120 by default."
    ),
]
DateOption = Annotated[
    str | None, typer.Option("--date", metavar="ISO", help="Time with its zone, for the sun by date and place.")
]
LatitudeOption = Annotated[float | None, typer.Option("--latitude", metavar="DEG", help="North is positive.")]
LongitudeOption = Annotated[float | None, typer.Option("--longitude", metavar="DEG", help="East is positive.")]
CloudOption = Annotated[float, typer.Option("--cloud", help="Covered share of the sky, 0 to 1.")]


@dataclass(frozen=True, kw_only=True)
class SunOptions:
    """Where the sun stands: by its angles, or by date and place; 60 degrees high without either."""

    elevation_deg: float | None = None
    azimuth_deg: float | None = None
    date: str | None = None
    latitude_deg: float | None = None
    longitude_deg: float | None = None

    def sun(self) -> Sun:
        """Sun of the options; `ValueError` for half of them, for both kinds, and for impossible ones."""
        from scenes.sun import Sun, sun_at

        angles = {"elevation_deg": self.elevation_deg, "azimuth_deg": self.azimuth_deg}
        given = {name: value for name, value in angles.items() if value is not None}
        place = {"--date": self.date, "--latitude": self.latitude_deg, "--longitude": self.longitude_deg}
        missing = [name for name, value in place.items() if value is None]
        if len(missing) == len(place):
            return Sun(**given)
        problems = []
        if given:
            problems.append("expected the sun's angles or a date and a place, got both")
        if missing:
            problems.append(f"expected all of {', '.join(place)}; missing: {', '.join(missing)}")
        if problems or self.date is None or self.latitude_deg is None or self.longitude_deg is None:
            raise ValueError("; ".join(problems))
        try:
            return sun_at(_time(self.date), latitude_deg=self.latitude_deg, longitude_deg=self.longitude_deg)
        except ImportError as error:
            raise ValueError(str(error)) from None


def _time(text: str) -> Any:
    from datetime import datetime

    try:
        return datetime.fromisoformat(text)
    except ValueError:
        raise ValueError(f"--date {text}: expected a time as 2026-03-20T12:00:00+00:00") from None


@dataclass(frozen=True, kw_only=True)
class Scenery:
    """World, water, light and target, as they are asked for; what the command does not offer keeps its default."""

    world: str
    target: str
    seed: int
    depth_m: float
    jerlov_type: str | None
    sun: SunOptions
    cloud: float
    wind_m_s: float | None
    snow: bool = False

    def stage(self, rig: Rig, *, target_m: ArrayLike | None = None) -> Stage:
        """Stage of a rig, with the target at a point of the body frame; `ValueError` with all that is wrong."""
        from scenes.problems import Problems
        from scenes.stage import TARGET_M, stage
        from scenes.waves import Wind

        problems = Problems()
        rest: dict[str, Any] = {
            "world": self.world,
            "target": self.target,
            "seed": self.seed,
            "depth_m": self.depth_m,
            "jerlov_type": self.jerlov_type,
            "cloud": self.cloud,
            "snow": self.snow,
            "target_m": TARGET_M if target_m is None else target_m,
        }
        with problems.collecting():
            sun = self.sun.sun()
        with problems.collecting():
            wind = None if self.wind_m_s is None else Wind(speed_m_s=self.wind_m_s)
        if problems.sentences:
            # What else is wrong is told together with it.
            with problems.collecting():
                stage(rig, **rest)
            problems.raise_any()
        return stage(rig, sun=sun, wind=wind, **rest)
