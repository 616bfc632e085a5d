"""Generalised winding numbers on a grid, by one Fourier transform.

The winding number w of a surface jumps by 1 across it and is harmonic elsewhere (A. Jacobson, L. Kavan and
O. Sorkine-Hornung, "Robust inside-outside segmentation using generalized winding numbers", ACM Trans. Graph. 32(4),
2013): with V the density of the surface's area vectors, div grad w = -div V. Spread over a grid and solved by Fourier's
transform, as M. Kazhdan, "Reconstruction of solid models from oriented point sets", SGP 2005, does for closed surfaces,
it is w blurred over a cell of the grid. The grid repeats: beyond a margin the surface's images are too far to matter.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from optics.kernels.arrays import FloatArray

MARGIN = 8
"""Cells between the surface and the end of the grid."""


@dataclass(frozen=True, kw_only=True)
class WindingGrid:
    """Winding numbers at the nodes of a grid that begins at `low`."""

    low: FloatArray
    step: float
    values: FloatArray

    @classmethod
    def of(cls, places: FloatArray, areas: FloatArray, step: float) -> WindingGrid:
        """Winding numbers of a surface.

        Parameters
        ----------
        places : array, shape (n, 3)
            All over it, denser than the grid.
        areas : array, shape (n, 3)
            Area vector of each place: along its front's normal.
        step : float
            Of the grid.
        """
        low = places.min(axis=0) - MARGIN * step
        counts = np.ceil(np.ptp(places, axis=0) / step).astype(int) + 2 * MARGIN + 1
        shape = tuple(fft.next_fast_len(int(count), real=True) for count in counts)
        density = _spread((places - low) / step, areas / step**3, shape)
        waves = [2 * np.pi * fft.fftfreq(count, step) for count in shape[:2]]
        waves.append(2 * np.pi * fft.rfftfreq(shape[2], step))
        k = np.meshgrid(*waves, indexing="ij", sparse=True)
        square = sum(wave**2 for wave in k)
        square[0, 0, 0] = 1
        spectrum = sum(1j * wave * fft.rfftn(part) for wave, part in zip(k, density, strict=True)) / square
        spectrum[0, 0, 0] = 0
        values = fft.irfftn(spectrum, s=shape)
        ends = [np.take(values, end, axis=axis).ravel() for axis in range(3) for end in (0, -1)]
        return cls(low=low, step=step, values=values - np.concatenate(ends).mean())

    def at(self, axes: list[FloatArray]) -> NDArray[np.float32]:
        """Winding numbers at the nodes of another grid, given by its coordinates along each axis."""
        values = self.values.astype(np.float32)
        for axis, coordinates in enumerate(axes):
            place = (coordinates - self.low[axis]) / self.step
            first = np.clip(np.floor(place).astype(int), 0, values.shape[axis] - 2)
            share = (place - first).astype(np.float32).reshape([-1 if other == axis else 1 for other in range(3)])
            values = np.take(values, first, axis) * (1 - share) + np.take(values, first + 1, axis) * share
        return np.asarray(values)


def _spread(places: FloatArray, vectors: FloatArray, shape: tuple[int, ...]) -> list[FloatArray]:
    """Sum of vectors at the nodes around each place, by how near they are; one array for each of x, y, z."""
    first = np.floor(places).astype(np.int64)
    share = places - first
    sums = [np.zeros(int(np.prod(shape))) for _ in range(3)]
    for corner in product((0, 1), repeat=3):
        weight = np.where(corner, share, 1 - share).prod(axis=1)
        node = np.ravel_multi_index(tuple((first + corner).T), shape)
        for axis in range(3):
            sums[axis] += np.bincount(node, weight * vectors[:, axis], minlength=len(sums[axis]))
    return [total.reshape(shape) for total in sums]
