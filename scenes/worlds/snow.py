"""Marine snow: pale flakes that drift past the robot, as far as it goes.

The flakes fill space periodically. One mesh holds a period and what is in sight around it; it is never made again, only
moved: with the water, and back by whole periods so that the robot stays in its middle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from optics.kernels.arrays import FloatArray, check_vector
from scenes.light.materials import Material
from scenes.surfaces.surface import Surface, surface

FACES_PER_FLAKE = 8
MOST_FACES = 200_000
JUNGE_EXPONENT = 3.6
"""Particles per size fall as the size to minus this: mean of 168 size distributions from 0.8 to 120 micrometres (3.6 +-
0.33, Runyan, Reynolds and Stramski 2020, J. Geophys. Res. Oceans 125, e2020JC016218), carried on to millimetres."""
SEMI_AXES = (1.0, 0.75, 0.5)
"""Of a flake, in units of its radius; nominal: flat."""
SHADES = (0.6, 1.2)
"""Colour factors between which flakes vary; nominal."""

OCTAHEDRON = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64)
OCTAHEDRON_FACES = np.array(
    [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 0, 5], [2, 1, 5], [3, 2, 5], [0, 3, 5]], dtype=np.int32
)


@dataclass(frozen=True, kw_only=True)
class MarineSnow:
    """What drifts and sinks in the water.

    Attributes
    ----------
    flakes_per_m3 : float
        Of the sizes below; nominal, as the sizes and the sinking are.
    smallest_m, largest_m : float
        Diameters between which sizes follow the power law.
    period_m : float
        After which the flakes repeat, along each axis of the world.
    sight_m : float
        How far from the robot there are flakes at least: at 500 px per radian, 0.5 mm is 0.14 px wide at 1.8 m.
    drift_m_per_s : array-like, shape (3,)
        Of the water, world frame.
    sinking_m_per_s : float
    seed : int
    """

    flakes_per_m3: float = 100.0
    smallest_m: float = 0.0005
    largest_m: float = 0.003
    period_m: float = 2.0
    sight_m: float = 1.8
    drift_m_per_s: ArrayLike = (0.05, 0.0, 0.0)
    sinking_m_per_s: float = 0.001
    seed: int = 0

    def __post_init__(self) -> None:
        check_vector("drift_m_per_s", self.drift_m_per_s)
        problems = []
        if not 0 < self.smallest_m < self.largest_m < self.period_m:
            sizes = f"{self.smallest_m:g}, {self.largest_m:g}, {self.period_m:g}"
            problems.append(f"expected 0 < smallest_m < largest_m < period_m, got {sizes}")
        if not self.sight_m > 0:
            problems.append(f"expected sight_m > 0, got {self.sight_m:g}")
        if not self.flakes_per_m3 >= 0:
            problems.append(f"expected flakes_per_m3 >= 0, got {self.flakes_per_m3:g}")
        if not problems and self.flakes_per_m3 * self.side_m**3 * FACES_PER_FLAKE > MOST_FACES:
            wanted, most = self.flakes_per_m3 * self.side_m**3, MOST_FACES / FACES_PER_FLAKE
            problems.append(
                f"expected flakes_per_m3 * (period_m + 2 sight_m)^3 of at most {most:.0f}, got {wanted:.0f}"
            )
        if problems:
            raise ValueError("; ".join(problems))

    @property
    def side_m(self) -> float:
        """Of the cube of flakes in the mesh."""
        return self.period_m + 2 * self.sight_m

    @property
    def velocity_m_per_s(self) -> FloatArray:
        """Of the flakes in the world frame, shape (3,)."""
        return np.asarray(check_vector("drift_m_per_s", self.drift_m_per_s) - [0.0, 0.0, self.sinking_m_per_s])


def snow_surface(snow: MarineSnow) -> Surface:
    """All flakes, closed octahedra, in a frame of their own: a cube of `side_m` about its origin."""
    rng = np.random.default_rng(snow.seed)
    count = round(snow.flakes_per_m3 * snow.period_m**3)
    centres = rng.uniform(-snow.period_m / 2, snow.period_m / 2, (count, 3))
    radius = diameters_m(snow, rng.uniform(size=count)) / 2
    turn = Rotation.random(count, rng=rng).as_matrix()
    flakes = np.einsum("nij,kj->nki", turn, OCTAHEDRON * SEMI_AXES) * radius[:, np.newaxis, np.newaxis]
    shade = rng.uniform(*SHADES, count)
    reach = int(np.ceil(snow.sight_m / snow.period_m))
    steps = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    places = centres + snow.period_m * steps[:, np.newaxis]
    copy, flake = np.nonzero((np.abs(places) <= snow.side_m / 2).all(axis=-1))
    vertices = places[copy, flake][:, np.newaxis] + flakes[flake]
    faces = OCTAHEDRON_FACES + len(OCTAHEDRON) * np.arange(len(flake))[:, np.newaxis, np.newaxis]
    colour = np.repeat(shade[flake], len(OCTAHEDRON))[:, np.newaxis] * np.ones(3)
    return surface(vertices, faces, Material.SNOW, colour)


def snow_offset_m(snow: MarineSnow, robot_m: FloatArray, time_s: FloatArray) -> FloatArray:
    """Where the origin of the flakes' frame lies in the world: world = flakes + offset.

    It moves with the flakes and steps by whole periods, which nobody sees: the robot stays within half a period of it
    along each axis, so that all within `sight_m` of the robot is filled.

    Parameters
    ----------
    snow : MarineSnow
    robot_m : array, shape (n, 3)
        World frame.
    time_s : array, shape (n,)

    Returns
    -------
    array, shape (n, 3)
    """
    moved = np.multiply.outer(time_s, snow.velocity_m_per_s)
    return np.asarray(moved + snow.period_m * np.round((robot_m - moved) / snow.period_m))


def diameters_m(snow: MarineSnow, fraction: ArrayLike) -> FloatArray:
    """Diameter below which a fraction of the flakes lies: the power law's cumulative distribution inverted."""
    power = 1 - JUNGE_EXPONENT
    low, high = snow.smallest_m**power, snow.largest_m**power
    return np.asarray((low + np.asarray(fraction) * (high - low)) ** (1 / power))
