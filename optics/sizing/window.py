"""The window: the rectangle of the image that the mirrors are wanted to pass.

Its limits are pixel coordinates of edges, not of centres: the whole image reaches from -0.5 to width - 0.5.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from optics.camera import Camera
from optics.kernels.arrays import FloatArray
from optics.ports.port import Port
from optics.train import OpticalTrain

SMALLEST_HALF_SIDE_PX = 1e-6


@dataclass(frozen=True, kw_only=True)
class Window:
    """Rectangle of an image, in pixels.

    Parameters
    ----------
    left_px, top_px, right_px, bottom_px : float
        Its edges: u from left to right, v from top to bottom.
    """

    left_px: float
    top_px: float
    right_px: float
    bottom_px: float

    def __post_init__(self) -> None:
        if not (self.left_px < self.right_px and self.top_px < self.bottom_px and np.isfinite(self.size_px).all()):
            raise ValueError(
                "expected a window with left < right and top < bottom, got "
                f"{self.left_px:g}, {self.top_px:g}, {self.right_px:g}, {self.bottom_px:g}"
            )

    @property
    def size_px(self) -> tuple[float, float]:
        """Width and height."""
        return self.right_px - self.left_px, self.bottom_px - self.top_px

    @property
    def centre_px(self) -> tuple[float, float]:
        """Where its diagonals cross."""
        return (self.left_px + self.right_px) / 2, (self.top_px + self.bottom_px) / 2

    def scaled(self, factor: float) -> Window:
        """A window of the same centre and shape, its sides `factor` times as long."""
        return _around(*self.centre_px, *(factor * side / 2 for side in self.size_px))

    def check_inside(self, camera: Camera) -> None:
        """Raise a `ValueError` for a window that reaches beyond the image."""
        width, height = camera.width_px, camera.height_px
        # Half a pixel's worth of rounding would be a mistake; a billionth is the arithmetic of centring.
        slack = 1e-9 * max(width, height)
        left, top = self.left_px + 0.5, self.top_px + 0.5
        right, bottom = self.right_px + 0.5, self.bottom_px + 0.5
        if left < -slack or top < -slack or right > width + slack or bottom > height + slack:
            raise ValueError(
                f"expected a window within the image, u from -0.5 to {width - 0.5:g} and v from -0.5 to "
                f"{height - 0.5:g}, got {self.left_px:g}, {self.top_px:g}, {self.right_px:g}, {self.bottom_px:g}"
            )

    def boundary(self, per_side: int) -> FloatArray:
        """Pixels along the edges, corners among them, in order round the window; shape (4 * per_side, 2)."""
        steps = np.arange(per_side) / per_side
        u = self.left_px + steps * self.size_px[0]
        v = self.top_px + steps * self.size_px[1]
        far_u, far_v = self.right_px - steps * self.size_px[0], self.bottom_px - steps * self.size_px[1]
        sides = [
            (u, np.full(per_side, self.top_px)),
            (np.full(per_side, self.right_px), v),
            (far_u, np.full(per_side, self.bottom_px)),
            (np.full(per_side, self.left_px), far_v),
        ]
        return np.concatenate([np.column_stack(side) for side in sides])

    def cells(self, columns: int, rows: int) -> FloatArray:
        """Centres of the cells of a division into `columns` x `rows`, row by row, shape (rows * columns, 2)."""
        u = self.left_px + (np.arange(columns) + 0.5) / columns * self.size_px[0]
        v = self.top_px + (np.arange(rows) + 0.5) / rows * self.size_px[1]
        return np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)


def centred_window(camera: Camera, width_px: float, height_px: float) -> Window:
    """Window of a size in pixels in the middle of the image; `ValueError` when it is larger than the image."""
    if not (0 < width_px <= camera.width_px and 0 < height_px <= camera.height_px):
        raise ValueError(
            f"expected a window of at most {camera.width_px} x {camera.height_px} px, the whole image, "
            f"got {width_px:g} x {height_px:g} px"
        )
    return _around((camera.width_px - 1) / 2, (camera.height_px - 1) / 2, width_px / 2, height_px / 2)


def fraction_window(camera: Camera, fraction: float) -> Window:
    """Window in the middle of the image whose sides are a fraction of the image's."""
    if not 0 < fraction <= 1:
        raise ValueError(f"expected a fraction of the image's sides above 0 and at most 1, got {fraction:g}")
    return centred_window(camera, fraction * camera.width_px, fraction * camera.height_px)


