"""From radiance in front of the lens to digital numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.sensor.bayer import mosaic
from scenes.sensor.model import ImageSensor
from scenes.sensor.noise import TAIL, mean_below, mean_signal, noisy_signal

FloatImage = NDArray[np.float32]

BRIGHTEST = 4.0
"""Times the full well: brighter light changes nothing but the size of the numbers."""


@dataclass(frozen=True, kw_only=True)
class CameraSettings:
    """What a camera sets from frame to frame: exposure time, analogue gain, and the colours' white-balance gains."""

    exposure_s: float
    gain_db: float
    white_gains: tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class RawImage:
    """Digital numbers, shape (height, width), or (height, width, 3) without a Bayer mosaic.

    They are uint16, or float32 where they are expected values. `settings` are those of the exposure.
    """

    digital_numbers: NDArray[Any]
    settings: CameraSettings


def expose(
    radiance: FloatImage, sensor: ImageSensor, settings: CameraSettings, rng: np.random.Generator | None = None
) -> RawImage:
    """Expose the sensor once.

    Parameters
    ----------
    radiance : array, shape (height, width, 3)
        In front of the lens, W / (m^2 sr nm), averaged over each channel's band.
    sensor : ImageSensor
    settings : CameraSettings
    rng : numpy.random.Generator, optional
        Of the noise (`frame_generator`). Without it, the expected value of the digital numbers comes out: the mean of
        many noisy images, before they are rounded to whole numbers. The fixed pattern is in both.

    Returns
    -------
    RawImage

    Raises
    ------
    ValueError
        For radiance of another size than the sensor's, below zero or not a number.
    """
    check_radiance(radiance, sensor)
    charge_e = collected_charge(radiance, sensor, settings.exposure_s)
    per_dn = sensor.electrons_per_dn(settings.gain_db)
    spec, offset = sensor.spec, sensor.dark_offset_e
    well_e = _well_that_shows(sensor, per_dn)
    if rng is not None:
        signal = noisy_signal(charge_e, read_noise_e=spec.read_noise_e, full_well_e=well_e, rng=rng)
        numbers = np.rint((signal + offset) / np.float32(per_dn) + np.float32(spec.black_level_dn))
        return RawImage(digital_numbers=np.clip(numbers, 0, sensor.largest_dn).astype(np.uint16), settings=settings)
    end_e = np.float32((sensor.largest_dn - spec.black_level_dn) * per_dn) - offset
    mean = mean_signal(charge_e, read_noise_e=spec.read_noise_e, full_well_e=well_e, end_e=end_e)
    mean = (mean + offset) / np.float32(per_dn) + np.float32(spec.black_level_dn)
    # The other end of the converter, at 0: only darkness reaches it.
    variance = (charge_e + np.float32(spec.read_noise_e**2)) / np.float32(per_dn**2)
    return RawImage(digital_numbers=-mean_below(-mean, variance, 0.0), settings=settings)


def collected_charge(radiance: FloatImage, sensor: ImageSensor, exposure_s: float) -> FloatImage:
    """Mean charge of each pixel before it saturates, electrons: photo electrons and dark current."""
    charge = mosaic(np.asarray(radiance, dtype=np.float32), sensor.spec.bayer) * sensor.responsivity
    charge = charge * np.float32(exposure_s) + np.float32(sensor.dark_current_e_per_s * exposure_s)
    return np.asarray(np.minimum(charge, np.float32(BRIGHTEST * sensor.spec.full_well_e)))


def _well_that_shows(sensor: ImageSensor, electrons_per_dn: float) -> float:
    """Full well, electrons, or infinity where the converter is at its end long before the well is full."""
    end_e = (sensor.largest_dn - sensor.spec.black_level_dn) * electrons_per_dn
    margin_e = TAIL * (sensor.spec.read_noise_e + sensor.spec.dsnu_e)
    return float(sensor.spec.full_well_e) if sensor.spec.full_well_e < end_e + margin_e else np.inf


def check_radiance(radiance: FloatImage, sensor: ImageSensor) -> None:
    """Raise `ValueError` for radiance that the sensor cannot have seen."""
    expected = (sensor.height_px, sensor.width_px, 3)
    if np.shape(radiance) != expected:
        raise ValueError(f"expected radiance of shape {expected}, got {np.shape(radiance)}")
    # The smallest of an array with a NaN is NaN, which compares as false.
    if not np.min(radiance) >= 0:
        raise ValueError(f"expected radiance of at least 0 everywhere, got {np.min(radiance)}")
