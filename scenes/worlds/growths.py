"""What grows on a reef: corals, fans and sponges, about a metre across, standing on the origin with z up.

The shapes are nominal, after what the names mean to a diver. Every function takes a random generator and a level of
detail (0 far, 1, 2 near) and gives closed surfaces, normals outwards.
"""

from __future__ import annotations

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.mesh import Triangles, joined_triangles
from scenes.light.materials import Material
from scenes.surfaces.noise import GradientNoise, smoothstep
from scenes.surfaces.shapes import lofted, perpendicular_axes, tubes, turned, unit_sphere
from scenes.surfaces.space_colonisation import grown_tree, tree_surface
from scenes.surfaces.surface import Surface, surface

GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))


def staghorn(rng: np.random.Generator, detail: int) -> Surface:
    """Thicket of forking branches with pale tips (Acropora)."""
    directions = _cone(rng, np.tile([0.0, 0.0, 1.0], (8 + 4 * detail, 1)), 0.9)
    starts = np.tile([0.0, 0.0, -0.05], (len(directions), 1))
    radius, length = 0.045, 0.27
    parts, tips = [], []
    generations, sides = 2 + detail // 2, 3 + detail // 2
    for generation in range(generations):
        reach = length * rng.uniform(0.7, 1.25, (len(starts), 1))
        bend = rng.normal(scale=0.06, size=starts.shape) * reach
        ends = starts + reach * directions
        paths = np.stack([starts, (starts + ends) / 2 + bend, ends], axis=1)
        widths = np.broadcast_to([radius, 0.85 * radius, 0.62 * radius], (len(paths), 3))
        parts.append(tubes(paths, widths, sides))
        height = (generation + np.linspace(0, 1, 3)) / generations
        tips.append(np.tile(np.concatenate([np.repeat(height, sides), height[[0, -1]]]), len(paths)))
        starts = np.repeat(paths[:, -1], 2, axis=0)
        directions = _cone(rng, np.repeat(directions, 2, axis=0), 0.65)
        directions[:, 2] += 0.25
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        radius, length = 0.72 * radius, 0.85 * length
    vertices, faces = joined_triangles(parts)
    pale = smoothstep(np.concatenate(tips), 0.75, 1.0)[:, np.newaxis]
    return _coloured(rng, (vertices, faces), 0.8 + pale * [0.9, 0.9, 1.0])


def table(rng: np.random.Generator, detail: int) -> Surface:
    """Plate on a stalk, with a ragged rim and knobs on top (table Acropora)."""
    noise = GradientNoise(rng)
    sides = (12, 20, 40)[detail]
    top = [(radius, 0.34 + 0.05 * radius) for radius in np.linspace(0.5, 0.08, 3 + 2 * detail)]
    rings = turned([(0.1, -0.08), (0.08, 0.12), (0.2, 0.26), (0.47, 0.335), *top], sides)
    wide = np.hypot(rings[..., 0], rings[..., 1])
    angle = np.arctan2(rings[..., 1], rings[..., 0])
    lobes = noise.octaves(np.stack([2 * np.cos(angle), 2 * np.sin(angle), np.zeros_like(angle)], axis=-1), 3)
    rings[..., :2] *= (1 + 0.35 * lobes * smoothstep(wide, 0.15, 0.5))[..., np.newaxis]
    knobs = noise.octaves(rings * 14, 2)
    above = np.arange(len(rings)) >= 4
    rings[..., 2] += np.where(above[:, np.newaxis], 0.05 * knobs, 0)
    rings[..., 2] += 0.12 * noise(rings * 1.3) * smoothstep(wide, 0.1, 0.5)
    shade = np.where(above[:, np.newaxis], 0.95 + 0.5 * knobs + 0.6 * smoothstep(wide, 0.42, 0.5), 0.55)
    shade = np.concatenate([shade.ravel(), [0.5, 1.0]])
    return _coloured(rng, lofted(rings), shade[:, np.newaxis] * np.ones(3))


def dome(rng: np.random.Generator, detail: int) -> Surface:
    """Massive head with meandering ridges (brain coral): relief follows the level lines of a smooth field."""
    noise = GradientNoise(rng)
    sphere, faces = unit_sphere(2 + detail)
    field = noise.octaves(sphere * 1.6, 2)
    meander = np.cos(2 * np.pi * 5.0 * field)
    radius = 0.5 * (1 + 0.12 * noise(sphere * 1.2 + 9.0) + 0.035 * meander)
    vertices = radius[:, np.newaxis] * sphere * [1.0, 1.0, 0.75] + [0.0, 0.0, 0.1]
    groove = smoothstep(meander, -0.6, 0.6)[:, np.newaxis]
    return _coloured(rng, (vertices, faces), [0.55, 0.6, 0.5] + groove * [0.75, 0.65, 0.6])


def fan(rng: np.random.Generator, detail: int) -> Surface:
    """Flat lattice of twigs across the current (sea fan), in the plane y = 0."""
    count = (80, 200, 520)[detail]
    angle = rng.uniform(-1.15, 1.15, count)
    reach = np.sqrt(rng.uniform(0.05, 1.0, count)) * rng.uniform(0.85, 1.0)
    points = np.stack([0.55 * reach * np.sin(angle), rng.normal(scale=0.012, size=count), reach * np.cos(angle)], -1)
    tree = grown_tree(points, step_m=(0.07, 0.045, 0.028)[detail])
    return _coloured(rng, tree_surface(tree, 3), np.full(3, 1.0))


