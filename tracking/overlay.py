"""What the loop sees and thinks, as one image: figure 8 of the paper, with numbers.

A, the camera's image with the outline of the gaze mirror; B, the crop with blobs (green boxes), the line through
their centroids to the estimate (pink, as in figure 10), the prediction (yellow cross) and the crop's centre (white
cross), where the target should be; C, the detector's mask. A line below gives time, mode, joints and error.
"""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from tracking.protocols import CameraFrame
from tracking.records import Mode, Step

Image = NDArray[np.uint8]
Colour = tuple[int, int, int]

STRIP_ROWS = 32
TEXT_SIZE_PX = 15
TEXT_WEIGHT = 500
SMALLEST_WIDTH_PX = 900
"""So much the line of numbers needs."""

PAPER_WHITE: Colour = (240, 244, 248)
INK: Colour = (28, 43, 57)
OUTLINE: Colour = (0, 224, 255)
BLOB: Colour = (60, 230, 90)
ESTIMATE: Colour = (255, 90, 220)
PREDICTION: Colour = (255, 225, 60)
MODE_COLOURS: dict[Mode, Colour] = {
    Mode.CHECK: (120, 134, 150),
    Mode.SCAN: (90, 150, 230),
    Mode.TRACK: (42, 157, 143),
    Mode.PREDICT: (214, 72, 60),
}
SUBPIXEL_BITS = 4
"""OpenCV draws at fixed-point coordinates: sixteenths of a pixel."""

FIELD_STARTS_PX = {"time": 12, "mode": 105, "joints": 215, "asked": 400, "error": 610, "blobs": 815}
"""Where each field of the line begins, so that numbers do not jump about."""


def overlay_size(width_px: int, height_px: int, crop_size: tuple[int, int]) -> tuple[int, int]:
    """Width and height of `overlay`'s images: both even, as H.264 wants them, and the same for all frames.

    Parameters
    ----------
    width_px, height_px : int
        Of the camera's image.
    crop_size : (width, height)
        Of the crop, pixels.
    """
    panel_width, panel_height = _panel_size(height_px, crop_size)
    width = max(width_px + panel_width, SMALLEST_WIDTH_PX)
    return _even(width), _even(max(height_px, 2 * panel_height) + STRIP_ROWS)


def overlay(camera_frame: CameraFrame, step: Step) -> Image:
    """Image of one step of the loop.

    Parameters
    ----------
    camera_frame : CameraFrame
        The image the step was made from.
    step : Step

    Returns
    -------
    array, shape (height, width, 3)
        uint8, sRGB; width and height as `overlay_size` says.
    """
    rows, columns = camera_frame.image.shape[:2]
    crop_size = (step.crop.shape[1], step.crop.shape[0])
    panel = _panel_size(rows, crop_size)
    width, height = overlay_size(columns, rows, crop_size)
    drawn: Image = np.zeros((height, width, 3), dtype=np.uint8)
    drawn[:rows, :columns] = camera_frame.image
    _draw_outline(drawn[:rows, :columns], step.corners_px)
    upper, lower = (drawn[k * panel[1] : (k + 1) * panel[1], columns : columns + panel[0]] for k in range(2))
    upper[:] = _scaled(step.crop, panel, cv2.INTER_LINEAR)
    # The mask's pixels are yes or no, and stay so when the panel is larger.
    lower[:] = _scaled(step.detection.mask, panel, cv2.INTER_NEAREST)[..., np.newaxis]
    _draw_findings(upper, step, scale=panel[0] / crop_size[0])
    _draw_findings(lower, step, scale=panel[0] / crop_size[0])
    for letter, corner in (("A", (0, 0)), ("B", (columns, 0)), ("C", (columns, panel[1]))):
        _letter(drawn, letter, corner)
    _draw_numbers(drawn[height - STRIP_ROWS :], step)
    return drawn


def _even(length: int) -> int:
    return length + length % 2


