"""Masks of a frame: what is robot, what is target, and where the robot is seen in its own mirrors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optics.status import Region
from scenes.stage.frame import Frame, Label

BoolImage = NDArray[np.bool_]

ROBOT = (Label.HULL, Label.MOUNT, Label.SERVO, Label.MIRROR_BACK)

LARGEST_INSTANCE = 2**16 - 2
"""Instances are written as 16-bit numbers, one up, so that 0 is none."""


def masks(frame: Frame) -> dict[str, BoolImage]:
    """Masks by name: one for each label in lower case, and those of the robot.

    `robot` is everything of the robot outside its housing: hull, mount, servos and the mirrors' backs, seen directly or
    over mirrors. `robot_direct` and `robot_in_mirrors` part it; `hull_in_mirrors` is the hull alone.
    """
    found = {label.name.lower(): frame.label == label for label in Label}
    robot = np.isin(frame.label, ROBOT)
    over_mirrors = (frame.region == Region.FOLD) | (frame.region == Region.GAZE)
    return found | {
        "robot": robot,
        "robot_direct": robot & ~over_mirrors,
        "robot_in_mirrors": robot & over_mirrors,
        "hull_in_mirrors": found["hull"] & over_mirrors,
    }


def mask_images(frame: Frame) -> dict[str, NDArray[np.uint8] | NDArray[np.uint16]]:
    """Images by name: masks as 0 and 255, `label_index` and `region_index` as numbers, `instance_index` one up.

    Raises
    ------
    ValueError
        With more instances than 16 bits hold.
    """
    if frame.instance.max(initial=-1) > LARGEST_INSTANCE:
        raise ValueError(f"expected instances up to {LARGEST_INSTANCE}, got {frame.instance.max()}")
    images: dict[str, NDArray[np.uint8] | NDArray[np.uint16]] = {
        name: np.where(mask, np.uint8(255), np.uint8(0)) for name, mask in masks(frame).items()
    }
    images["label_index"] = frame.label
    images["region_index"] = frame.region
    images["instance_index"] = (frame.instance + 1).astype(np.uint16)
    return images
