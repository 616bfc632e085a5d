"""The scene around the robot, as commands take it: world, water, sun, sky and sea."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from rigs import Rig
    from scenes.light.sun import Sun
    from scenes.light.waves import Wind
    from scenes.stage.scene import Scene

SCENE = "Scene options"
LIGHT = "Light options"


@dataclass(frozen=True, kw_only=True)
class SceneOptions:
    """Options of every command that renders (`mirrorgaze.option_groups`)."""

    world: Annotated[
        str,
        typer.Option(
            metavar="NAME|FILE",
            help="World: tank, reef, blue (open water), a mesh file, or a Mitsuba scene.",
            rich_help_panel=SCENE,
        ),
    ] = "tank"
    target: Annotated[
        str,
        typer.Option(
            metavar="NAME|FILE",
            help="Target: ball (a red one), buoy, diver, fish, or a mesh file.",
            rich_help_panel=SCENE,
        ),
    ] = "ball"
    depth_m: Annotated[
        float, typer.Option(help="Depth of the robot below the surface, in metres.", rich_help_panel=SCENE)
    ] = 5.0
    water: Annotated[
        str | None,
        typer.Option(
            metavar="TYPE",
            help="Jerlov type of the water, from I to 9C.",
            show_default="the rig's water",
            rich_help_panel=SCENE,
        ),
    ] = None
    snow: Annotated[bool, typer.Option("--snow", help="Add marine snow.", rich_help_panel=SCENE)] = False
    wind_m_per_s: Annotated[
        float | None,
        typer.Option(
            help="Wind speed over the sea, in metres per second; it makes waves and flicker.",
            show_default="3; 0 for the reference renderer",
            rich_help_panel=SCENE,
        ),
    ] = None
    seed: Annotated[int, typer.Option(metavar="N", help="Random seed.", min=0, rich_help_panel=SCENE)] = 0
    sun_elevation_deg: Annotated[
        float | None,
        typer.Option(help="Sun elevation above the horizon, in degrees.", show_default="60", rich_help_panel=LIGHT),
    ] = None
    sun_azimuth_deg: Annotated[
        float | None,
        typer.Option(
            help="Sun azimuth, in degrees to the left of the robot's bow (from east to north).",
            show_default="120",
            rich_help_panel=LIGHT,
        ),
    ] = None
    date: Annotated[
        str | None,
        typer.Option(
            metavar="TIME",
            help="Place the sun by this ISO 8601 time with its zone, and latitude and longitude.",
            rich_help_panel=LIGHT,
        ),
    ] = None
    latitude_deg: Annotated[
        float | None, typer.Option(help="Latitude for --date, in degrees north.", rich_help_panel=LIGHT)
    ] = None
    longitude_deg: Annotated[
        float | None, typer.Option(help="Longitude for --date, in degrees east.", rich_help_panel=LIGHT)
    ] = None
    cloud: Annotated[
        float, typer.Option(help="Cloud cover, from 0 (clear) to 1 (overcast).", rich_help_panel=LIGHT)
    ] = 0.0

    def scene(self, rig: Rig, *, target_m: ArrayLike | None = None, flat_sea: bool = False) -> Scene:
        """Scene of a rig; `ValueError` with all that is wrong.

        Parameters
        ----------
        rig : Rig
        target_m : array_like, shape (3,), optional
            Of the target, in the body frame.
        flat_sea : bool
            Without wind where none was asked for.
        """
        from scenes.stage.problems import Problems
        from scenes.stage.scene import TARGET_M, make_scene

        problems = Problems()
        rest: dict[str, Any] = {
            "world": self.world,
            "target": self.target,
            "seed": self.seed,
            "depth_m": self.depth_m,
            "jerlov_type": self.water,
            "cloud": self.cloud,
            "snow": self.snow,
            "target_m": TARGET_M if target_m is None else target_m,
        }
        with problems.collecting():
            sun = self._sun()
        with problems.collecting():
            wind = self._wind(flat_sea=flat_sea)
        if problems.sentences:
            # What else is wrong is reported together with it.
            with problems.collecting():
                make_scene(rig, **rest)
            problems.raise_any()
        return make_scene(rig, sun=sun, wind=wind, **rest)

    def _wind(self, *, flat_sea: bool) -> Wind | None:
        from scenes.light.waves import Wind

        if self.wind_m_per_s is None:
            return Wind(speed_m_per_s=0.0) if flat_sea else None
        return Wind(speed_m_per_s=self.wind_m_per_s)

    def _sun(self) -> Sun:
        """Sun by its angles, or by date and place; `ValueError` for half of them, and for both."""
        from scenes.light.sun import Sun, sun_at

        angles = {"elevation_deg": self.sun_elevation_deg, "azimuth_deg": self.sun_azimuth_deg}
        given = {name: value for name, value in angles.items() if value is not None}
        place = {"--date": self.date, "--latitude-deg": self.latitude_deg, "--longitude-deg": self.longitude_deg}
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


def _time(text: str) -> datetime:
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        raise ValueError(f"--date {text}: expected a time as 2026-03-20T12:00:00+00:00") from None