def field_of_view_window(camera: Camera, port: Port, horizontal: float, vertical: float) -> Window:
    """Window in the middle of the image that shows a field of view *in the water*.

    Parameters
    ----------
    camera, port : Camera, Port
    horizontal, vertical : float
        Radians, between the rays of the middles of opposite edges.

    Raises
    ------
    ValueError
        When the whole image, as far as the port lets it through, shows less.
    """
    middle = np.array([(camera.width_px - 1) / 2, (camera.height_px - 1) / 2])
    half_sides = []
    for axis, (name, angle) in enumerate((("horizontal", horizontal), ("vertical", vertical))):
        step = np.eye(2)[axis]
        largest = _largest_half_side(camera, port, middle, step)
        whole = _angle_in_water(camera, port, middle, step * largest)
        if not 0 < angle <= whole:
            raise ValueError(
                f"expected a {name} field of view above 0 and at most {np.degrees(whole):.2f} degrees in the water, "
                f"what the image shows through the port, got {np.degrees(angle):g}"
            )
        half_sides.append(
            brentq(
                lambda half, step=step, angle=angle: _angle_in_water(camera, port, middle, step * half) - angle,
                SMALLEST_HALF_SIDE_PX,
                largest,
                xtol=1e-9,
            )
        )
    return _around(*middle, *half_sides)


def parsed_window(text: str, train: OpticalTrain) -> Window:
    """Window by its words: a fraction (0.2), pixels (320x240), degrees in the water (20x15deg), or edges in pixels.

    Parameters
    ----------
    text : str
    train : OpticalTrain
        Whose camera and port it is of.

    Raises
    ------
    ValueError
        For other words, and for a window that is not inside the image.
    """
    camera = train.camera
    try:
        if "," in text:
            left, top, right, bottom = (float(part) for part in text.split(","))
        elif "x" in text:
            width, height = (float(part) for part in text.removesuffix("deg").split("x"))
        else:
            fraction = float(text)
    except ValueError:
        raise ValueError(
            f"window {text}: expected a fraction (0.2), pixels (320x240), degrees in the water (20x15deg), or "
            "edges (left,top,right,bottom in pixels)"
        ) from None
    if "," in text:
        window = Window(left_px=left, top_px=top, right_px=right, bottom_px=bottom)
    elif text.endswith("deg"):
        window = field_of_view_window(camera, train.port, math.radians(width), math.radians(height))
    elif "x" in text:
        window = centred_window(camera, width, height)
    else:
        window = fraction_window(camera, fraction)
    window.check_inside(camera)
    return window


def _around(u: float, v: float, half_width: float, half_height: float) -> Window:
    return Window(left_px=u - half_width, top_px=v - half_height, right_px=u + half_width, bottom_px=v + half_height)


def _largest_half_side(camera: Camera, port: Port, middle: FloatArray, step: FloatArray) -> float:
    """Largest half side, in whole pixels or the image's edge, at which both edges' middles get through the port."""
    half_image = float(abs(step @ [camera.width_px, camera.height_px])) / 2
    halves = np.append(np.arange(1.0, half_image), half_image)
    ends = np.concatenate([middle + halves[:, np.newaxis] * step, middle - halves[:, np.newaxis] * step])
    passed = np.logical_and(*OpticalTrain(camera=camera, port=port).trace(ends).passed.reshape(2, -1))
    if not passed[0]:
        raise ValueError("expected a port that lets the middle of the image through; look at port.aperture_diameter_mm")
    return float(halves[passed.argmin() - 1] if not passed.all() else halves[-1])


def _angle_in_water(camera: Camera, port: Port, middle: FloatArray, step: FloatArray) -> float:
    first, second = OpticalTrain(camera=camera, port=port).trace(np.array([middle - step, middle + step])).direction
    return float(np.arctan2(np.linalg.norm(np.cross(first, second)), first @ second))
