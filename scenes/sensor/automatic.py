"""Automatic exposure and white balance: what a camera reads from one image and sets for the next.

The state is the camera's settings and nothing else, so a dive resumes from any frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.kernels.arrays import FloatArray
from scenes.sensor.bayer import SITES, site_channels
from scenes.sensor.colour import Rgb, balancing_gains, full_range, grey_card_gains
from scenes.sensor.model import ImageSensor
from scenes.sensor.readout import CameraSettings, FloatImage, RawImage, expose

METERED_CELLS = 40
"""Along the longer side: one pixel of each filter in each cell is metered, 1200 of an image of 4 to 3."""

CENTRE_WIDTH = 0.25
"""Standard deviation of the centre-weighted meter, in widths and heights of the image."""

LARGEST_CORRECTION = 16.0
"""Factor by which one image may call for more or less light: of a black or a white one nothing better is known."""

SATURATED = 0.98
"""Fraction of full scale from which a colour is not to be trusted."""

MOST_TRIALS = 60
SETTLED = 1e-3
"""A still image's settings are searched until they change by less than this, as a fraction."""


@dataclass(frozen=True, kw_only=True)
class Metered:
    """A coarse look at a raw image: linear red, green and blue from 0 to 1, shape (n, 3), and weights, shape (n,)."""

    colour: FloatArray
    weight: FloatArray


def start_settings(sensor: ImageSensor, card_radiance: ArrayLike | None = None) -> CameraSettings:
    """Settings of the first frame.

    Parameters
    ----------
    sensor : ImageSensor
    card_radiance : array_like, shape (3,), optional
        Radiance of a grey card under the water's light, any scale; the mode `grey-card` is set by it.

    Raises
    ------
    ValueError
        When the mode is `grey-card` and there is no card.
    """
    exposure, balance = sensor.spec.exposure, sensor.spec.white_balance
    gains: Rgb = (1.0, 1.0, 1.0)
    if balance.mode == "manual":
        gains = tuple(gain / min(balance.gains) for gain in balance.gains)  # type: ignore[assignment]
    elif card_radiance is not None:
        gains = grey_card_gains(card_radiance, sensor)
    elif balance.mode == "grey-card":
        raise ValueError("expected the radiance of a card for white_balance.mode = 'grey-card', got none")
    return CameraSettings(exposure_s=exposure.time_us * 1e-6, gain_db=exposure.gain_db, white_gains=gains)


def next_settings(raw: RawImage, sensor: ImageSensor, weight: FloatImage | None = None) -> CameraSettings:
    """Settings of the next frame, one frame time later.

    Exposure (time times gain) and white-balance gains follow what the image calls for with a lag of one pole each,
    in their logarithms: x <- x + (1 - exp(-T / lag)) (wanted - x). Time is lengthened before gain is raised.

    Parameters
    ----------
    raw : RawImage
    sensor : ImageSensor
    weight : array, shape (height, width), optional
        Where to meter (say, on the gaze mirror), instead of the rig file's metering.
    """
    return _follow(raw, sensor, weight, with_lag=True)


def settled_settings(
    radiance: FloatImage,
    sensor: ImageSensor,
    *,
    weight: FloatImage | None = None,
    card_radiance: ArrayLike | None = None,
) -> CameraSettings:
    """Settings that a camera comes to rest at in front of a scene that stays."""
    settings = start_settings(sensor, card_radiance)
    for _ in range(MOST_TRIALS):
        before, settings = settings, _follow(expose(radiance, sensor, settings), sensor, weight, with_lag=False)
        if np.allclose(_logarithms(before), _logarithms(settings), rtol=0, atol=SETTLED):
            break
    return settings


