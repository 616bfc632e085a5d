"""What the loop stands between: a camera that gives images, and mirrors that take joint values.

Rendered dives, recorded video and real hardware share these two protocols, so the same loop runs on all of them. A
robot that knows how it is turned may say so as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray


@dataclass(frozen=True, kw_only=True)
class CameraFrame:
    """One image of a camera.

    Attributes
    ----------
    image : array, shape (height, width, 3)
        uint8, sRGB: red, green, blue.
    time_s : float
        Middle of its exposure (of the middle row), on the loop's clock.
    """

    image: NDArray[np.uint8]
    time_s: float


@dataclass(frozen=True, kw_only=True)
class MirrorReport:
    """What a driver knows of the gaze mirror.

    Attributes
    ----------
    q : array, shape (2,)
        Pan and tilt at `time_s`, radians: measured, or where the driver estimates the servos to be.
    time_s : float
    measured : bool
        Whether a sensor says so. Hobby servos have none.
    """

    q: FloatArray
    time_s: float
    measured: bool


@dataclass(frozen=True, kw_only=True)
class AttitudeReport:
    """How the body is turned.

    Attributes
    ----------
    quaternion : array, shape (4,)
        x, y, z, w, of length 1: the turn from body axes (x forward, y left, z up) to axes that do not turn with the
        body. Any will do: east, north and up, or the body's own as they were at power-on.
    time_s : float
        At which it was so, on the loop's clock; it may be before the image's.
    """

    quaternion: FloatArray
    time_s: float


class Camera(Protocol):
    """Gives images, one after the other."""

    def read(self) -> CameraFrame | None:
        """Next image; None when there will be no more."""


class MirrorDriver(Protocol):
    """Turns the gaze mirror."""

    def command(self, q: FloatArray, time_s: float) -> None:
        """Ask for pan and tilt, radians, shape (2,), from a moment on."""

    def report(self, time_s: float) -> MirrorReport:
        """What is known of the joints at a moment that is not before the last command's."""


class AttitudeSensor(Protocol):
    """Knows how the body is turned: an inertial measurement unit, or the vehicle's own navigation."""

    def report(self, time_s: float) -> AttitudeReport:
        """The newest that is known of the attitude at a time."""
