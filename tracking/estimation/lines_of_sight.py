"""From a pixel to the target's direction and back, through port, M1 and M2, fast enough for every image.

Camera, port and M1 do not move: their numbers are handed to the compiled kernels of `OpticalTrain` once, and one ray
costs a launch. M2 is a reflection at a plane through a fixed point, done here.

A direction is that of the line from the centre of M2's face, body frame. That point does not move with the joints and
the optical axis always goes through it, so a target that stands still keeps its direction whatever the mirror does, and
the gaze is on it when its direction is the gaze's. A ray beside the axis leaves M2 beside the centre, though: to tell
the direction the distance must be assumed. `parallax` says what a wrong one costs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray, opaque, opaque_vector
from optics.layout import Layout
from optics.status import Status
from optics.train import OpticalTrain, compiled_project, compiled_trace
from rigs import Rig
from tracking.estimation.gimbal import Gimbal


@dataclass(frozen=True, kw_only=True)
class LineOfSight:
    """A ray in the water behind M2, body frame: `origin_m` on the mirror's plane, unit `direction`; shape (3,) each."""

    origin_m: FloatArray
    direction: FloatArray


class LinesOfSight:
    """Sight lines of a rig with mirrors, one pixel at a time.

    Parameters
    ----------
    rig : Rig
    distance_m : float
        From the centre of M2 at which targets are assumed.

    Raises
    ------
    ValueError
        For a rig without mirrors, or a distance that is not positive.
    """

    def __init__(self, rig: Rig, distance_m: float = 2.0):
        if not (math.isfinite(distance_m) and distance_m > 0):
            raise ValueError(f"expected a distance above 0 m, got {distance_m}")
        layout = Layout.from_rig(rig)
        self.distance_m = distance_m
        self.gimbal = Gimbal(layout)
        q1, q2 = self.gimbal.middle.tolist()
        whole = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
        fixed = replace(whole, mirrors=whole.mirrors[:1])
        self._parameters = fixed.parameters()
        self._trace, self._project = compiled_trace(*fixed.kind), compiled_project(*fixed.kind)
        self._body_from_camera = layout.body_from_camera.rotation.as_matrix()
        self._camera_m = layout.body_from_camera.translation
        self.centre_m: FloatArray = layout.body_from_gimbal.translation
        self.middle_row_px = (rig.camera.height_px - 1) / 2

    def ray(self, pixel: ArrayLike, q: ArrayLike) -> LineOfSight | None:
        """Ray of a pixel of the image, (u, v), at joint values, radians; None when it does not get to M2's face.

        The edge of M2 is not asked: what lies in the crop lies on the mirror.
        """
        u, v = np.asarray(pixel, dtype=np.float64).tolist()
        # Not an array of NumPy's: where that lies in memory, the kernel may have to be recorded again.
        origin, direction, status = self._trace(self._parameters, opaque(u), opaque(v))
        if status[0] != Status.OK:
            return None
        start = self._body_from_camera @ _only(origin) + self._camera_m
        along = self._body_from_camera @ _only(direction)
        normal = self.gimbal.normal(q)
        approach = along @ normal
        if approach >= 0:
            return None
        reach = ((self.centre_m - start) @ normal) / approach
        return LineOfSight(origin_m=start + reach * along, direction=along - 2 * approach * normal)

    def direction(self, pixel: ArrayLike, q: ArrayLike) -> FloatArray | None:
        """Unit vector from the centre of M2 to where a pixel's ray is `distance_m` away from it; None without a ray."""
        ray = self.ray(pixel, q)
        if ray is None:
            return None
        aside = ray.origin_m - self.centre_m
        half = aside @ ray.direction
        under_root = half * half - aside @ aside + self.distance_m**2
        if under_root < 0:
            return None
        return np.asarray((aside + (math.sqrt(under_root) - half) * ray.direction) / self.distance_m)

    def pixel(self, direction: ArrayLike, q: ArrayLike) -> FloatArray | None:
        """Pixel of the image, shape (2,), that shows what is `distance_m` from the centre of M2 along a direction.

        None for what lies behind M2 or has no pixel. As `OpticalTrain.project` has it, a pixel may lie outside of the
        mirror's outline, or of the image: where the target would appear if nothing ended there.
        """
        normal = self.gimbal.normal(q)
        towards = np.asarray(direction, dtype=np.float64)
        ahead = towards @ normal
        if not ahead > 0:
            return None
        unfolded = self.centre_m + self.distance_m * (towards - 2 * ahead * normal)
        point = self._body_from_camera.T @ (unfolded - self._camera_m)
        u, v, _ = self._project(self._parameters, opaque_vector(point))
        pixel = _only((u, v))
        return pixel if np.isfinite(pixel).all() else None

    def parallax(self, pixel: ArrayLike, q: ArrayLike, distance_m: float) -> float:
        """Error of `direction`, radians, for a target that is `distance_m` away; nan without a ray."""
        assumed, ray = self.direction(pixel, q), self.ray(pixel, q)
        if assumed is None or ray is None:
            return math.nan
        aside = ray.origin_m - self.centre_m
        half = aside @ ray.direction
        true = aside + (np.sqrt(half * half - aside @ aside + distance_m**2) - half) * ray.direction
        return float(np.arctan2(np.linalg.norm(np.cross(assumed, true)), assumed @ true))


def _only(columns: Iterable[Any]) -> FloatArray:
    """The numbers of arrays of Dr.Jit with one each: a fifth of the time of `to_rows`."""
    return np.array([column[0] for column in columns])
