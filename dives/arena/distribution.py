"""Which dives the arena draws: every seed is one dive, the same on every machine.

Seeds below `FIRST_HELD_OUT_SEED` are there to work with; those from it on are for the final table alone, and nobody
looks at them before.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from dives.checks import dive_problems, instants
from dives.dive import Dive
from dives.paths import target_pose
from rigs import ImageSensorSpec, Rig
from scenes.stage.clearance import Clearance
from scenes.worlds import world_named

FIRST_HELD_OUT_SEED = 1000

STREAM = 4
"""Second number of the seed of what is drawn; the dive's own seed has others."""

MOST_ATTEMPTS = 200
"""At a path that keeps off hull, world and surface."""

DURATION_S = 36.0
"""Three times the expected search of the slowest preset: what is found at an even rate is found by then in 95 % of the
dives, 1 - exp(-3), and by twice the expected time in 86 %."""

RIGS = {"aqua2": 1, "bluerov2": 2, "torpedo": 3}
"""Presets, and of how many pixels along each axis their cameras read one: 640 x 480, 960 x 540, 426 x 320 are left.

Their gaze mirrors have about the same number of pixels then: 55,000, 50,000 and 41,000 at a level gaze.
"""


@dataclass(frozen=True, kw_only=True)
class Place:
    """A world with its water, depth and sky; there are few, so that light is found once for all dives."""

    name: str
    world: str
    depth_m: float
    jerlov_type: str
    sun_elevation_deg: float
    cloud: float = 0.0


PLACES = (
    Place(name="tank", world="tank", depth_m=3.0, jerlov_type="IB", sun_elevation_deg=60.0),
    Place(name="reef, clear", world="reef", depth_m=6.0, jerlov_type="IB", sun_elevation_deg=60.0),
    Place(name="reef, coastal", world="reef", depth_m=9.0, jerlov_type="1C", sun_elevation_deg=35.0),
    Place(name="open water, clear", world="blue", depth_m=5.0, jerlov_type="IB", sun_elevation_deg=60.0),
    Place(name="open water, deep", world="blue", depth_m=12.0, jerlov_type="II", sun_elevation_deg=45.0),
    Place(name="open water, turbid", world="blue", depth_m=3.0, jerlov_type="III", sun_elevation_deg=70.0, cloud=0.8),
)

FAMILIES = ("still", "to and fro", "circle", "spiral", "waypoints")

SPEED_M_PER_S = (0.05, 0.9)
DISTANCE_M = (1.2, 2.6)
ELEVATION_DEG = (15.0, 40.0)
"""Standard deviation and largest: who is followed swims, or is held, at about the robot's depth."""

DIAMETER_M = (0.12, 0.3)
WAYPOINTS = 6
TURN_DEG = 40.0
"""Standard deviation of the azimuth from one of them to the next."""

SHORTEST_LEG_M = 0.2

DECOYS = (0.5, 0.3, 0.2)
"""Probabilities of none, one and two things beside the target."""
DECOY_COLOURS = ("red", "red", "orange", "yellow", "blue", "black", "grey")
DECOY_SPEED_M_PER_S = 0.1

HIDDEN = 0.25
"""Share of dives in which a ball stands in the target's way at some time."""
SCREEN_DIAMETER_M = 0.4
SCREEN_AT = 0.6
"""Where it stands on the way from the robot to the target."""

SWAY_M, SWAY_DEG, SWAY_PERIOD_S = 0.06, 5.0, (4.0, 10.0)

OFF_THE_WORLD_M = 0.1
"""Of the ball's surface."""


@dataclass(frozen=True, kw_only=True)
class ArenaDive:
    """A dive of the arena.

    Attributes
    ----------
    seed : int
    dive : Dive
        Without video and functional check.
    factors : mapping of str to str
        What was drawn, by factor, each in one of a few levels.
    """

    seed: int
    dive: Dive
    factors: Mapping[str, str]


