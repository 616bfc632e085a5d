"""Coral reef around the robot: terrain with growths of several forms and colours, from a seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from optics.kernels.arrays import FloatArray
from scenes.light.materials import Material
from scenes.surfaces.poisson_disk import spaced
from scenes.surfaces.shapes import perpendicular_axes
from scenes.surfaces.surface import Surface, surface
from scenes.worlds.growths import ball_sponge, bush, dome, fan, rock, staghorn, table, tube_sponge
from scenes.worlds.terrain import BRIGHTEST, RADIUS_M, Terrain, terrain
from scenes.worlds.world import World, world_of

BOTTOM_BELOW_ROBOT_M = 2.0
CEILING_BELOW_SURFACE_M = 0.3
FREE_RADIUS_M = 1.6
"""Nothing comes nearer to the robot's origin; the bottom below it is 2 m away."""

ARENA_RADIUS_M, ARENA_FLOOR_M = 3.2, 0.75
"""Around the robot, nothing stands higher over the bottom than this: room for a target and for the robot."""

REEF_VERSION = 1
"""Raised when a reef of the same depth and seed comes out otherwise."""

CURRENT = np.array([0.8, 0.6, 0.0])
"""Where the sea comes from, along a ridge's normal."""

CANDIDATES = 690
PROTOTYPES = 3
"""Of each form and level of detail."""
DETAIL_WITHIN_M = (7.5, 4.5)
"""Distances from the robot within which things are made in the middle and in the finest level of detail."""


@dataclass(frozen=True, kw_only=True)
class Form:
    """A kind of growth.

    Attributes
    ----------
    name : str
    make : callable
        From a random generator and a level of detail.
    materials : tuple of Material
        One of them is chosen for each; none: the shape brings its own.
    size_m : tuple of float
        Smallest and largest.
    upright : float
        0 grows along the ground's normal, 1 straight up.
    on_rock, on_sand : float
        How common it is on each.
    across_current : bool
        Whether it is flat and stands with its face to the current.
    """

    name: str
    make: Callable[[np.random.Generator, int], Surface]
    materials: tuple[Material, ...]
    size_m: tuple[float, float]
    upright: float
    on_rock: float
    on_sand: float
    across_current: bool = False


FORMS = (
    Form(
        name="staghorn coral",
        make=staghorn,
        materials=(Material.BROWN_CORAL, Material.YELLOW_CORAL, Material.BLUE_CORAL),
        size_m=(0.5, 1.1),
        upright=0.6,
        on_rock=1.6,
        on_sand=0.25,
    ),
    Form(
        name="table coral",
        make=table,
        materials=(Material.BROWN_CORAL, Material.BROWN_CORAL, Material.GREEN_CORAL),
        size_m=(0.6, 1.6),
        upright=0.85,
        on_rock=1.5,
        on_sand=0.1,
    ),
    Form(
        name="brain coral",
        make=dome,
        materials=(Material.BROWN_CORAL, Material.BROWN_CORAL, Material.GREEN_CORAL, Material.YELLOW_CORAL),
        size_m=(0.4, 1.2),
        upright=0.3,
        on_rock=1.2,
        on_sand=0.35,
    ),
    Form(
        name="sea fan",
        make=fan,
        materials=(Material.PURPLE_FAN, Material.RED_SPONGE, Material.YELLOW_CORAL),
        size_m=(0.5, 1.1),
        upright=0.5,
        on_rock=1.4,
        on_sand=0.1,
        across_current=True,
    ),
    Form(
        name="soft coral",
        make=bush,
        materials=(Material.PINK_CORAL, Material.ORANGE_SPONGE, Material.RED_SPONGE),
        size_m=(0.3, 0.7),
        upright=0.4,
        on_rock=1.2,
        on_sand=0.1,
    ),
    Form(
        name="tube sponge",
        make=tube_sponge,
        materials=(Material.ORANGE_SPONGE, Material.RED_SPONGE, Material.YELLOW_CORAL, Material.PURPLE_FAN),
        size_m=(0.35, 0.8),
        upright=0.6,
        on_rock=1.0,
        on_sand=0.15,
    ),
    Form(
        name="ball sponge",
        make=ball_sponge,
        materials=(Material.RED_SPONGE, Material.ORANGE_SPONGE),
        size_m=(0.14, 0.26),
        upright=0.0,
        on_rock=0.8,
        on_sand=0.35,
    ),
    Form(name="rock", make=rock, materials=(), size_m=(0.25, 1.1), upright=0.5, on_rock=0.6, on_sand=1.0),
)


