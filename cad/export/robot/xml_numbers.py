"""Numbers as robot descriptions write them: all digits, so that what is read is what was computed."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

ROUNDING = 1e-15
"""Radians and metres that are rounding and nothing else."""


def numbers(values: Iterable[float]) -> str:
    """Numbers in a row, each with as many digits as tell it from its neighbours; what is only rounding becomes 0."""
    return " ".join(repr(value) if abs(value) > ROUNDING else "0" for value in map(float, values))


def roll_pitch_yaw(rotation: Rotation) -> NDArray[np.float64]:
    """Turns about the fixed axes x, y, z, in this order, radians: URDF's and SDF's `rpy`."""
    return np.asarray(rotation.as_euler("xyz", suppress_warnings=True))


def symmetric(inertia: NDArray[np.float64]) -> dict[str, str]:
    """The six numbers of a symmetric matrix by their names."""
    places = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    return {name: numbers([inertia[place]]) for name, place in places.items()}