def arena_dive(seed: int) -> ArenaDive:
    """Dive of a seed; `ValueError` for a negative one."""
    if seed < 0:
        raise ValueError(f"expected a seed of 0 or more, got {seed}")
    rng = np.random.default_rng(np.random.SeedSequence((seed, STREAM)))
    place, rig = PLACES[rng.integers(len(PLACES))], list(RIGS)[rng.integers(len(RIGS))]
    family = FAMILIES[rng.integers(len(FAMILIES))]
    things, hidden = int(rng.choice(len(DECOYS), p=DECOYS)), bool(rng.random() < HIDDEN)
    # What is drawn above is kept: hulls and worlds that leave little room must not become rarer.
    for _ in range(MOST_ATTEMPTS):
        speed = float(np.exp(rng.uniform(*np.log(SPEED_M_PER_S))))
        diameter = round(float(rng.uniform(*DIAMETER_M)), 3)
        start = _direction(rng)
        decoys = [_decoy(rng, diameter) for _ in range(things)]
        document: dict[str, Any] = {
            "name": f"arena-{seed}",
            "description": f"{family} in {place.name}",
            "rig": rig,
            "world": place.world,
            "depth_m": place.depth_m,
            "jerlov_type": place.jerlov_type,
            "cloud": place.cloud,
            "sun": {"elevation_deg": place.sun_elevation_deg},
            "duration_s": DURATION_S,
            "seed": seed,
            "functional_check": False,
            "video": "none",
            "overlay": False,
            "robot": {"motion": "hover", "sway": _sway(rng)},
            "target": {"diameter_m": diameter, "path": _path(rng, family, start, speed)},
            "decoys": tuple(decoys),
        }
        dive = Dive.model_validate(document)
        if hidden:
            screen = _screen(dive, float(rng.uniform(0.3, 0.8)) * DURATION_S)
            dive = Dive.model_validate(document | {"decoys": (*decoys, screen)})
        if _keeps_off_world(dive) and not dive_problems(dive):
            factors = {
                "place": place.name,
                "rig": rig,
                "path": family,
                "speed": "still" if family == "still" else _level(speed, (0.15, 0.4), "m/s"),
                "target": _level(diameter, (0.18, 0.24), "m"),
                "start": _level(abs(start[0]), (45.0, 90.0, 135.0), "deg off the bow"),
                "red decoy": "yes" if _has_red(decoys) else "no",
                "decoys": _decoy_level(decoys),
                "screen": "yes" if hidden else "no",
            }
            return ArenaDive(seed=seed, dive=dive, factors=factors)
    raise ValueError(f"seed {seed}: expected a path with room for it within {MOST_ATTEMPTS} attempts")


