"""Colour: a window of hue, saturation and value, and the mask it leaves after opening and closing."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from tracking.perception.crop import check_image
from tracking.perception.target_colours import TARGET_COLOURS

Mask = NDArray[np.uint8]

FULL_TURN_DEG = 360.0
DEG_PER_STEP = 2
"""OpenCV keeps the hue of an 8-bit image in steps of two degrees."""


@dataclass(frozen=True, kw_only=True)
class ColourWindow:
    """Colours from one hue to another, over red where the first is the larger, strong and bright enough.

    Hue is the angle of the colour circle (0 red, 120 green, 240 blue), saturation and value as fractions, all of the
    sRGB values as they are (Smith 1978, SIGGRAPH '78, 12-19).

    Parameters
    ----------
    hue_from_deg, hue_to_deg : float
        In [0, 360]; both ends belong to the window. An image of 8 bits knows hue to 2 degrees.
    saturation_min : float
        (max - min) / max of red, green and blue.
    value_min, value_max : float
        max of red, green and blue.
    """

    hue_from_deg: float
    hue_to_deg: float
    saturation_min: float = 0.0
    value_min: float = 0.0
    value_max: float = 1.0

    def __post_init__(self) -> None:
        problems = [
            f"expected {name} from 0 to {most:g}, got {getattr(self, name)}"
            for name, most in (
                ("hue_from_deg", FULL_TURN_DEG),
                ("hue_to_deg", FULL_TURN_DEG),
                ("saturation_min", 1.0),
                ("value_min", 1.0),
                ("value_max", 1.0),
            )
            if not 0 <= getattr(self, name) <= most
        ]
        if self.value_min > self.value_max:
            problems.append(f"expected value_min up to value_max, got {self.value_min} and {self.value_max}")
        if problems:
            raise ValueError("; ".join(problems))

    def mask(self, image: Mask) -> Mask:
        """255 where an image (uint8 sRGB, shape (height, width, 3)) has a colour of the window, else 0."""
        check_image("image", image)
        hsv = cv2.cvtColor(image, cv2.COLOR_RGB2HSV)
        first, last = self._hue_steps()
        weak, dark = math.ceil(255 * self.saturation_min), math.ceil(255 * self.value_min)
        bright = math.floor(255 * self.value_max)
        if not self.over_red:
            return np.asarray(cv2.inRange(hsv, (first, weak, dark), (last, 255, bright)), dtype=np.uint8)
        strong = cv2.inRange(hsv, (0, weak, dark), (255, 255, bright))
        unwanted = cv2.inRange(hsv, (last + 1, 0, 0), (first - 1, 255, 255))
        return np.asarray(cv2.bitwise_and(strong, cv2.bitwise_not(unwanted)), dtype=np.uint8)

    @property
    def over_red(self) -> bool:
        """Whether the window goes over red, from a large hue to a small one; 360 degrees are red as well."""
        return self.hue_to_deg - self.hue_from_deg < FULL_TURN_DEG and (
            self.hue_from_deg % FULL_TURN_DEG > self.hue_to_deg % FULL_TURN_DEG
        )

    def _hue_steps(self) -> tuple[int, int]:
        """First and last of OpenCV's steps of hue."""
        if self.hue_to_deg - self.hue_from_deg >= FULL_TURN_DEG:
            return 0, 255
        first, last = self.hue_from_deg % FULL_TURN_DEG, self.hue_to_deg % FULL_TURN_DEG
        return math.ceil(first / DEG_PER_STEP), math.floor(last / DEG_PER_STEP)


RED_IN_WATER = ColourWindow(hue_from_deg=300, hue_to_deg=16, saturation_min=0.08, value_min=0.1)
"""The ball's red up to 3 m away: as it pales its hue goes from red to violet before a reef, and to orange in open
water, where white balance makes grey of a blue (docs/explanation/perception.md)."""


OVER_WATER = 0.85
"""Of the chart's red in Jerlov's type IB at 5 m under a sun 60 degrees high (`scenes.light.inherent_contrast`)."""


@dataclass(frozen=True, kw_only=True)
class DetectorSettings:
    """What counts as the target.

    Parameters
    ----------
    window : ColourWindow
    smoothing_px : int
        Odd side of the Gaussian that smooths the crop first; 1 does nothing. Hue is noisy where colours are pale.
    opening_px, closing_px : int
        Odd diameters of the elliptic elements; 1 does nothing. Opening removes specks, closing fills holes.
    area_min_px : float
        Least area of a blob.
    circularity_min : float
        4 pi area / perimeter^2 of a blob's outline, 1 for a disc.
    aspect_max : float
        Longer over shorter side of a blob's upright box. The crop stretches a ball: its shape changes with tilt.
    colour : str
        Of the target, one of `TARGET_COLOURS`: along which it stands out where its contrast is looked at, which the
        window does not ask.
    over_water : float
        Natural logarithm of the target's radiance over that of the water behind it, from near by, as its colour weighs
        channels: of a red one in the camera's red, which is what water, depth and sun leave of its red. The contrast
        weighs by it what may be the target.
    least_speed_m_per_s : float, optional
        At which the target swims at least, where it never rests and the robot hovers: what stays where it was first
        seen is another thing. Of a target that is more than 3 m away as much less as it is farther. None where that is
        not known.
    onnx : str, optional
        File of a learned model (`tracking.perception.learned`), which takes the place of window, smoothing, opening and
        closing.
    """

    window: ColourWindow = field(default=RED_IN_WATER)
    smoothing_px: int = 3
    opening_px: int = 9
    closing_px: int = 9
    area_min_px: float = 100.0
    circularity_min: float = 0.3
    aspect_max: float = 2.5
    colour: str = "red"
    over_water: float = OVER_WATER
    least_speed_m_per_s: float | None = None
    onnx: str | None = None

    def __post_init__(self) -> None:
        problems = [
            f"expected an odd {name} from 1 to 99, got {getattr(self, name)}"
            for name in ("smoothing_px", "opening_px", "closing_px")
            if getattr(self, name) not in range(1, 100, 2)
        ]
        if self.colour not in TARGET_COLOURS:
            problems.append(f"expected colour to be one of {', '.join(TARGET_COLOURS)}, got {self.colour!r}")
        if not self.area_min_px >= 0:
            problems.append(f"expected area_min_px of at least 0, got {self.area_min_px}")
        if not 0 <= self.circularity_min <= 1:
            problems.append(f"expected circularity_min from 0 to 1, got {self.circularity_min}")
        if self.least_speed_m_per_s is not None and not self.least_speed_m_per_s > 0:
            problems.append(f"expected least_speed_m_per_s above 0, got {self.least_speed_m_per_s}")
        if not self.aspect_max >= 1:
            problems.append(f"expected aspect_max of at least 1, got {self.aspect_max}")
        if problems:
            raise ValueError("; ".join(problems))


RED_BALL = DetectorSettings()
NARROW_HUE = DetectorSettings(
    window=ColourWindow(hue_from_deg=330, hue_to_deg=20, saturation_min=0.15, value_min=0.1),
    opening_px=5,
    closing_px=5,
)
"""Red as one would choose it before the dive: the ball's hue at arm's length."""
WIDE_HUE = DetectorSettings(
    window=ColourWindow(hue_from_deg=270, hue_to_deg=14, saturation_min=0.05, value_min=0.1),
    aspect_max=3.0,
)
"""The paper's video S5: a greater range of hues and of width-height ratios, chosen after the dive."""

DETECTORS = {"red-ball": RED_BALL, "narrow-hue": NARROW_HUE, "wide-hue": WIDE_HUE}
"""Settings by name."""


def colour_mask(crop: Mask, settings: DetectorSettings) -> Mask:
    """Pixels of the target's colour after opening and closing: uint8, 255 or 0, shape (height, width)."""
    check_image("crop", crop)
    if settings.smoothing_px > 1:
        crop = np.asarray(cv2.GaussianBlur(crop, (settings.smoothing_px,) * 2, 0), dtype=np.uint8)
    mask = settings.window.mask(crop)
    for operation, diameter in ((cv2.MORPH_OPEN, settings.opening_px), (cv2.MORPH_CLOSE, settings.closing_px)):
        if diameter > 1:
            mask = np.asarray(cv2.morphologyEx(mask, operation, _disc(diameter)), dtype=np.uint8)
    return mask


@cache
def _disc(diameter_px: int) -> Mask:
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (diameter_px, diameter_px)))
