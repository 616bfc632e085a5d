"""From radiance in front of the lens to digital numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import aligned
from optics.kernels.backend import Float32, UInt32, UInt64, dr
from optics.kernels.freezing import frozen
from optics.kernels.packing import opaque_numbers
from scenes.sensor.model import ImageSensor
from scenes.sensor.noise import TAIL, mean_below, mean_signal, noisy_signal

FloatImage = NDArray[np.float32]

BRIGHTEST = 4.0
"""Times the full well: brighter light changes nothing but the size of the numbers."""


NO_NUMBER = 2**16
"""More than any converter says."""


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


def expose(radiance: FloatImage, sensor: ImageSensor, settings: CameraSettings, key: int | None = None) -> RawImage:
    """Expose the sensor once.

    Parameters
    ----------
    radiance : array, shape (height, width, 3)
        In front of the lens, W / (m^2 sr nm), averaged over each channel's band.
    sensor : ImageSensor
    settings : CameraSettings
    key : int, optional
        Of the noise (`frame_key`). Without it, the expected value of the digital numbers comes out: the mean of
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
    channels = [Float32(aligned(radiance[..., channel], np.float32)) for channel in range(3)]
    if key is not None:
        return read_out([channels], sensor, settings, key)
    per_dn = sensor.electrons_per_dn(settings.gain_db)
    spec, offset = sensor.spec, sensor.dark_offset_e
    charges = _collected([channels], sensor.pixels, sensor.planes, _numbers(sensor, settings))
    charge_e = np.stack([charge.numpy() for charge in charges], axis=-1).reshape(sensor.responsivity.shape)
    end_e = np.float32((sensor.largest_dn - spec.black_level_dn) * per_dn) - offset
    well_e = _well_that_shows(sensor, per_dn)
    mean = mean_signal(charge_e, read_noise_e=spec.read_noise_e, full_well_e=well_e, end_e=end_e)
    mean = (mean + offset) / np.float32(per_dn) + np.float32(spec.black_level_dn)
    # The other end of the converter, at 0: only darkness reaches it.
    variance = (charge_e + np.float32(spec.read_noise_e**2)) / np.float32(per_dn**2)
    return RawImage(digital_numbers=-mean_below(-mean, variance, 0.0), settings=settings)


def read_out(
    sweeps: Sequence[Sequence[Any]],
    sensor: ImageSensor,
    settings: CameraSettings,
    key: int,
    pixels: NDArray[np.integer[Any]] | None = None,
) -> RawImage:
    """Expose the sensor to the mean of several sweeps, where they are still on the device.

    Parameters
    ----------
    sweeps : sequence of [red, green, blue]
        Flat Dr.Jit arrays of radiance; what is below zero counts as zero.
    sensor, settings, key
        As of `expose`.
    pixels : array, optional
        Numbers (row by row) of the pixels that the radiance is of, when it is not all of them in their order; the
        others read zero. A pixel reads the same whichever others are exposed.

    Raises
    ------
    ValueError
        For radiance that is not a number.
    """
    exposed = sensor.pixels if pixels is None else UInt32(aligned(pixels, np.uint32))
    noise = dr.opaque(UInt64, key)
    found = _read_out([list(each) for each in sweeps], exposed, sensor.planes, _numbers(sensor, settings), noise)
    numbers = np.stack([each.numpy() for each in found], axis=-1)
    if numbers.max(initial=0) > sensor.largest_dn:
        raise ValueError("expected radiance that is a number everywhere, got one that is not")
    shape = sensor.responsivity.shape
    if pixels is None:
        return RawImage(digital_numbers=numbers.astype(np.uint16).reshape(shape), settings=settings)
    whole = np.zeros((sensor.height_px * sensor.width_px, len(found)), dtype=np.uint16)
    whole[pixels] = numbers
    return RawImage(digital_numbers=whole.reshape(shape), settings=settings)


def _numbers(sensor: ImageSensor, settings: CameraSettings) -> list[Any]:
    """What the kernels below take of sensor and settings, in their order."""
    spec, per_dn = sensor.spec, sensor.electrons_per_dn(settings.gain_db)
    return opaque_numbers(
        [
            settings.exposure_s,
            sensor.dark_current_e_per_s * settings.exposure_s,
            BRIGHTEST * spec.full_well_e,
            spec.read_noise_e,
            min(_well_that_shows(sensor, per_dn), float(np.finfo(np.float32).max)),
            per_dn,
            spec.black_level_dn,
            sensor.largest_dn,
        ]
    )


@frozen()
def _collected(sweeps: list[list[Any]], pixels: Any, planes: list[Any], numbers: list[Any]) -> list[Any]:
    """Frozen kernel of `_charges`."""
    return _charges(sweeps, pixels, planes, numbers)[0]


@frozen()
def _read_out(sweeps: list[list[Any]], pixels: Any, planes: list[Any], numbers: list[Any], key: Any) -> list[Any]:
    """Frozen kernel: digital numbers, `NO_NUMBER` where the radiance was not a number."""
    read_noise_e, full_well_e, per_dn, black, largest = numbers[3:]
    found = []
    for charge, place in zip(*_charges(sweeps, pixels, planes, numbers), strict=True):
        signal = noisy_signal(charge, read_noise_e=read_noise_e, full_well_e=full_well_e, key=key, number=place)
        number = dr.round((signal + dr.gather(Float32, planes[1], place)) / per_dn + black)
        found.append(dr.select(dr.isnan(charge), NO_NUMBER, UInt32(dr.clip(number, 0, largest))))
    return found


def _charges(
    sweeps: list[list[Any]], pixels: Any, planes: list[Any], numbers: list[Any]
) -> tuple[list[Any], list[Any]]:
    """Kernel: mean charge before it saturates, electrons, photo electrons and dark current; and places in the planes.

    One array behind a mosaic of filters, else one for each channel.
    """
    exposure_s, dark_e, brightest_e = numbers[:3]
    radiance = []
    for of_sweeps in zip(*sweeps, strict=True):
        # A comparison, since the larger of zero and what is not a number would be zero.
        lit = [dr.select(each < 0, 0, each) for each in of_sweeps]
        radiance.append(sum(lit[1:], lit[0]) / len(lit))
    places = [pixels * 3 + channel for channel in range(3)]
    if len(planes) == 3:
        channel, places = dr.gather(UInt32, planes[2], pixels), [pixels]
        radiance = [dr.select(channel == 0, radiance[0], dr.select(channel == 1, radiance[1], radiance[2]))]
    charges = []
    for light, place in zip(radiance, places, strict=True):
        charge = light * dr.gather(Float32, planes[0], place) * exposure_s + dark_e
        charges.append(dr.select(charge > brightest_e, brightest_e, charge))
    return charges, places


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
