"""Targets: what the robot is to look at, each in a frame of its own - x forward, z up, origin at its centre."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray
from optics.mesh import Triangles, joined_triangles
from scenes.light.materials import Material
from scenes.surfaces.shapes import lofted, turned, unit_sphere
from scenes.surfaces.surface import Surface, joined, surface
from scenes.worlds.mesh_file import MESH_SUFFIXES, read_things


@dataclass(frozen=True, kw_only=True)
class Ball:
    """An exact sphere, of the chart's red as the paper's target is unless it is of something else."""

    radius_m: float = 0.1
    material: Material = Material.TARGET

    def __post_init__(self) -> None:
        if not self.radius_m > 0:
            raise ValueError(f"expected radius_m > 0, got {self.radius_m}")


@dataclass(frozen=True, kw_only=True)
class MeshShape:
    """A target of triangles.

    Attributes
    ----------
    name : str
    surface : Surface
        In the target's frame: x forward, z up, origin at the middle of its bounding box.
    """

    name: str
    surface: Surface


TargetShape = Ball | MeshShape

BALL_SUBDIVISIONS = 4
"""Of an icosahedron, 5120 faces: no point of them is more than 0.1 % of the radius inside the sphere."""


def meshed(shape: TargetShape) -> MeshShape:
    """A shape as triangles; a ball's corners are on its sphere."""
    if isinstance(shape, MeshShape):
        return shape
    vertices, faces = unit_sphere(BALL_SUBDIVISIONS)
    return MeshShape(name="ball", surface=surface(shape.radius_m * vertices, faces, shape.material))


PLAUSIBLE_TARGET_M = (0.01, 50.0)
"""Extent of a user's target."""


def target_named(name_or_path: str | Path, *, unit: str = "m") -> TargetShape:
    """Target by name (ball, buoy, diver, fish) or from a mesh file.

    A file's x points forward and its z up (GLB and glTF: y is up, as their standard says); it is moved so that the
    middle of its bounding box is the target's origin.

    Parameters
    ----------
    name_or_path : str or Path
    unit : {"m", "mm", "inch"}
        Of a mesh file that does not say so itself.

    Raises
    ------
    ValueError
        For an unknown name, and for a file that cannot be used.
    """
    if str(name_or_path) in TARGETS:
        return TARGETS[str(name_or_path)]()
    path = Path(name_or_path)
    if path.suffix.lower() not in MESH_SUFFIXES:
        names, endings = ", ".join(sorted(TARGETS)), ", ".join(MESH_SUFFIXES)
        raise ValueError(f"expected a target ({names}) or a file that ends in {endings}, got {str(name_or_path)!r}")
    things = read_things(path, unit=unit, plausible_m=PLAUSIBLE_TARGET_M)
    return _centred(path.stem, [each for _, each in things])


def buoy() -> MeshShape:
    """Orange buoy, 0.3 m high: a cylinder between two cones, with a pale band and a steel eye at each end."""
    radius, half, band = 0.09, 0.132, 0.025
    profile = np.array([(0.012, -half), (0.6 * radius, -0.095), (radius, -0.06), (radius, -band)])
    upper = np.flip(profile, axis=0) * [1, -1]
    rings = lofted(turned(np.concatenate([profile, upper]), 32))
    middle = np.abs(rings[0][rings[1]].mean(axis=1)[:, 2]) < 0.9 * band
    # Redder than the chart's orange, which is the patch nearest to a life buoy's.
    colour = np.where(np.abs(rings[0][:, 2:]) > 1.1 * band, [1.2, 0.7, 0.6], 1.0)
    body = surface(*rings, np.where(middle, int(Material.TILE_WHITE), int(Material.BUOY)), colour)
    eyes = [
        surface(*_ellipsoid((0.0, 0.0, end * (half + 0.004)), (0.014, 0.014, 0.014)), Material.STEEL) for end in (-1, 1)
    ]
    return _centred("buoy", [body, *eyes])


FISH_STATIONS = (
    (-0.33, 0.028, 0.010),
    (-0.22, 0.060, 0.030),
    (-0.08, 0.112, 0.058),
    (0.08, 0.138, 0.072),
    (0.24, 0.128, 0.072),
    (0.36, 0.096, 0.058),
    (0.44, 0.060, 0.038),
    (0.49, 0.022, 0.016),
)
"""From the tail's root to the snout: place along it, half height, half width, as shares of the length."""