def arena_rig(name: str) -> Rig:
    """Preset whose camera reads one of several pixels along each axis (`RIGS`), in the same time from top to bottom."""
    rig, skipped = Rig.load(name), RIGS[name]
    camera = rig.camera
    size = {key: getattr(camera, key) // skipped for key in ("width_px", "height_px")}
    focal = {key: getattr(camera, key) / skipped for key in ("fx_px", "fy_px")}
    # The first pixel's centre is at 0, its edge at -0.5.
    centre = {key: (getattr(camera, key) + 0.5) / skipped - 0.5 for key in ("cx_px", "cy_px")}
    sensor = rig.image_sensor or ImageSensorSpec()
    return rig.model_copy(
        update={
            "camera": camera.model_copy(update=size | focal | centre),
            "image_sensor": sensor.model_copy(update={"row_time_us": sensor.row_time_us * skipped}),
        }
    )


def _direction(rng: np.random.Generator) -> tuple[float, float, float]:
    """Azimuth and elevation, degrees, and distance from the start, metres."""
    spread, most = ELEVATION_DEG
    elevation = float(np.clip(rng.normal(0, spread), -most, most))
    return float(rng.uniform(-180, 180)), elevation, float(rng.uniform(*DISTANCE_M))


def _place(direction: tuple[float, float, float]) -> tuple[float, float, float]:
    azimuth, elevation = np.radians(direction[:2])
    x, y, z = direction[2] * np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    return round(float(x), 3), round(float(y), 3), round(float(z), 3)


def _velocity(rng: np.random.Generator, speed: float) -> tuple[float, float, float]:
    heading = rng.uniform(-np.pi, np.pi)
    along = np.array([np.cos(heading), np.sin(heading), rng.normal(0, 0.15)])
    x, y, z = (speed * along / np.linalg.norm(along)).tolist()
    return round(x, 4), round(y, 4), round(z, 4)


def _path(rng: np.random.Generator, family: str, start: tuple[float, float, float], speed: float) -> dict[str, Any]:
    azimuth, elevation, distance = start
    level, height = distance * np.cos(np.radians(elevation)), distance * np.sin(np.radians(elevation))
    turning = float(rng.choice([-1, 1]) * np.degrees(speed / level))
    if family == "still":
        return {"shape": "straight", "start_m": _place(start), "velocity_m_per_s": (0.0, 0.0, 0.0)}
    if family == "to and fro":
        ends = _place(start), _place((azimuth + float(rng.normal(0, 2 * TURN_DEG)), *_direction(rng)[1:]))
        apart = max(float(np.linalg.norm(np.subtract(*ends))), SHORTEST_LEG_M)
        legs = math.ceil(DURATION_S * speed / apart) + 1
        there_and_back = tuple(ends[number % 2] for number in range(legs + 1))
        return {"shape": "waypoints", "points_m": there_and_back, "speed_m_per_s": round(speed, 4)}
    if family == "circle":
        return {
            "shape": "circle",
            "centre_m": (0.0, 0.0, round(float(height), 3)),
            "radius_m": round(float(level), 3),
            "start_bearing_deg": round(azimuth, 2),
            "turning_deg_per_s": round(turning, 3),
        }
    if family == "spiral":
        return {
            "shape": "spiral",
            "start_radius_m": round(float(level), 3),
            "start_bearing_deg": round(azimuth, 2),
            "start_height_m": round(float(height), 3),
            "turning_deg_per_s": round(turning, 3),
            "receding_m_per_s": 0.02,
            "rising_m_per_s": round(float(rng.normal(0, 0.02)), 4),
        }
    points = [_place(start)]
    for _ in range(WAYPOINTS - 1):
        azimuth += float(rng.normal(0, TURN_DEG))
        _, elevation, distance = _direction(rng)
        points.append(_place((azimuth, elevation, distance)))
    return {"shape": "waypoints", "points_m": tuple(points), "speed_m_per_s": round(speed, 4)}


def _sway(rng: np.random.Generator) -> dict[str, Any]:
    def three(low: float, high: float) -> tuple[float, ...]:
        return tuple(np.round(rng.uniform(low, high, 3), 3).tolist())

    return {
        "amplitude_m": three(0, SWAY_M),
        "period_s": three(*SWAY_PERIOD_S),
        "turn_deg": three(0, SWAY_DEG),
        "turn_period_s": three(*SWAY_PERIOD_S),
    }


def _decoy(rng: np.random.Generator, diameter_m: float) -> dict[str, Any]:
    """A ball of another colour or the target's own, at rest or drifting."""
    ball = {
        "diameter_m": round(diameter_m * float(rng.uniform(0.6, 1.5)), 3),
        "colour": DECOY_COLOURS[rng.integers(len(DECOY_COLOURS))],
    }
    place = _place(_direction(rng))
    if rng.random() < 0.5:
        return ball | {"position_m": place}
    velocity = _velocity(rng, DECOY_SPEED_M_PER_S)
    return ball | {"path": {"shape": "straight", "start_m": place, "velocity_m_per_s": velocity}}


def _has_red(decoys: Sequence[Mapping[str, Any]]) -> bool:
    """A red ball cannot be told from the target by what one image shows: those dives are judged by themselves."""
    return any(decoy["colour"] == "red" for decoy in decoys)


def _decoy_level(decoys: Sequence[Mapping[str, Any]]) -> str:
    if not decoys:
        return "none"
    return "a red one" if _has_red(decoys) else "of other colours"


def _screen(dive: Dive, time_s: float) -> dict[str, Any]:
    """A grey ball between the start and where the target is at a time."""
    place = np.add(target_pose(dive, time_s).translation, [0.0, 0.0, dive.depth_m])
    x, y, z = np.round(SCREEN_AT * place, 3).tolist()
    return {"diameter_m": SCREEN_DIAMETER_M, "colour": "grey", "position_m": (x, y, z)}


def _keeps_off_world(dive: Dive) -> bool:
    shape_m = OFF_THE_WORLD_M + (dive.target.diameter_m or 0.0) / 2
    places = target_pose(dive, instants(dive)).translation
    return bool((_clearance(dive.world, dive.depth_m).metres(places) > shape_m).all())


@lru_cache(maxsize=len(PLACES))
def _clearance(world: str, depth_m: float) -> Clearance:
    return Clearance(world_named(world, depth_m, 0))


def _level(value: float, edges: tuple[float, ...], unit: str) -> str:
    """Name of the range between edges that a number lies in."""
    number = int(np.searchsorted(edges, value))
    if number == 0:
        return f"below {edges[0]:g} {unit}"
    if number == len(edges):
        return f"above {edges[-1]:g} {unit}"
    return f"{edges[number - 1]:g} to {edges[number]:g} {unit}"
