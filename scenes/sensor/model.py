"""An image sensor behind its lens: the rig file's numbers in SI, and what differs from pixel to pixel."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.constants import c as speed_of_light
from scipy.constants import h as planck

from optics.kernels.arrays import FloatArray, aligned
from optics.kernels.backend import Float32, UInt32
from rigs import Rig
from rigs.camera import Camera, PinholeSpec
from rigs.image_sensor import ImageSensorSpec
from scenes.light.spectrum import CHANNEL_PEAKS_NM, CHANNEL_WIDTH_NM, CameraResponse, read_camera_response
from scenes.sensor.bayer import mosaic
from scenes.sensor.noise import fixed_pattern

FloatImage = NDArray[np.float32]

DARK_CURRENT_REFERENCE_CELSIUS = 25.0
"""Temperature at which the rig file gives the dark current."""

VISIBLE_NM = np.arange(400, 700.25, 0.25)
"""Where the renderer's bands lie: light beyond is not rendered and makes no electrons."""


@dataclass(frozen=True, kw_only=True)
class ImageSensor:
    """A sensor of a given image size; planes are (height, width), or (height, width, 3) without a Bayer mosaic.

    Attributes
    ----------
    spec : ImageSensorSpec
        The rig file's numbers.
    height_px, width_px : int
    electron_rate : array, shape (3,)
        Electrons per second and radiance of red, green and blue pixels on the axis, 1 / (s W/(m^2 sr nm)).
    responsivity : array, planes
        The same of each pixel, with vignetting and PRNU.
    dark_offset_e : array, planes
        DSNU, electrons.
    row_time_s : float
        From one row of this image to the next; 0 for a global shutter.
    """

    spec: ImageSensorSpec
    height_px: int
    width_px: int
    electron_rate: FloatArray
    responsivity: FloatImage
    dark_offset_e: FloatImage
    row_time_s: float

    @classmethod
    def from_rig(cls, rig: Rig, *, width_px: int | None = None, height_px: int | None = None) -> Self:
        """Sensor of a rig, or a nominal one where the rig names none.

        An image smaller than the camera's is taken from every second, third ... pixel: a pixel stays what it is, and
        the whole image takes as long to read.

        Parameters
        ----------
        rig : Rig
        width_px, height_px : int, optional
            Size of the image; the camera's own by default.

        Raises
        ------
        ValueError
            When the rows take longer to read than a frame lasts, or the camera's response file is no good.
        """
        spec, response = checked_sensor(rig)
        width, height = width_px or rig.camera.width_px, height_px or rig.camera.height_px
        illumination = relative_illumination(rig.camera, width, height, spec.vignetting)
        by_channel = electron_rate(spec, response)
        ideal = mosaic((illumination[..., None] * by_channel).astype(np.float32), spec.bayer)
        gain_pattern, offset_pattern = fixed_pattern(spec.pattern_seed, ideal.shape)
        return cls(
            spec=spec,
            height_px=height,
            width_px=width,
            electron_rate=by_channel,
            responsivity=ideal * np.maximum(1 + np.float32(spec.prnu) * gain_pattern, 0),
            dark_offset_e=np.float32(spec.dsnu_e) * offset_pattern,
            row_time_s=_read_out_s(rig, spec) / height,
        )

    @cached_property
    def planes(self) -> list[Any]:
        """Responsivity, dark offset and, behind a mosaic, the number of each pixel's channel, as kernels take them."""
        planes = [Float32(aligned(plane, np.float32)) for plane in (self.responsivity, self.dark_offset_e)]
        if self.spec.bayer == "none":
            return planes
        channels = np.broadcast_to(np.arange(3, dtype=np.float32), (self.height_px, self.width_px, 3))
        return [*planes, UInt32(aligned(mosaic(channels, self.spec.bayer), np.uint32))]

    @cached_property
    def pixels(self) -> Any:
        """Numbers of all pixels, row by row, as kernels take them."""
        return UInt32(aligned(np.arange(self.height_px * self.width_px), np.uint32))

    @property
    def largest_dn(self) -> int:
        """Full scale of the converter, digital numbers."""
        return int(2**self.spec.bits) - 1

    @property
    def frame_time_s(self) -> float:
        """From one frame to the next."""
        return 1 / self.spec.frame_rate_hz

    @property
    def dark_current_e_per_s(self) -> float:
        """Dark current at the sensor's temperature: it doubles every few kelvin (EMVA 1288 R4 Linear, section 2.6)."""
        above = self.spec.temperature_celsius - DARK_CURRENT_REFERENCE_CELSIUS
        return float(self.spec.dark_current_e_per_s * 2 ** (above / self.spec.dark_current_doubling_celsius))

    def electrons_per_dn(self, gain_db: float) -> float:
        """1 / K at an analogue gain."""
        return float(self.spec.gain_e_per_dn / 10 ** (gain_db / 20))


