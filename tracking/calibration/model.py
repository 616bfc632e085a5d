"""What a rig with errors shows: pixels of points and of M2's corners, its gaze, and how they move with the errors.

Unfolded over the mirrors a point has one place in front of the port (`docs/explanation/optics.md`), so the derivative
is a product: of the pixel by that place and by the port (`optics.derivatives`), and of the place by the mirrors
(`Chain`). Both are exact at any size of the errors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from optics.camera import camera_from_spec
from optics.derivatives import POINT, projection_jacobian, ray_jacobian
from optics.kernels.arrays import FloatArray, unit
from optics.layout import Layout, pan_from_m2
from optics.mirror import PlaneMirror
from optics.ports.port import DomePort, FlatPort, Port, port_from_spec
from optics.train import OpticalTrain
from rigs import Rig
from tracking.calibration.chain import Chain
from tracking.calibration.errors import PORT_ERRORS, check_errors
from tracking.perception.exact_corners import CROP_CORNERS_IN_M2

Errors = Mapping[str, float]
"""Some of `errors.error_names(rig)`, metres, radians, units of index; what is not named is as drawn."""

Seen = tuple[FloatArray, FloatArray]
"""Values and their derivatives by the asked names, which are the last axis."""


class ErrorModel:
    """A rig that may be off.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    """

    def __init__(self, rig: Rig):
        self.rig = rig
        self.layout = Layout.from_rig(rig)
        self.camera = camera_from_spec(rig.camera)
        self._bare = rig.without_mirrors()
        gaze = rig.require_gaze()
        self._plates = (gaze.fold_mirror, gaze.gaze_mirror)
        half_size = np.array([gaze.gaze_mirror.width_mm, gaze.gaze_mirror.height_mm]) / 2000
        sense = -1.0 if gaze.fold_mirror.direction == "up" else 1.0
        self._outline = sense * CROP_CORNERS_IN_M2 * half_size

    def points(self, errors: Errors, q: FloatArray, points_m: FloatArray, names: Sequence[str], rates: Any = 0) -> Seen:
        """Pixels of points, each through both mirrors at joint values of its own.

        Parameters
        ----------
        errors : mapping
        q : array, shape (n, 2)
            Radians; nan where the camera looks at the point directly, past the mirrors.
        points_m : array, shape (n, 3)
            Camera frame.
        names : sequence of str, length k
            What to differentiate by; names that are no errors are allowed, the points may depend on them.
        rates : array, shape (n, 3, k), optional
            How the points themselves depend on them.

        Returns
        -------
        pixels, values : arrays, shape (n, 2) and (n, 2, k)
            NaN where there is no pixel. Whether anything is in the way is not asked.
        """
        check_errors(self.rig, errors)
        images = points_m.copy()
        moving = np.broadcast_to(np.asarray(rates, dtype=np.float64), (*points_m.shape, len(names))).copy()
        mirrored = np.isfinite(q).all(axis=1)
        if mirrored.any():
            poses, pose = np.unique(q[mirrored], axis=0, return_inverse=True)
            unfolded = images[mirrored], moving[mirrored]
            unfolded = _unfolded(*unfolded, self.gaze_mirror(errors, poses), names, pose)
            images[mirrored], moving[mirrored] = _unfolded(*unfolded, self.fold_mirror(errors), names)
        return self._through_port(errors, images, moving, names)

    def corners(self, errors: Errors, q: FloatArray, names: Sequence[str] = ()) -> Seen:
        """Pixels of M2's corners over M1, in the crop's order, for joint values of shape (n, 2), radians.

        Returns
        -------
        pixels, values : arrays, shape (n, 4, 2) and (n, 4, 2, k)
            They are given whether or not M2 turns its face to M1.
        """
        check_errors(self.rig, errors)
        mirror = self.gaze_mirror(errors, q)
        of_origin, turning = mirror.rates(tuple(names))
        from_centre = np.einsum("nij,cj->nci", mirror.axes[:, :, :2], self._outline)
        points = (mirror.origin_m[:, np.newaxis] + from_centre).reshape(-1, 3)
        moving = np.repeat(of_origin, 4, axis=0) + _cross(np.repeat(turning, 4, axis=0), from_centre.reshape(-1, 3))
        pixels, values = self._through_port(errors, *_unfolded(points, moving, self.fold_mirror(errors), names), names)
        return pixels.reshape(-1, 4, 2), values.reshape(len(q), 4, 2, len(names))

    def gaze(self, errors: Errors, q: FloatArray, names: Sequence[str] = ()) -> Seen:
        """Where the principal ray goes behind M2: unit vectors of the body frame for joint values (n, 2), radians.

        Returns
        -------
        directions, values : arrays, shape (n, 3) and (n, 3, k)
        """
        check_errors(self.rig, errors)
        axis, _ = self.camera.unproject([(self.camera.cx_px, self.camera.cy_px)])
        direction, moving = axis, np.zeros((1, 3, len(names)))
        port = PORT_ERRORS[self.rig.port.shape]
        if port:
            found = ray_jacobian(self._bare, axis, parameters=tuple(port.values()), offsets=self._offsets(errors))
            direction = found.directions
            moving += found.values @ _selection(tuple(port), names)
        for mirror in (self.fold_mirror(errors), self.gaze_mirror(errors, q)):
            # A direction is the difference of two points, which are moved by shifts alike.
            normal, turning = mirror.axes[:, :, 2], mirror.rates(tuple(names))[1]
            direction, moving = _reflected(direction, moving, normal, _cross(turning, normal))
        turn = self.layout.body_from_camera.rotation.as_matrix()
        return direction @ turn.T, np.einsum("ij,njk->nik", turn, moving)

    def train(self, errors: Errors, q1: float, q2: float) -> OpticalTrain:
        """Exact train of the rig with its errors, with the mirrors' outlines; radians."""
        check_errors(self.rig, errors)
        self.layout.check_joints(q1, q2)
        chains = (self.fold_mirror(errors), self.gaze_mirror(errors, np.array([[q1, q2]])))
        mirrors = tuple(
            PlaneMirror.from_pose(
                RigidTransform.from_components(chain.origin_m[0], Rotation.from_matrix(chain.axes[0])),
                width_m=plate.width_mm / 1000,
                height_m=plate.height_mm / 1000,
            )
            for chain, plate in zip(chains, self._plates, strict=True)
        )
        return OpticalTrain(camera=self.camera, port=self.port(errors), mirrors=mirrors)

    def port(self, errors: Errors) -> Port:
        """The port with its errors."""
        port = port_from_spec(self.rig.port, self.rig.water)
        if not isinstance(port, FlatPort | DomePort):
            return port
        common = {
            "thickness_m": port.thickness_m + errors.get("port_thickness", 0.0),
            "n_port": port.n_port + errors.get("n_port", 0.0),
            "n_water": port.n_water + errors.get("n_water", 0.0),
        }
        if isinstance(port, DomePort):
            centre = np.asarray(port.centre_m) + [errors.get(f"port_{axis}", 0.0) for axis in "xyz"]
            return replace(port, centre_m=centre, **common)
        normal = unit("normal", port.normal)
        turn = np.array([errors.get("port_tilt_x", 0.0), errors.get("port_tilt_y", 0.0), 0.0])
        distance_m = port.distance_m + errors.get("port_z", 0.0)
        return replace(port, normal=normal + np.cross(turn, normal), distance_m=distance_m, **common)

    def fold_mirror(self, errors: Errors) -> Chain:
        """M1 in the camera frame: one pose for all joint values."""
        chain = Chain(self.layout.camera_from_m1, 1)
        chain.turn("m1_x", 0, errors.get("m1_x", 0.0)).turn("m1_y", 1, errors.get("m1_y", 0.0))
        return chain.shift("m1_shift", 2, errors.get("m1_shift", 0.0))

    def gaze_mirror(self, errors: Errors, q: FloatArray) -> Chain:
        """M2 in the camera frame at joint values of shape (n, 2), radians."""

        def off(name: str) -> float:
            return errors.get(name, 0.0)

        chain = Chain(self.layout.camera_from_gimbal, len(q))
        for axis, name in enumerate(("gimbal_x", "gimbal_y", "gimbal_z")):
            chain.shift(name, axis, off(name))
        chain.turn("pan_axis_x", 0, off("pan_axis_x")).turn("pan_axis_y", 1, off("pan_axis_y"))
        chain.turn("pan", 2, self.layout.pan.angle(q[:, 0]) + off("pan"))
        chain.shift("tilt_axis_shift_x", 0, off("tilt_axis_shift_x"))
        chain.shift("tilt_axis_shift_z", 2, off("tilt_axis_shift_z")).turn("tilt_axis_skew", 0, off("tilt_axis_skew"))
        # Positive tilt raises the normal: against M2's x, which is the tilt axis.
        angle = self.layout.tilt.angle(q[:, 1]) + off("tilt")
        chain.fixed(pan_from_m2(0.0)).turn("tilt", 0, angle, sense=-1)
        chain.turn("m2_x", 0, off("m2_x")).turn("m2_y", 1, off("m2_y")).turn("m2_z", 2, off("m2_z"))
        for axis, name in enumerate(("m2_slide_x", "m2_slide_y", "m2_shift")):
            chain.shift(name, axis, off(name))
        return chain

    def _offsets(self, errors: Errors) -> dict[str, float]:
        names = PORT_ERRORS[self.rig.port.shape]
        return {parameter: errors.get(name, 0.0) for name, parameter in names.items()}

    def _through_port(self, errors: Errors, images: FloatArray, moving: FloatArray, names: Sequence[str]) -> Seen:
        """Pixels of unfolded points."""
        port = PORT_ERRORS[self.rig.port.shape]
        found = projection_jacobian(
            self._bare, images, parameters=(*POINT, *port.values()), offsets=self._offsets(errors)
        )
        values = found.values[:, :, :3] @ moving + found.values[:, :, 3:] @ _selection(tuple(port), names)
        return found.pixels, values


