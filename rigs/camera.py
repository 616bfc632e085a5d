"""Sections of the rig file about the camera: where it stands, how large its image is, how its lens projects.

Frames are those of `docs/reference/conventions.md`: in the body x is forward, y left and z up, in the camera x right,
y down and z forward.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from rigs.section import Number, Positive, Section, Vector3, Whole


class CameraPose(Section):
    """Where the camera's pinhole is in the body frame, and how it is turned.

    With all angles zero the optical axis is the body's +x and image-up is the body's +z. Yaw turns to the left,
    pitch up, roll clockwise as seen from behind the camera; they apply in the order roll, pitch, yaw.
    """

    position_mm: Vector3
    yaw_deg: Number = 0.0
    pitch_deg: Number = 0.0
    roll_deg: Number = 0.0


class ImageSize(CameraPose):
    """Pixels and intrinsics shared by both camera models; pixel (0, 0) is the centre of the top-left pixel.

    `response_file` is a CSV of the sensor's spectral response: wavelength_nm, red, green, blue.
    """

    width_px: Annotated[Whole, Field(gt=0, le=20000)]
    height_px: Annotated[Whole, Field(gt=0, le=20000)]
    fx_px: Positive
    fy_px: Positive
    cx_px: Number
    cy_px: Number
    response_file: Path | None = None

    @model_validator(mode="after")
    def _principal_point_is_in_the_image(self) -> Self:
        if not (-0.5 <= self.cx_px <= self.width_px - 0.5 and -0.5 <= self.cy_px <= self.height_px - 0.5):
            raise ValueError(
                f"expected a principal point inside the {self.width_px} x {self.height_px} image, "
                f"got cx_px = {self.cx_px}, cy_px = {self.cy_px}"
            )
        return self


class PinholeSpec(ImageSize):
    """Pinhole with OpenCV's distortion (k1, k2, p1, p2, k3[, k4, k5, k6]); calibrated in air."""

    model: Literal["pinhole"]
    distortion: tuple[Number, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _distortion_has_five_or_eight(self) -> Self:
        if len(self.distortion) not in (5, 8):
            raise ValueError(f"expected 5 or 8 distortion coefficients, got {len(self.distortion)}")
        return self


class FisheyeSpec(ImageSize):
    """Kannala-Brandt fisheye, as OpenCV's fisheye module: r = f (t + k1 t^3 + k2 t^5 + k3 t^7 + k4 t^9)."""

    model: Literal["fisheye"]
    distortion: tuple[Number, Number, Number, Number] = (0.0, 0.0, 0.0, 0.0)


Camera = Annotated[PinholeSpec | FisheyeSpec, Field(discriminator="model")]