def fish() -> MeshShape:
    """Fish 0.3 m long, silver below and blue-grey above, with a forked tail, a dorsal fin and dark eyes."""
    length = 0.3
    vertices, faces = lofted(length * _oval_rings(np.array(FISH_STATIONS), 20))
    back = np.clip(vertices[:, 2:] / (0.13 * length), -1, 1)
    colour = np.where(back > 0.15, [0.55, 0.75, 1.0], [1.5, 1.5, 1.5]) - 0.15 * back
    body = surface(vertices, faces, Material.FISH, colour)
    tail = [(-0.31, 0.03), (-0.5, 0.15), (-0.44, 0.0), (-0.5, -0.15), (-0.31, -0.03)]
    dorsal = [(0.2, 0.115), (0.14, 0.2), (-0.02, 0.19), (-0.12, 0.08)]
    belly = [(-0.1, -0.085), (-0.16, -0.17), (-0.02, -0.105)]
    fins = [_fin(length * np.array(outline), 0.003) for outline in (tail, dorsal, belly)]
    eyes = [
        _ellipsoid((0.4 * length, side * 0.047 * length, 0.025 * length), (0.006, 0.003, 0.006)) for side in (-1, 1)
    ]
    grey = surface(*joined_triangles(fins), Material.FISH, (0.8, 0.85, 0.7))
    return _centred("fish", [body, grey, surface(*joined_triangles(eyes), Material.NEOPRENE)])


DIVER_TORSO = ((-0.22, 0.105, 0.15), (-0.05, 0.1, 0.14), (0.2, 0.12, 0.18), (0.36, 0.085, 0.17), (0.42, 0.055, 0.07))
"""Stations from hips to neck: place along x, half height, half width, metres."""
DIVER_LIMBS = (
    ((-0.18, 0.085, -0.01), (-0.56, 0.11, -0.07), 0.085, 0.06),
    ((-0.56, 0.11, -0.07), (-0.95, 0.1, 0.02), 0.06, 0.042),
    ((0.3, 0.19, -0.01), (0.24, 0.29, -0.24), 0.055, 0.045),
    ((0.24, 0.29, -0.24), (0.46, 0.2, -0.3), 0.045, 0.034),
)
"""Thigh, shin, upper arm, forearm of the left side: ends and radii at them, metres."""
DIVER_HAND, DIVER_FOOT, DIVER_HEAD = (0.52, 0.2, -0.31), (-0.95, 0.1, 0.02), (0.55, 0.0, 0.02)
DIVER_FIN = ((0.06, -0.05), (0.06, 0.05), (-0.12, 0.06), (-0.42, 0.11), (-0.44, 0.0), (-0.42, -0.11), (-0.12, -0.06))
"""Outline of a fin about the foot: along x and y, metres."""
DIVER_HOSE = ((0.34, 0.06, 0.2), (0.5, 0.13, 0.08), (0.64, 0.03, -0.05))
DIVER_KICK = 0.13
"""How far the left leg is raised and the right one lowered, as a slope from the hip."""