def reef(depth_m: float, seed: int = 0) -> World:
    """Reef around a robot at `depth_m`, 32 m across and 440 000 triangles.

    The robot hovers 2 m over sand. Ahead and to the left a ridge rises 3 to 8 m away, behind lie mounds, to the right
    the bottom falls away into open water. In shallow water everything is lower, so that it stays below the surface.
    Red things compete with a red target: red sponges and fans have the ball's own reflectance, and ball sponges its
    shape and size.
    """
    rng = np.random.default_rng(seed)
    ground = terrain(rng, ceiling_m=depth_m + BOTTOM_BELOW_ROBOT_M - CEILING_BELOW_SURFACE_M)
    below = np.array([0.0, 0.0, -(depth_m + BOTTOM_BELOW_ROBOT_M)])
    things = [("sea floor", ground.bottom), *_growths(rng, ground, depth_m)]
    return world_of("reef", [(name, _shifted(each, below)) for name, each in things])


def _growths(rng: np.random.Generator, ground: Terrain, depth_m: float) -> list[tuple[str, Surface]]:
    robot = np.array([0.0, 0.0, BOTTOM_BELOW_ROBOT_M])
    ceiling = depth_m + BOTTOM_BELOW_ROBOT_M - CEILING_BELOW_SURFACE_M
    prototypes = {
        form.name: [[form.make(rng, detail) for _ in range(PROTOTYPES)] for detail in range(3)] for form in FORMS
    }
    places, kinds, sizes = _places(rng, ground)
    grown: list[tuple[str, Surface]] = []
    counts = dict.fromkeys(prototypes, 0)
    for place, kind, size in zip(places, kinds, sizes, strict=True):
        form = FORMS[kind]
        foot = ground.places_m[place]
        detail = sum(float(np.linalg.norm(foot - robot)) < within for within in DETAIL_WITHIN_M)
        prototype = prototypes[form.name][detail][rng.integers(PROTOTYPES)]
        vertices = foot + size * prototype.vertices_m @ _stand(rng, form, ground.normal[place]).T
        tint = rng.uniform(0.65, 1.1) * rng.uniform(0.88, 1.0, 3)
        material = prototype.material if not form.materials else int(form.materials[rng.integers(len(form.materials))])
        inside = np.hypot(vertices[:, 0], vertices[:, 1]) < ARENA_RADIUS_M
        highest = max(vertices[:, 2].max() - ceiling, vertices[inside, 2].max(initial=0.0) - ARENA_FLOOR_M)
        if highest < 0 and np.linalg.norm(vertices - robot, axis=1).min() > FREE_RADIUS_M:
            counts[form.name] += 1
            made = surface(vertices, prototype.faces, material, np.minimum(prototype.colour * tint, BRIGHTEST))
            grown.append((f"{form.name} {counts[form.name]}", made))
    return grown


def _places(rng: np.random.Generator, ground: Terrain) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray]:
    """Vertices of the ground to grow on, the form and the size of each; disks of half their size do not meet."""
    vertices = ground.places_m
    radius = np.hypot(vertices[:, 0], vertices[:, 1])
    # Far things are hidden by near ones and by the water.
    share = ground.area_m2 * (0.16 + ground.rock) * np.where(radius > 0.85 * RADIUS_M, 0, 1 / (1 + (radius / 5.5) ** 3))
    places = rng.choice(len(vertices), size=CANDIDATES, replace=False, p=share / share.sum())
    common = np.array([[form.on_sand, form.on_rock] for form in FORMS]).T
    common = common / common.sum(axis=1, keepdims=True)
    stony = (ground.rock[places] > 0.5).astype(int)
    kinds = np.array([rng.choice(len(FORMS), p=common[each]) for each in stony])
    smallest, largest = np.array([form.size_m for form in FORMS])[kinds].T
    # Small ones are commoner.
    sizes = smallest + (largest - smallest) * rng.uniform(size=CANDIDATES) ** 1.7
    kept = spaced(vertices[places], 0.36 * sizes)
    return places[kept], kinds[kept], sizes[kept]


def _stand(rng: np.random.Generator, form: Form, normal: FloatArray) -> FloatArray:
    """Axes of a growth, its own z between the ground's normal and straight up, turned about it by chance.

    Fans stand across the current, their y along it, which shows the robot most of their face.
    """
    up = (1 - form.upright) * normal + form.upright * np.array([0.0, 0.0, 1.0]) + rng.normal(scale=0.08, size=3)
    up = up / np.linalg.norm(up)
    turn = rng.uniform(0, 2 * np.pi)
    if form.across_current:
        first = np.cross(CURRENT, up)
        first = first / np.linalg.norm(first)
        turn = turn / 8
    else:
        first, _ = perpendicular_axes(up)
    axes = np.stack([first, np.cross(up, first), up], axis=-1)
    return np.asarray(axes @ Rotation.from_rotvec([0.0, 0.0, turn]).as_matrix())


def _shifted(each: Surface, by: FloatArray) -> Surface:
    return Surface(vertices_m=each.vertices_m + by, faces=each.faces, material=each.material, colour=each.colour)
