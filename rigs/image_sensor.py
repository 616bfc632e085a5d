"""Section of the rig file about the image sensor: pixels, noise, read-out, exposure and white balance.

Terms and symbols are those of EMVA 1288 (release 4.0, linear). The defaults are a camera of the class of Sony's
IMX322/IMX323, which the BlueROV2 carries. From the data sheet of the IMX323LQN-C (Rev. 0.2): 6.23 mm diagonal and about
2.2 million pixels, lens of f/2.8 or slower, analogue gain of 0 to 21 dB, converter of 12 bits, shutter in steps of a
row, primary colour filters. 1125 rows in 1/30 s make the row time. All other defaults are nominal: of the usual size
for such pixels, and yours to change.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from rigs.section import NotNegative, Number, Positive, Section, Whole

BayerPattern = Literal["none", "rggb", "bggr", "grbg", "gbrg"]

Fraction = Annotated[Number, Field(gt=0, le=1)]
PositiveRgb = tuple[Positive, Positive, Positive]


class ExposureSpec(Section):
    """How long and with how much gain the sensor exposes.

    `auto` brings the metered level to `target_level` of full scale, with a lag of `lag_s`; it starts from `time_us` and
    `gain_db`, which `manual` keeps. Without `longest_us` a frame may be exposed as long as it lasts.
    """

    mode: Literal["auto", "manual"] = "auto"
    time_us: Positive = 5000.0
    gain_db: NotNegative = 0.0
    shortest_us: Positive = 29.6
    longest_us: Positive | None = None
    metering: Literal["average", "centre"] = "centre"
    target_level: Annotated[Number, Field(gt=0, lt=1)] = 0.18
    lag_s: NotNegative = 0.3


class WhiteBalanceSpec(Section):
    """How the colours are balanced.

    `grey-world` makes the image's mean grey, with a lag of `lag_s`; `grey-card` is set once on a card; `manual` uses
    `gains` for red, green and blue. No channel is raised by more than `largest_gain`.
    """

    mode: Literal["grey-world", "grey-card", "manual"] = "grey-world"
    gains: PositiveRgb = (1.0, 1.0, 1.0)
    largest_gain: Annotated[Number, Field(ge=1)] = 8.0
    lag_s: NotNegative = 1.0


class ImageSensorSpec(Section):
    """The image sensor and the lens's aperture, in the terms of EMVA 1288.

    `quantum_efficiency` holds the peaks of the red, green and blue response, colour filters included;
    `gain_e_per_dn` is 1/K at 0 dB; `dark_current_e_per_s` is that at 25 degrees Celsius, and `temperature_celsius` the
    sensor's own; `prnu` is a fraction; `row_time_us` is the time from row to row, 0 for a global shutter;
    `pattern_seed` makes the fixed pattern.
    """

    pixel_pitch_um: Positive = 2.8
    f_number: Annotated[Number, Field(ge=0.5, le=64)] = 2.8
    lens_transmittance: Fraction = 0.9
    vignetting: Literal["cos4", "none"] = "cos4"
    quantum_efficiency: tuple[Fraction, Fraction, Fraction] = (0.45, 0.55, 0.50)
    full_well_e: Positive = 9000.0
    read_noise_e: NotNegative = 3.0
    dark_current_e_per_s: NotNegative = 5.0
    dark_current_doubling_celsius: Positive = 7.0
    temperature_celsius: Annotated[Number, Field(ge=-40, le=100)] = 35.0
    prnu: Annotated[Number, Field(ge=0, le=0.2)] = 0.01
    dsnu_e: NotNegative = 1.0
    pattern_seed: Annotated[Whole, Field(ge=0)] = 0
    bits: Annotated[Whole, Field(ge=8, le=16)] = 12
    gain_e_per_dn: Positive = 2.3
    largest_gain_db: Annotated[Number, Field(ge=0, le=60)] = 21.0
    black_level_dn: Annotated[Whole, Field(ge=0)] = 240
    bayer: BayerPattern = "rggb"
    frame_rate_hz: Positive = 30.0
    row_time_us: NotNegative = 29.6
    exposure: ExposureSpec = ExposureSpec()
    white_balance: WhiteBalanceSpec = WhiteBalanceSpec()

    @model_validator(mode="after")
    def _numbers_fit_each_other(self) -> Self:
        exposure, frame_us = self.exposure, 1e6 / self.frame_rate_hz
        expected = []
        if self.black_level_dn >= 2 ** (self.bits - 1):
            expected.append(
                f"black_level_dn below half of what {self.bits} bits hold ({2 ** (self.bits - 1)}), "
                f"got {self.black_level_dn}"
            )
        if exposure.longest_us is not None and exposure.longest_us > frame_us:
            expected.append(
                f"exposure.longest_us within a frame ({frame_us:.0f} us at {self.frame_rate_hz:g} Hz), "
                f"got {exposure.longest_us:g}"
            )
        if not exposure.shortest_us <= exposure.time_us <= self.longest_exposure_us:
            expected.append(
                f"exposure.time_us from exposure.shortest_us ({exposure.shortest_us:g}) to the longest exposure "
                f"({self.longest_exposure_us:.0f}), got {exposure.time_us:g}"
            )
        if exposure.gain_db > self.largest_gain_db:
            expected.append(
                f"exposure.gain_db of at most largest_gain_db ({self.largest_gain_db:g}), got {exposure.gain_db:g}"
            )
        if expected:
            raise ValueError("expected " + "; ".join(expected))
        return self

    @property
    def longest_exposure_us(self) -> float:
        """Longest exposure time: as stated, else a whole frame."""
        return self.exposure.longest_us if self.exposure.longest_us is not None else 1e6 / self.frame_rate_hz
