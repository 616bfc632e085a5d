"""Shutter: at which instants a moving scene must be rendered, and how those frames make one exposure.

Row r is exposed from ``start + r row_time`` for the exposure time. The span from the first row's start to the last
row's end is cut into equal steps, the scene is rendered at the middle of each, and every row averages the steps it was
open for. Rolling shutter and motion blur share the same few frames, and no light is lost or counted twice.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.sensor.model import ImageSensor

FloatArray = NDArray[np.float64]
FloatImage = NDArray[np.float32]


@dataclass(frozen=True, kw_only=True)
class ExposurePlan:
    """When to render, and what each row takes.

    Attributes
    ----------
    times_s : array, shape (n,)
        Instants at which the scene is rendered.
    weight : array, shape (rows, n)
        Share of each rendered frame in each row; rows sum to 1.
    middle_s : array, shape (rows,)
        Middle of each row's exposure: what ground truth should be compared with.
    """

    times_s: FloatArray
    weight: FloatArray
    middle_s: FloatArray


def sample_count(sensor: ImageSensor, *, exposure_s: float, speed_px_per_s: float, most: int) -> int:
    """Frames to render for one exposure, so that the image moves by less than a pixel from one to the next.

    Parameters
    ----------
    sensor : ImageSensor
    exposure_s : float
    speed_px_per_s : float
        Fastest motion in the image.
    most : int
        Not more than this many.
    """
    if most < 1:
        raise ValueError(f"expected at least 1 sample, got most = {most}")
    motion_px = abs(speed_px_per_s) * _span_s(sensor, exposure_s)
    return int(min(most, np.floor(motion_px) + 1))


def exposure_plan(sensor: ImageSensor, *, exposure_s: float, start_s: float, samples: int) -> ExposurePlan:
    """Plan of one exposure that begins at `start_s` and is rendered `samples` times (`sample_count`)."""
    if not exposure_s > 0:
        raise ValueError(f"expected exposure_s > 0, got {exposure_s}")
    if samples < 1:
        raise ValueError(f"expected at least 1 sample, got {samples}")
    edges = np.linspace(0, _span_s(sensor, exposure_s), samples + 1)
    opened = np.arange(sensor.height_px, dtype=np.float64)[:, None] * sensor.row_time_s
    overlap = np.minimum(opened + exposure_s, edges[1:]) - np.maximum(opened, edges[:-1])
    share = np.maximum(overlap, 0)
    return ExposurePlan(
        times_s=start_s + (edges[1:] + edges[:-1]) / 2,
        weight=share / share.sum(axis=1, keepdims=True),
        middle_s=start_s + opened[:, 0] + exposure_s / 2,
    )


def assemble(frames: Iterable[FloatImage], plan: ExposurePlan) -> FloatImage:
    """One exposure's radiance out of the frames rendered at the plan's times.

    Parameters
    ----------
    frames : iterable of array, shape (height, width, 3)
        Radiance, one for each of `plan.times_s`; it may be a generator, so that only one is held at a time.
    plan : ExposurePlan

    Returns
    -------
    array
        float32, shape (height, width, 3).
    """
    exposed: FloatImage | None = None
    count = 0
    for frame in frames:
        if count == len(plan.times_s) or frame.shape[0] != len(plan.weight):
            raise ValueError(
                f"expected {len(plan.times_s)} frames of {len(plan.weight)} rows, "
                f"got frame {count + 1} of {frame.shape[0]} rows"
            )
        if exposed is None:
            exposed = np.zeros(frame.shape, dtype=np.float32)
        open_rows = np.flatnonzero(plan.weight[:, count])
        rows = slice(open_rows[0], open_rows[-1] + 1)
        exposed[rows] += plan.weight[rows, count, None, None].astype(np.float32) * frame[rows]
        count += 1
    if exposed is None or count < len(plan.times_s):
        raise ValueError(f"expected {len(plan.times_s)} frames, got {count}")
    return exposed


def _span_s(sensor: ImageSensor, exposure_s: float) -> float:
    return (sensor.height_px - 1) * sensor.row_time_s + exposure_s
