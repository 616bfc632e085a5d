"""Sea floor around the robot: rippled sand under it, ridges of rock on two sides, a slope into open water on a third.

Positions here count from the point of the flat bottom below the robot, z up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from optics.mesh import Triangles, double_area_vectors
from scenes.light.materials import Material
from scenes.surfaces.noise import GradientNoise, smoothstep
from scenes.surfaces.patches import patches
from scenes.surfaces.surface import Surface, surface

RADIUS_M = 16.0
EYE_M = 2.0
"""Height from which the mesh is to look evenly fine: the robot's."""
RAYS, RINGS = 400, 170
"""Cells around and outwards, 2 triangles each: 1 degree wide, so 3 cm in the middle and 8 cm on the ridge."""
SURVEY_RAYS, SURVEY_RINGS = 100, 160
"""Where the relief is looked at first, to see where the rings of the mesh are needed."""
SURVEY_BLUR = 2.5
"""Rays and rings over which the need is smoothed, so that neighbouring rays agree and cells are not sheared."""

FREE_RADIUS_M = 3.2
"""Within it the bottom is sand."""
WALL_RADIUS_M = 5.0
HIGHEST_WALL_M = 6.0
WALL_AZIMUTH_DEG, WALL_HALF_ANGLE_DEG = 50.0, 85.0
"""The ridge stands ahead and to the left, from which a camera on the left front sees most of it."""
SLOPE_BEGINS_M, SLOPE = 4.0, 0.75
"""To the right (-y) the bottom falls away."""
RIPPLE_M, RIPPLE_HEIGHT_M = 0.28, 0.025

BRIGHTEST = 1.25
"""Largest colour factor: the chart's red, 0.73 at its brightest, stays a reflectance."""
BARE_ROCK = 0.4
"""Its reflectance over that of sand."""

ENCRUSTING = (Material.PINK_CORAL, Material.RED_SPONGE, Material.ORANGE_SPONGE, Material.PURPLE_FAN)
"""What grows flat on rock, in patches."""


@dataclass(frozen=True, kw_only=True)
class Terrain:
    """Sea floor and what is needed to place things on it.

    Attributes
    ----------
    bottom : Surface
    places_m : array, shape (n, 3)
        Points of the bottom, evenly fine for the robot's eye.
    normal : array, shape (n, 3)
        Unit normal at each of them, upwards.
    rock : array, shape (n,)
        0 on sand, 1 on rock.
    area_m2 : array, shape (n,)
        Share of the surface that belongs to each.
    """

    bottom: Surface
    places_m: FloatArray
    normal: FloatArray
    rock: FloatArray
    area_m2: FloatArray


def terrain(rng: np.random.Generator, *, ceiling_m: float) -> Terrain:
    """Sea floor that stays below `ceiling_m`, the height of the water over the bottom less some room."""
    noise = GradientNoise(rng)
    wall_m = min(HIGHEST_WALL_M, ceiling_m - 0.4)
    flat, faces = _polar_mesh(noise, wall_m)
    height, rock = _relief(noise, flat, wall_m)
    vertices = flat + height[:, np.newaxis] * [0.0, 0.0, 1.0]
    vertices = vertices + _crags(noise, vertices, rock)[:, np.newaxis] * _vertex_normals(vertices, faces)
    vertices[:, 2] = np.minimum(vertices[:, 2], ceiling_m)
    areas = np.linalg.norm(double_area_vectors(vertices[faces]), axis=1) / 6
    return Terrain(
        bottom=_bottom(rng, noise, (vertices, faces), rock),
        places_m=vertices,
        normal=_vertex_normals(vertices, faces),
        rock=rock,
        area_m2=np.asarray(np.bincount(faces.ravel(), np.repeat(areas, 3), len(vertices)), dtype=np.float64),
    )