def checked_sensor(rig: Rig) -> tuple[ImageSensorSpec, CameraResponse | None]:
    """Numbers of a rig's sensor, and what its camera's response file says where it names one.

    Raises
    ------
    ValueError
        When the rows take longer to read than a frame lasts, or the camera's response file is no good.
    """
    spec = rig.image_sensor or ImageSensorSpec()
    read_out_s, frame_s = _read_out_s(rig, spec), 1 / spec.frame_rate_hz
    if read_out_s > frame_s:
        raise ValueError(
            f"image_sensor.row_time_us = {spec.row_time_us:g}: expected {rig.camera.height_px} rows within a frame "
            f"({1e3 * frame_s:.1f} ms at {spec.frame_rate_hz:g} Hz), which allows "
            f"{1e6 * frame_s / rig.camera.height_px:.1f} us; they take {1e3 * read_out_s:.1f} ms"
        )
    file = rig.camera.response_file
    return spec, None if file is None else read_camera_response(file)


def _read_out_s(rig: Rig, spec: ImageSensorSpec) -> float:
    """How long the whole image takes to read."""
    return spec.row_time_us * 1e-6 * rig.camera.height_px


def electron_rate(spec: ImageSensorSpec, response: CameraResponse | None) -> FloatArray:
    """Electrons per second and radiance on the axis, shape (3,), 1 / (s W/(m^2 sr nm)).

    Irradiance behind a lens focused far away is E = pi L tau / (4 N^2). A frame's radiance is an average weighted by
    the response per watt, R. The quantum efficiency is stated at R's peak, so QE lambda is QE_peak lambda_peak R /
    R_peak, and electrons are that average times QE_peak lambda_peak / (h c) times the integral of R / R_peak.
    """
    if response is None:
        peak_nm = np.asarray(CHANNEL_PEAKS_NM)
        width_nm = np.full(3, np.sqrt(2 * np.pi) * CHANNEL_WIDTH_NM)
    else:
        within = [
            np.interp(VISIBLE_NM, response.wavelength_nm, channel, left=0, right=0) for channel in response.response
        ]
        peak_nm = np.array([VISIBLE_NM[channel.argmax()] for channel in within])
        width_nm = np.array([np.trapezoid(channel, VISIBLE_NM) / channel.max() for channel in within])
    per_joule = np.asarray(spec.quantum_efficiency) * peak_nm * 1e-9 / (planck * speed_of_light)
    lens = np.pi * spec.lens_transmittance / (4 * spec.f_number**2)
    area_m2 = (spec.pixel_pitch_um * 1e-6) ** 2
    return np.asarray(lens * area_m2 * width_nm * per_joule)


def relative_illumination(camera: Camera, width_px: int, height_px: int, vignetting: str) -> FloatArray:
    """Irradiance of an even scene relative to that on the axis, shape (height, width).

    A pinhole lens falls off as cos^4 of the angle in air. Fisheyes are built against that fall, by pupils that turn and
    grow with the angle: theirs is taken as even.
    """
    if vignetting == "none" or not isinstance(camera, PinholeSpec):
        return np.ones((height_px, width_px))
    # Pixel centres of the smaller image in the camera's own pixels.
    u = (np.arange(width_px) + 0.5) * camera.width_px / width_px - 0.5
    v = (np.arange(height_px) + 0.5) * camera.height_px / height_px - 0.5
    pixels = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 1, 2)
    matrix = np.array([[camera.fx_px, 0, camera.cx_px], [0, camera.fy_px, camera.cy_px], [0, 0, 1]])
    slope = cv2.undistortPoints(pixels, matrix, np.array(camera.distortion)).reshape(height_px, width_px, 2)
    return np.asarray((1 + (slope**2).sum(axis=-1)) ** -2)
