"""Shutter: at which instants the rows of a moving scene must be rendered, and how many frames make one exposure.

Row r is open from ``start + r row_time`` for the exposure time. A frame that is swept shows every row at an instant of
its own (`scenes.renderer.FastRenderer.render_sweep`); one that shows them in the middle of their exposures is a rolling
shutter's. Motion blur is the mean of several, at even instants within the exposure time.
"""

from __future__ import annotations

import numpy as np

from optics.kernels.arrays import FloatArray
from scenes.sensor.model import ImageSensor


def sweep_count(*, motion_px: float, step_px: float, most: int) -> int:
    """Frames for one exposure, so that the image moves by less than a step from one to the next.

    Parameters
    ----------
    motion_px : float
        How far the image moves while a row is open, where it moves most.
    step_px : float
    most : int
        Not more than this many.
    """
    if most < 1:
        raise ValueError(f"expected at least 1 frame, got most = {most}")
    return int(min(most, np.floor(abs(motion_px) / step_px) + 1))


def sweep_times(sensor: ImageSensor, *, exposure_s: float, start_s: float, sweeps: int) -> FloatArray:
    """Instants at which the first and the last row are rendered, shape (sweeps, 2); rows between them lie evenly.

    Parameters
    ----------
    sensor : ImageSensor
    exposure_s : float
    start_s : float
        When the first row is opened.
    sweeps : int
        Frames that make the exposure (`sweep_count`).
    """
    if not exposure_s > 0:
        raise ValueError(f"expected exposure_s > 0, got {exposure_s}")
    if sweeps < 1:
        raise ValueError(f"expected at least 1 frame, got {sweeps}")
    first = start_s + exposure_s * (np.arange(sweeps) + 0.5) / sweeps
    read_out_s = (sensor.height_px - 1) * sensor.row_time_s
    return np.stack([first, first + read_out_s], axis=-1)