def _polar_mesh(noise: GradientNoise, wall_m: float) -> tuple[FloatArray, NDArray[np.int32]]:
    """Flat mesh around the middle whose rings crowd where the relief is steep and near: evenly fine for the robot."""
    # Each takes a tenth of a second to import, and a reef is in the cache as a rule.
    from scipy.integrate import cumulative_trapezoid  # noqa: PLC0415
    from scipy.ndimage import gaussian_filter  # noqa: PLC0415

    azimuth = np.linspace(0, 2 * np.pi, SURVEY_RAYS, endpoint=False)
    radius = np.linspace(0, RADIUS_M, SURVEY_RINGS)
    survey = _polar(azimuth[:, np.newaxis], np.broadcast_to(radius, (SURVEY_RAYS, SURVEY_RINGS)))
    height = _relief(noise, survey.reshape(-1, 3), wall_m)[0].reshape(SURVEY_RAYS, SURVEY_RINGS)
    steepness = np.hypot(1, np.gradient(height, radius, axis=1))
    need = steepness / np.hypot(radius, EYE_M - height)
    need = gaussian_filter(need, SURVEY_BLUR, mode=("wrap", "nearest"))
    reached = cumulative_trapezoid(need, radius, axis=1, initial=0)
    reached = reached / reached[:, -1:]
    even = np.linspace(0, 1, RINGS + 1)[1:]
    rings = np.stack([np.interp(even, each, radius) for each in reached])
    # Survey rays to mesh rays, around the circle.
    fine = np.linspace(0, 2 * np.pi, RAYS, endpoint=False)
    rings = np.stack([np.interp(fine, azimuth, column, period=2 * np.pi) for column in rings.T], axis=-1)
    vertices = np.concatenate([np.zeros((1, 3)), _polar(fine[:, np.newaxis], rings).reshape(-1, 3)])
    index = 1 + np.arange(RAYS * RINGS).reshape(RAYS, RINGS)
    beside = np.roll(index, -1, axis=0)
    inner = np.stack([np.zeros(RAYS, dtype=np.int64), index[:, 0], beside[:, 0]], axis=-1)
    a, b, c, d = index[:, :-1], index[:, 1:], beside[:, 1:], beside[:, :-1]
    outer = [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
    return vertices, np.concatenate([inner, *outer]).astype(np.int32)


def _polar(azimuth: FloatArray, radius: FloatArray) -> FloatArray:
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), np.zeros_like(radius)], axis=-1)


def _relief(noise: GradientNoise, flat: FloatArray, wall_m: float) -> tuple[FloatArray, FloatArray]:
    """Height of the bottom over the flat one, and where it is rock."""
    x, y = flat[:, 0], flat[:, 1]
    radius, azimuth = np.hypot(x, y), np.degrees(np.arctan2(y, x))
    beside = np.abs((azimuth - WALL_AZIMUTH_DEG + 180) % 360 - 180)
    facing = 1 - smoothstep(beside + 60 * noise(flat / 3.0), WALL_HALF_ANGLE_DEG - 30, WALL_HALF_ANGLE_DEG)
    edge = WALL_RADIUS_M + 2.2 * noise.octaves(flat / 4.0 + 3.0, 3)
    wall = facing * smoothstep(radius - edge, 0.0, 2.4)
    crest = 0.72 + 0.55 * noise.octaves(flat / 5.0 + 11.0, 2)
    mounds = np.maximum(noise.octaves(flat / 3.2 + 29.0, 3) - 0.12, 0)
    away = smoothstep(radius, FREE_RADIUS_M, FREE_RADIUS_M + 1.5)
    rough = noise.ridges(flat / 1.6 + 41.0, 4)
    patch = smoothstep(mounds, 0.03, 0.12) * away
    rock = np.maximum(patch, smoothstep(wall, 0.04, 0.2))
    height = wall_m * np.clip(crest, 0.3, 1.0) * wall + 3.2 * mounds * away + 0.4 * rough * rock
    sand = 0.22 * noise.octaves(flat / 4.5 + 53.0, 2) * smoothstep(radius, 1.0, 5.0) + _ripples(noise, flat)
    fall = SLOPE * np.maximum(-y - SLOPE_BEGINS_M, 0) ** 1.15 + 0.5 * np.maximum(radius - 12.0, 0) ** 1.5
    return np.minimum(height, wall_m) + (1 - rock) * sand - fall, rock