def bush(rng: np.random.Generator, detail: int) -> Surface:
    """Soft coral: a tree whose twigs fill a round crown."""
    count = 40 * 2**detail
    direction = rng.normal(size=(count, 3))
    direction = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    reach = rng.uniform(0.3, 1.0, (count, 1)) ** (1 / 3)
    points = [0.0, 0.0, 0.5] + [0.38, 0.38, 0.36] * reach * direction
    tree = grown_tree(points, step_m=(0.12, 0.1, 0.06)[detail])
    vertices, faces = tree_surface(tree, 3)
    tips = np.setdiff1d(np.arange(len(tree.nodes_m)), tree.parent)
    knobs = [_moved(unit_sphere(detail // 2), 0.045, tree.nodes_m[tip]) for tip in tips]
    shade = np.concatenate([np.full(len(vertices), 0.75), np.full(sum(len(knob[0]) for knob in knobs), 1.15)])
    return _coloured(rng, joined_triangles([(vertices, faces), *knobs]), shade[:, np.newaxis] * np.ones(3))


def tube_sponge(rng: np.random.Generator, detail: int) -> Surface:
    """Cluster of open tubes."""
    sides = (5, 7, 12)[detail]
    parts, shades = [], []
    for position in range(int(rng.integers(4, 8))):
        height, wide = rng.uniform(0.35, 0.95), rng.uniform(0.07, 0.11)
        outside = [(wide * (0.75 + 0.3 * t), height * t) for t in np.linspace(-0.1, 1, 2 + detail)]
        rim = [(0.95 * wide, height + 0.02), (0.7 * wide, height)]
        rings = turned([*outside, *rim, (0.6 * wide, 0.7 * height), (0.4 * wide, 0.5 * height)], sides)
        lean = rng.normal(scale=0.16, size=2)
        azimuth = position * GOLDEN_ANGLE
        foot = 0.09 * np.sqrt(position) * np.array([np.cos(azimuth), np.sin(azimuth)])
        rings[..., :2] += foot + (lean + 1.2 * foot) * rings[..., 2:]
        rings[..., :2] *= 1 + 0.05 * rng.normal(size=(len(rings), sides, 1))
        parts.append(lofted(rings))
        inside = np.repeat(np.r_[np.linspace(0.75, 1.1, len(outside)), 1.3, 0.9, 0.45, 0.3], sides)
        shades.append(np.r_[inside, 0.75, 0.25])
    return _coloured(rng, joined_triangles(parts), np.concatenate(shades)[:, np.newaxis] * np.ones(3))


def ball_sponge(rng: np.random.Generator, detail: int) -> Surface:
    """Round sponge (Tethya): of a target ball's shape and size, and in red of its colour."""
    sphere, faces = unit_sphere(1 + detail)
    warts = GradientNoise(rng)(sphere * 5)
    vertices = 0.5 * (1 + 0.06 * warts)[:, np.newaxis] * sphere + [0.0, 0.0, 0.4]
    return _coloured(rng, (vertices, faces), (1 + 0.35 * warts)[:, np.newaxis] * np.ones(3))


def rock(rng: np.random.Generator, detail: int) -> Surface:
    """Boulder, bare below and grown over with turf where it looks up."""
    noise = GradientNoise(rng)
    sphere, faces = unit_sphere(1 + detail)
    # Crystal-like: pulled onto a few planes, then roughened.
    planes = rng.normal(size=(9, 3))
    planes /= np.linalg.norm(planes, axis=1, keepdims=True)
    reach = np.min(rng.uniform(0.75, 1.0, 9) / np.maximum(sphere @ planes.T, 0.2), axis=1)
    radius = 0.5 * np.minimum(reach, 1.1) * (1 + 0.25 * noise.octaves(sphere * 2.2, 3))
    vertices = radius[:, np.newaxis] * sphere * [1.0, 0.85, 0.7] + [0.0, 0.0, 0.15]
    patch = noise.octaves(vertices * 5 + 5.0, 2)
    made = _coloured(rng, (vertices, faces), (0.8 + 0.5 * patch)[:, np.newaxis] * [1.0, 0.95, 0.85])
    grown = (sphere[:, 2] + patch)[faces].mean(axis=1) > 0.35
    return surface(made.vertices_m, faces, np.where(grown, int(Material.TURF), int(Material.ROCK)), made.colour)


def _cone(rng: np.random.Generator, along: FloatArray, spread: float) -> FloatArray:
    """Unit vectors scattered about unit vectors, `spread` the tangent of the usual angle."""
    first, second = perpendicular_axes(along)
    angle, tilt = rng.uniform(0, 2 * np.pi, (len(along), 1)), spread * rng.uniform(0.6, 1.2, (len(along), 1))
    turned_away = along + tilt * (np.cos(angle) * first + np.sin(angle) * second)
    return np.asarray(turned_away / np.linalg.norm(turned_away, axis=1, keepdims=True))


def _moved(shape: Triangles, scale: float, place: FloatArray) -> Triangles:
    return scale * shape[0] + place, shape[1]


def _coloured(rng: np.random.Generator, shape: Triangles, colour: FloatArray) -> Surface:
    """Surface with its colour roughened from vertex to vertex; the material is chosen where it is placed."""
    vertices, faces = shape
    grain = 1 + 0.12 * rng.normal(size=(len(vertices), 1))
    return surface(vertices, faces, Material.ROCK, np.clip(colour * grain, 0.05, None))
