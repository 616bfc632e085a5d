"""Rays of a frame where they leave the port: which pixels and samples they stand for, and in which order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import aligned, aligned_room
from optics.kernels.backend import Array3f32, Float32, UInt32
from optics.layout import camera_pose
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig
from scenes.kernels.tracing import Rays

TILE_PX = 4
"""A tile's rays are one vector of the processor."""

PIXELS_AT_ONCE = 1 << 16
"""Followed in double precision together: memory for all of a large frame takes longer to get than to fill."""


def port_rays(rig: Rig, rows: int, columns: int, samples: int) -> Rays:
    """Rays on the port's outer face in the body frame, sample by sample of each pixel, in single precision.

    They are computed tile by tile, so that rays of one vector stay close together; `place` says where each belongs.
    """
    train, pose = OpticalTrain.bare(rig), camera_pose(rig.camera)
    tiled, grid = _tiles(rows, columns), pixel_grid(train.camera, columns, rows)
    spread = _spread(samples) * [train.camera.width_px / columns, train.camera.height_px / rows]
    # Radiance falls by the square of the index on its path from the water into the air before the lens.
    fall = (train.port.n_inside / train.port.n_water) ** 2
    numbers = [aligned_room(len(tiled) * samples, np.float32) for _ in range(7)]
    for start in range(0, len(tiled), PIXELS_AT_ONCE):
        centres = grid[tiled[start : start + PIXELS_AT_ONCE]]
        pixels = (centres[:, np.newaxis] + spread).reshape(-1, 2)
        rays = train.trace(pixels).moved(pose)
        gain = np.where(rays.passed, train.transmittance(pixels) * fall, 0)
        some = slice(start * samples, start * samples + len(pixels))
        for column, values in zip(numbers, (*rays.origin_m.T, *rays.direction.T, gain), strict=True):
            column[some] = values
    *lines, gain = map(Float32, numbers)
    return Rays(
        origin=Array3f32(*lines[:3]),
        direction=Array3f32(*lines[3:]),
        gain=gain,
        place=UInt32(aligned(np.add.outer(tiled * samples, np.arange(samples)), np.uint32)),
    )


def _tiles(rows: int, columns: int) -> NDArray[np.int64]:
    """Pixel numbers (row by row), ordered by tiles."""
    down, across = -(-rows // TILE_PX), -(-columns // TILE_PX)
    numbers = np.full((down * TILE_PX, across * TILE_PX), -1)
    numbers[:rows, :columns] = np.arange(rows * columns).reshape(rows, columns)
    tiles = numbers.reshape(down, TILE_PX, across, TILE_PX).swapaxes(1, 2).ravel()
    return tiles[tiles >= 0]


def _spread(count: int) -> NDArray[np.float64]:
    """`count` points spread evenly over the unit square around zero; one point is its centre.

    The R2 sequence (Roberts 2018, an additive recurrence with the plastic number), shifted so that its mean is zero.
    """
    plastic = 1.32471795724474602596
    steps = np.arange(count)[:, np.newaxis] / np.array([plastic, plastic**2])
    points = (0.5 + steps) % 1 - 0.5
    return np.asarray(points - points.mean(axis=0))