def _ripples(noise: GradientNoise, flat: FloatArray) -> FloatArray:
    """Sharp crests and wide troughs, as waves leave them, bent and broken by noise."""
    phase = 2 * np.pi * (flat[:, 0] + 0.35 * flat[:, 1] + 0.5 * noise(flat / 1.1)) / RIPPLE_M
    return RIPPLE_HEIGHT_M * (1 - 2 * np.abs(np.sin(phase / 2))) * (0.75 + 0.6 * noise(flat / 2.0 + 7.0))


def _crags(noise: GradientNoise, vertices: FloatArray, rock: FloatArray) -> FloatArray:
    """How far rock stands out along its normal: overhangs and holes that a height alone cannot have."""
    return rock * (0.38 * noise.octaves(vertices / 1.3, 2, gain=0.45) + 0.09 * noise(vertices / 0.3 + 5.0))


def _bottom(rng: np.random.Generator, noise: GradientNoise, relief: Triangles, rock: FloatArray) -> Surface:
    """Sand (and bare rock, which the colour makes of it), turf on rock, and patches of what encrusts it."""
    vertices, faces = relief
    grain = rng.normal(size=len(vertices))
    # None of these has waves that are shorter than some three edges of the mesh: borders could not follow them.
    stony = rock + 0.5 * noise(vertices / 0.35 + 31.0) - 0.85
    turf = np.minimum(stony, noise.octaves(vertices / 0.6 + 61.0, 2) + 0.02)
    grown = np.minimum(stony, noise.octaves(vertices / 0.8 + 71.0, 2) - 0.23)
    crust = len(ENCRUSTING) * (noise(vertices / 1.3 + 83.0) + 0.5)
    # Crusts beat turf where they grow; among them, each has a stretch of its own of the noise that chooses.
    beyond = [_outside(crust, kind) for kind in range(len(ENCRUSTING))]
    scores = [np.zeros_like(rock), turf, *(np.maximum(turf, 0) + grown - each for each in beyond)]
    made = patches(faces, np.stack(scores, axis=1))
    vertices, rock, grain = made.over(vertices), made.over(rock), made.over(grain)
    faces, material = made.faces, np.array([Material.SAND, Material.TURF, *ENCRUSTING], dtype=np.int32)[made.kind]
    return surface(vertices, faces, material, _colours(noise, (vertices, faces), material, rock, grain))


def _outside(value: FloatArray, stretch: int) -> FloatArray:
    """How far values are from a stretch of length 1 that begins at its number; the first and the last have no end."""
    below = 0.0 if stretch == 0 else stretch - value
    above = 0.0 if stretch == len(ENCRUSTING) - 1 else value - (stretch + 1)
    return np.maximum(np.maximum(below, above), 0.0)


def _colours(
    noise: GradientNoise, bottom: Triangles, material: NDArray[np.int32], rock: FloatArray, grain: FloatArray
) -> FloatArray:
    vertices, faces = bottom
    speckle = grain[:, np.newaxis]
    broad, fine = (noise.octaves(vertices / size + 97.0, 2)[:, np.newaxis] for size in (2.0, 0.25))
    pale = (0.85 + 0.03 * speckle + 0.12 * broad + 0.08 * fine) * [1.05, 0.98, 0.86]
    stone = (0.85 + 0.07 * speckle + 0.5 * broad + 0.5 * fine) * [1.0, 0.97, 0.92]
    # Turf and crusts have spectra of their own; bare rock is sand's, darker, so that one fades into the other.
    bare = np.bincount(faces.ravel(), weights=np.repeat(material == Material.SAND, 3), minlength=len(vertices)) > 0
    stone = stone * np.where(bare, BARE_ROCK, 1.0)[:, np.newaxis]
    mixed = pale + smoothstep(rock, 0.2, 0.9)[:, np.newaxis] * (stone - pale)
    return np.clip(mixed, 0.1, BRIGHTEST)


def _vertex_normals(vertices: FloatArray, faces: NDArray[np.int32]) -> FloatArray:
    """Mean of the normals around each vertex, weighted by area."""
    normals = np.repeat(double_area_vectors(vertices[faces]), 3, axis=0)
    sums = [np.bincount(faces.ravel(), weights=column, minlength=len(vertices)) for column in normals.T]
    total = np.stack(sums, axis=-1)
    return np.asarray(total / np.linalg.norm(total, axis=1, keepdims=True))