def _selection(rows: Sequence[str], columns: Sequence[str]) -> FloatArray:
    """Matrix that sends each of `rows` to the column of its name."""
    return np.array([[float(row == column) for column in columns] for row in rows]).reshape(len(rows), len(columns))


def _unfolded(
    points: FloatArray, moving: FloatArray, mirror: Chain, names: Sequence[str], pose: NDArray[np.intp] | None = None
) -> Seen:
    """Mirror images of points and their rates; `pose`: which of the mirror's poses is each point's."""
    of_origin, turning = mirror.rates(tuple(names))
    normal = mirror.axes[:, :, 2]
    parts = (mirror.origin_m, normal, of_origin, _cross(turning, normal))
    origin, normal, of_origin, of_normal = parts if pose is None else (part[pose] for part in parts)
    images, moved = _reflected(points - origin, moving - of_origin, normal, of_normal)
    return images + origin, moved + of_origin


def _reflected(vectors: FloatArray, moving: FloatArray, normal: FloatArray, of_normal: FloatArray) -> Seen:
    """``v - 2 (n . v) n`` and its rates."""
    along = (vectors * normal).sum(axis=1, keepdims=True)
    of_along = (moving * normal[..., np.newaxis] + of_normal * vectors[..., np.newaxis]).sum(axis=1, keepdims=True)
    moved = moving - 2 * (of_along * normal[..., np.newaxis] + along[..., np.newaxis] * of_normal)
    return vectors - 2 * along * normal, moved


def _cross(turning: FloatArray, vectors: FloatArray) -> FloatArray:
    """Velocities, shape (n, 3, k), of the ends of vectors, shape (n, 3), that turn with angular velocities."""
    return np.asarray(np.cross(turning, vectors[..., np.newaxis], axis=1))