def metering_step_px(sensor: ImageSensor) -> int:
    """From one metered pixel of a filter to the next: even, so that all are of one filter."""
    return 2 * max(1, -(-max(sensor.width_px, sensor.height_px) // (2 * METERED_CELLS)))


def metered_pixels(sensor: ImageSensor) -> NDArray[np.bool_]:
    """Which pixels automatic exposure and white balance look at, shape (height, width)."""
    step, metered = metering_step_px(sensor), np.zeros((sensor.height_px, sensor.width_px), dtype=np.bool_)
    for row, column in ((0, 0),) if sensor.spec.bayer == "none" else SITES:
        metered[row::step, column::step] = True
    return metered


def meter(raw: RawImage, sensor: ImageSensor, weight: FloatImage | None = None) -> Metered:
    """Linear colours of a coarse grid of a raw image, before white balance."""
    numbers, pattern, step = raw.digital_numbers, sensor.spec.bayer, metering_step_px(sensor)
    if pattern == "none":
        grid = numbers[::step, ::step].astype(np.float64)
    else:
        rows, columns = -(-(sensor.height_px - 1) // step), -(-(sensor.width_px - 1) // step)
        grid, filters = np.zeros((rows, columns, 3)), [0, 0, 0]
        for row, column, channel in site_channels(pattern):
            grid[..., channel] += numbers[row::step, column::step][:rows, :columns]
            filters[channel] += 1
        grid /= filters
    if weight is None:
        weights = _weights(sensor, grid.shape[:2])
    else:
        weights = np.asarray(weight, dtype=np.float64)[::step, ::step][: grid.shape[0], : grid.shape[1]]
    colour = (grid - sensor.spec.black_level_dn) / full_range(sensor)
    return Metered(colour=colour.reshape(-1, 3), weight=weights.ravel())


def level(metered: Metered, white_gains: Rgb) -> float:
    """Metered level: weighted mean of the white-balanced image, linear, each channel cut at full scale."""
    balanced = np.clip(metered.colour * white_gains, 0, 1).mean(axis=1)
    total = metered.weight.sum()
    if not total > 0:
        raise ValueError("expected metering weights with a positive sum, got none above 0")
    return float(balanced @ metered.weight / total)


def _follow(raw: RawImage, sensor: ImageSensor, weight: FloatImage | None, *, with_lag: bool) -> CameraSettings:
    metered, settings = meter(raw, sensor, weight), raw.settings
    exposure, balance = sensor.spec.exposure, sensor.spec.white_balance
    if exposure.mode == "auto":
        step = _step(sensor, exposure.lag_s) if with_lag else 1.0
        settings = _exposed(settings, sensor, level(metered, settings.white_gains), step)
    if balance.mode == "grey-world":
        step = _step(sensor, balance.lag_s) if with_lag else 1.0
        settings = replace(settings, white_gains=_balanced(settings.white_gains, sensor, metered, step))
    return settings


def _step(sensor: ImageSensor, lag_s: float) -> float:
    """Fraction of the way that one frame goes."""
    return float(-np.expm1(-sensor.frame_time_s / lag_s)) if lag_s > 0 else 1.0


def _exposed(settings: CameraSettings, sensor: ImageSensor, metered_level: float, step: float) -> CameraSettings:
    spec = sensor.spec
    shortest, longest = spec.exposure.shortest_us * 1e-6, spec.longest_exposure_us * 1e-6
    wanted = np.clip(spec.exposure.target_level / max(metered_level, 1e-6), 1 / LARGEST_CORRECTION, LARGEST_CORRECTION)
    # A limit is reached as fast as any other wish: the wish is cut, not the way to it.
    present = settings.exposure_s * 10 ** (settings.gain_db / 20)
    aim = np.clip(present * wanted, shortest, longest * 10 ** (spec.largest_gain_db / 20))
    total = present * (aim / present) ** step
    time_s = float(np.clip(total, shortest, longest))
    return replace(settings, exposure_s=time_s, gain_db=float(max(20 * np.log10(total / time_s), 0.0)))


def _balanced(gains: Rgb, sensor: ImageSensor, metered: Metered, step: float) -> Rgb:
    trusted = (metered.colour < SATURATED).all(axis=1)
    weight = metered.weight * trusted
    if not weight.sum() > 0:
        return gains
    mean = np.maximum(weight @ metered.colour / weight.sum(), 0)
    if not mean.max() > 0:
        return gains
    aim = np.asarray(balancing_gains(mean, sensor.spec.white_balance.largest_gain))
    moved = np.asarray(gains) * (aim / np.asarray(gains)) ** step
    # Between two triples whose smallest is 1 the way may leave 1.
    moved = moved / moved.min()
    return (float(moved[0]), float(moved[1]), float(moved[2]))


def _weights(sensor: ImageSensor, shape: tuple[int, ...]) -> FloatArray:
    if sensor.spec.exposure.metering == "average":
        return np.ones(shape)
    rows, columns = ((np.arange(size) + 0.5) / size - 0.5 for size in shape)
    distance2 = rows[:, None] ** 2 + columns[None, :] ** 2
    return np.exp(-0.5 * distance2 / CENTRE_WIDTH**2)


def _logarithms(settings: CameraSettings) -> FloatArray:
    return np.log([settings.exposure_s * 10 ** (settings.gain_db / 20), *settings.white_gains])
