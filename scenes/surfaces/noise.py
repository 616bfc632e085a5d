"""Gradient noise: smooth random fields in space for terrain, relief and colour."""

from __future__ import annotations

import numpy as np

from optics.kernels.arrays import FloatArray

TABLE_SIZE = 256
BLOCK = 4096
"""Points at a time: what is known of them stays in the processor's cache, which is three times as fast."""


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
        places = points.reshape(-1, 3)
        blocks = [self._of(places[first : first + BLOCK]) for first in range(0, len(places), BLOCK)]
        return np.concatenate([np.empty(0), *blocks]).reshape(points.shape[:-1])

    def _of(self, points: FloatArray) -> FloatArray:
        cell = np.floor(points.T)
        inside = points.T - cell
        fade = inside**3 * (inside * (inside * 6 - 15) + 10)
        weights, offsets, lattice = (1 - fade, fade), (inside, inside - 1), cell.astype(np.int64)
        # The table has a power of two: masking is the remainder, also below zero.
        order, last = self._order, TABLE_SIZE - 1
        total = np.zeros(len(points))
        for i, j in np.ndindex(2, 2):
            beside = order[(order[(lattice[0] + i) & last] + lattice[1] + j) & last] + lattice[2]
            weight = weights[i][0] * weights[j][1]
            for k in range(2):
                x, y, z = self._gradients[:, order[(beside + k) & last]]
                total += weight * weights[k][2] * (x * offsets[i][0] + y * offsets[j][1] + z * offsets[k][2])
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


def smoothstep(value: FloatArray, low: float, high: float) -> FloatArray:
    """0 below `low`, 1 above `high`, smooth in between."""
    position = np.clip((value - low) / (high - low), 0, 1)
    return position * position * (3 - 2 * position)