def diver() -> MeshShape:
    """Diver who swims forward, 2.1 m over the fins: dark suit, skin, mask, yellow fins, steel tank, hose, belt."""
    suit = [lofted(_oval_rings(np.array(DIVER_TORSO), 20)), _ellipsoid(DIVER_HEAD, (0.13, 0.095, 0.115))]
    skin = [_ellipsoid(np.add(DIVER_HEAD, (0.07, 0.0, -0.055)), (0.06, 0.06, 0.05))]
    fins = []
    for side in (-1, 1):
        suit += [_limb(_to_side(a, side), _to_side(b, side), thick, thin) for a, b, thick, thin in DIVER_LIMBS]
        suit.append(_ellipsoid(_to_side(DIVER_FOOT, side), (0.09, 0.045, 0.045)))
        skin.append(_ellipsoid(_to_side(DIVER_HAND, side), (0.07, 0.035, 0.025)))
        blade, faces = _fin(np.array(DIVER_FIN), 0.012)
        # The outline stands upright; a swimmer's fin lies flat.
        fins.append((blade[:, [0, 2, 1]] * [1, -1, 1] + _to_side(DIVER_FOOT, side), faces))
    hose = [_limb(first, second, 0.013, 0.013) for first, second in pairwise(DIVER_HOSE)]
    regulator = _ellipsoid(np.add(DIVER_HEAD, (0.14, 0.0, -0.07)), (0.035, 0.04, 0.03))
    pieces = [
        surface(*joined_triangles(suit), Material.NEOPRENE),
        surface(*joined_triangles(skin), Material.SKIN),
        surface(*joined_triangles(fins), Material.TILE_YELLOW),
        surface(*_limb((-0.2, 0.0, 0.19), (0.3, 0.0, 0.2), 0.085, 0.085), Material.STEEL, (0.75, 0.75, 0.78)),
        surface(*_ellipsoid(np.add(DIVER_HEAD, (0.1, 0.0, 0.015)), (0.05, 0.075, 0.045)), Material.BLUE_CORAL),
        surface(*joined_triangles([*hose, regulator]), Material.SERVO),
        surface(*_ellipsoid((-0.16, 0.0, 0.0), (0.03, 0.155, 0.112)), Material.TILE_ORANGE),
    ]
    return _centred("diver", pieces)


def _to_side(point: ArrayLike, side: int) -> FloatArray:
    """Point of the left side (1) or of its mirror image (-1), legs behind the hip raised or lowered by the kick."""
    x, y, z = np.asarray(point, dtype=np.float64)
    return np.array([x, side * y, z + side * DIVER_KICK * max(0.0, -0.18 - x)])


TARGETS: dict[str, Callable[[], TargetShape]] = {"ball": Ball, "buoy": buoy, "diver": diver, "fish": fish}
"""Targets by name; their shapes and sizes are nominal, but for the paper's ball."""


def _centred(name: str, pieces: list[Surface]) -> MeshShape:
    whole = joined(pieces)
    middle = (whole.vertices_m.min(axis=0) + whole.vertices_m.max(axis=0)) / 2
    return MeshShape(name=name, surface=surface(whole.vertices_m - middle, whole.faces, whole.material, whole.colour))


def _oval_rings(stations: FloatArray, sides: int) -> FloatArray:
    """Rings square to x from (place, half height, half width), counter-clockwise about +x, shape (k, s, 3)."""
    place, height, width = stations.T[..., np.newaxis]
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    return np.stack(
        [np.broadcast_to(place, (len(place), sides)), width * np.cos(angle), height * np.sin(angle)], axis=-1
    )


def _ellipsoid(centre: ArrayLike, semi_axes: ArrayLike) -> Triangles:
    vertices, faces = unit_sphere(2)
    return vertices * np.asarray(semi_axes) + np.asarray(centre), faces


def _limb(first: ArrayLike, second: ArrayLike, thick_m: float, thin_m: float) -> Triangles:
    """Capsule between two points whose radius changes from one end to the other."""
    start, end = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    sphere, faces = unit_sphere(2)
    along = (end - start) / np.linalg.norm(end - start)
    # A sphere cut at its equator: the halves go to the two ends.
    ahead = (sphere @ along)[:, np.newaxis] > 0
    return np.where(ahead, end + thin_m * sphere, start + thick_m * sphere), faces


def _fin(outline: FloatArray, thickness_m: float) -> Triangles:
    """Thin plate in the plane y = 0 with an outline of (x, z), thinned to its rim."""
    upright = np.stack([outline[:, 0], np.zeros(len(outline)), outline[:, 1]], axis=-1)
    area = np.sum(outline[:, 0] * np.roll(outline[:, 1], -1) - np.roll(outline[:, 0], -1) * outline[:, 1]) / 2
    if area > 0:
        # Counter-clockwise in (x, z) is clockwise about y.
        upright = upright[::-1]
    middle = upright.mean(axis=0)
    inner = middle + 0.6 * (upright - middle)
    half = np.array([0.0, thickness_m / 2, 0.0])
    return lofted(np.stack([inner - half, upright, inner + half]))