def _panel_size(height_px: int, crop_size: tuple[int, int]) -> tuple[int, int]:
    """Width and height of B and C: one above the other beside the image, the crop's proportions kept.

    Never smaller than the crop: what the loop sees is what has to be looked at.
    """
    height = max(_even(height_px // 2), crop_size[1])
    return round(height * crop_size[0] / crop_size[1]), height


def _scaled(image: Image, size: tuple[int, int], interpolation: int) -> Image:
    if image.shape[1::-1] == size:
        return image
    return np.asarray(cv2.resize(image, size, interpolation=interpolation), dtype=np.uint8)


def _fixed_point(points: FloatArray) -> NDArray[np.int32]:
    return np.rint(points * (1 << SUBPIXEL_BITS)).astype(np.int32)


def _draw_outline(image: Image, corners_px: FloatArray) -> None:
    """Outline of M2; a thick line on the side that is the crop's upper edge."""
    if not np.isfinite(corners_px).all():
        return
    # A corner far outside the image would overflow OpenCV's fixed-point coordinates.
    corners = _fixed_point(np.clip(corners_px, -1e4, 1e4))
    cv2.polylines(image, [corners], isClosed=True, color=OUTLINE, lineType=cv2.LINE_AA, shift=SUBPIXEL_BITS)
    cv2.polylines(image, [corners[:2]], False, OUTLINE, thickness=3, lineType=cv2.LINE_AA, shift=SUBPIXEL_BITS)


def _draw_findings(panel: Image, step: Step, *, scale: float) -> None:
    centre = (panel.shape[1] / 2, panel.shape[0] / 2)
    cv2.drawMarker(panel, (round(centre[0] - 0.5), round(centre[1] - 0.5)), PAPER_WHITE, cv2.MARKER_CROSS, 14)
    for blob in step.detection.blobs:
        x, y, width, height = (round(scale * edge) for edge in blob.box_px)
        cv2.rectangle(panel, (x, y, width, height), BLOB)
    if step.detection.centroid_px is not None:
        found = _on_panel(step.detection.centroid_px, scale)
        for blob in step.detection.blobs:
            cv2.line(panel, _on_panel(blob.centroid_px, scale), found, ESTIMATE, lineType=cv2.LINE_AA)
        cv2.rectangle(panel, (found[0] - 3, found[1] - 3, 7, 7), ESTIMATE, thickness=2)
    if step.predicted_px is not None:
        cv2.drawMarker(panel, _on_panel(step.predicted_px, scale), PREDICTION, cv2.MARKER_TILTED_CROSS, 12, 2)


def _on_panel(point_px: tuple[float, float], scale: float) -> tuple[int, int]:
    """Nearest pixel of the panel; far predictions stay representable."""
    x, y = (round(float(np.clip(scale * (value + 0.5) - 0.5, -1e4, 1e4))) for value in point_px)
    return x, y


@cache
def _font() -> cv2.FontFace:
    # One of the faces that OpenCV carries within itself, so the image does not depend on the machine's fonts.
    return cv2.FontFace("sans")


def _write(image: Image, text: str, at: tuple[int, int], colour: Colour) -> None:
    cv2.putText(image, text, at, colour, _font(), TEXT_SIZE_PX, TEXT_WEIGHT)


def _letter(image: Image, letter: str, corner: tuple[int, int]) -> None:
    x, y = corner
    image[y : y + 20, x : x + 20] = INK
    _write(image, letter, (x + 5, y + 15), PAPER_WHITE)


def _draw_numbers(strip: Image, step: Step) -> None:
    strip[:] = INK
    q1, q2 = np.degrees(step.q_estimated)
    asked1, asked2 = np.degrees(step.q_command)
    error = "\N{EN DASH}" if step.error_px is None else "{:+.1f} {:+.1f} px".format(*step.error_px)
    fields = {
        "time": f"{step.time_s:.2f} s",
        "mode": str(step.mode),
        "joints": f"q {q1:+.1f}\N{DEGREE SIGN} {q2:+.1f}\N{DEGREE SIGN}",
        "asked": f"asked {asked1:+.1f}\N{DEGREE SIGN} {asked2:+.1f}\N{DEGREE SIGN}",
        "error": f"error {error}",
        "blobs": f"blobs {len(step.detection.blobs)}",
    }
    strip[5:-5, FIELD_STARTS_PX["mode"] - 8 : FIELD_STARTS_PX["joints"] - 16] = MODE_COLOURS[step.mode]
    for name, text in fields.items():
        _write(strip, text, (FIELD_STARTS_PX[name], 21), PAPER_WHITE)
