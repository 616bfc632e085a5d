"""Why the target was not found in an image: one word, from what ground truth knows of that image."""

from __future__ import annotations

from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

CLIPPED = 255
"""A channel of the image that reached it may have been brighter."""


class Cause(StrEnum):
    """What kept the detector from the target."""

    NONE = ""
    NOT_IN_VIEW = "not in view"
    SLEWING = "slewing"
    HIDDEN_BY_HULL = "hidden by hull"
    HIDDEN_BY_MOUNT = "hidden by mount"
    HIDDEN_BY_WORLD = "hidden by world"
    TOO_SMALL = "too small"
    SATURATED = "saturated"
    TOO_DARK = "too dark"
    COLOUR = "colour"


def cause_of_loss(
    *,
    found: bool,
    full_px: float,
    hull_px: float,
    mount_px: float,
    world_px: float,
    visible_px: float,
    smallest_px: float,
    at_speed_limit: bool = False,
    smear_px: float = 0.0,
    saturated_share: float = 0.0,
    dark_share: float = 0.0,
) -> Cause:
    """Why the target was not found, the first that applies in the order in which light meets things.

    A target of which less than `smallest_px` is seen was lost on the way to the camera, to whatever took most of it:
    the world and what swims in it, the hull, the edge of the gaze mirror or the mount. One that is seen was lost in the
    image: smeared, blown out, dark, and when nothing of this holds for half of it, its colour lies outside the
    detector's window.

    Parameters
    ----------
    found : bool
        Whether the detector's mask met the target.
    full_px : float
        Pixels that the target would have if nothing hid it and the mirror had no edge; nan where it has no image, as
        behind the camera. All counts are of pixels of the same image: camera or crop.
    hull_px, mount_px, world_px : float
        Pixels of it that the hull, the mount (servos and mirror backs included), or the world with what else swims in
        it hide.
    visible_px : float
        Pixels of it that are seen.
    smallest_px : float
        Fewest that the detector takes for a target.
    at_speed_limit : bool
        Whether the mirrors follow (no scan) and a servo turns as fast as it can. A target out of view then is one that
        outran them.
    smear_px : float
        How far the target's image moved during the exposure.
    saturated_share, dark_share : float
        Of its visible pixels, as `blown_and_dark` counts them; nan where there are none.

    Returns
    -------
    Cause
        `Cause.NONE` for a target that was found.
    """
    if found:
        return Cause.NONE
    if not np.isfinite(full_px):
        return Cause.NOT_IN_VIEW
    if full_px < smallest_px:
        return Cause.TOO_SMALL
    if visible_px < max(smallest_px, 1.0):
        outside = Cause.SLEWING if at_speed_limit else Cause.NOT_IN_VIEW
        # Of equals the first on the light's way to the camera. One that is mostly seen nothing has taken.
        parts = (
            (world_px, Cause.HIDDEN_BY_WORLD),
            (hull_px, Cause.HIDDEN_BY_HULL),
            (full_px - hull_px - mount_px - world_px - visible_px, outside),
            (mount_px, Cause.HIDDEN_BY_MOUNT),
            (visible_px, Cause.TOO_SMALL),
        )
        return max(parts, key=lambda part: part[0])[1]
    diameter_px = 2 * np.sqrt(full_px / np.pi)
    in_the_image = (
        (smear_px > diameter_px, Cause.SLEWING),
        (saturated_share > 0.5, Cause.SATURATED),
        (dark_share > 0.5, Cause.TOO_DARK),
    )
    return next((cause for applies, cause in in_the_image if applies), Cause.COLOUR)


def blown_and_dark(pixels: NDArray[np.uint8], *, value_min: float) -> tuple[float, float]:
    """Shares of a target's pixels that are blown out, and that are darker than the detector's window.

    Blown out is a pixel with two channels or more at 255: its hue is lost. With one it keeps it nearly.

    Parameters
    ----------
    pixels : array, shape (n, 3)
        uint8, sRGB: those of the crop that show the target by ground truth.
    value_min : float
        The window's smallest HSV value, the largest of the three channels, 0 to 255.

    Returns
    -------
    saturated_share, dark_share : float
        nan without pixels.
    """
    if len(pixels) == 0:
        return np.nan, np.nan
    saturated = (pixels >= CLIPPED).sum(axis=1) >= 2
    dark = pixels.max(axis=1) < value_min
    return float(saturated.mean()), float(dark.mean())
