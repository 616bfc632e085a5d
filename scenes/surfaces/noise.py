"""Gradient noise: smooth random fields in space for terrain, relief and colour."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray

TABLE_SIZE = 256


class GradientNoise:
    """Perlin's gradient noise (2002, "Improving noise", ACM TOG 21, 681) with random unit gradients.

    Zero on every corner of the integer lattice, smooth to the second derivative, about -0.7 to 0.7, wavelength near 1.

    Parameters
    ----------
    rng : Generator
    """

    def __init__(self, rng: np.random.Generator):
        self._order = rng.permutation(TABLE_SIZE)
        gradients = rng.normal(size=(TABLE_SIZE, 3))
        self._gradients = (gradients / np.linalg.norm(gradients, axis=1, keepdims=True)).T.copy()

    def __call__(self, points: FloatArray) -> FloatArray:
        """Value at points, shape (..., 3) to (...)."""
        cell = np.floor(points)
        inside = np.moveaxis(points - cell, -1, 0)
        fade = inside**3 * (inside * (inside * 6 - 15) + 10)
        lattice = np.moveaxis(cell.astype(np.int64), -1, 0)
        total = np.zeros(points.shape[:-1])
        for corner in np.ndindex(2, 2, 2):
            gradient = self._gradients[
                :, self._hash(*(axis + step for axis, step in zip(lattice, corner, strict=True)))
            ]
            x, y, z = (1 - each if step == 0 else each for each, step in zip(fade, corner, strict=True))
            slopes = (g * (each - step) for g, each, step in zip(gradient, inside, corner, strict=True))
            total += x * y * z * sum(slopes)
        return total

    def octaves(self, points: FloatArray, count: int, *, gain: float = 0.5) -> FloatArray:
        """Sum of noises, each at twice the frequency and `gain` times the height of the one before."""
        total = np.zeros(points.shape[:-1])
        for octave in range(count):
            # A shift per octave, so that their lattices, where all of them are zero, do not coincide.
            total += gain**octave * self(points * 2.0**octave + 17.31 * octave)
        return total

    def ridges(self, points: FloatArray, count: int, *, gain: float = 0.5) -> FloatArray:
        """Sum of noises folded at zero into crests, 0 to about 1 (Musgrave's ridged multifractal without feedback)."""
        total = np.zeros(points.shape[:-1])
        for octave in range(count):
            total += gain**octave * (1 - 2 * np.abs(self(points * 2.0**octave + 17.31 * octave))) ** 2
        return total * (1 - gain) / (1 - gain**count)

    def _hash(self, x: NDArray[np.int64], y: NDArray[np.int64], z: NDArray[np.int64]) -> NDArray[np.int64]:
        order = self._order
        # The table has a power of two: masking is the remainder, also below zero.
        last = TABLE_SIZE - 1
        return np.asarray(order[(order[(order[x & last] + y) & last] + z) & last])


def smoothstep(value: FloatArray, low: float, high: float) -> FloatArray:
    """0 below `low`, 1 above `high`, smooth in between."""
    position = np.clip((value - low) / (high - low), 0, 1)
    return position * position * (3 - 2 * position)
