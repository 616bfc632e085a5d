"""A rig that is not quite as drawn: where it looks and where it sees a point, for many deviations at once.

A lane is one built rig at one pose. Everything that can be off is a number per lane, so that thousands of rigs and all
their poses run in one kernel. Mirrors and aperture are unbounded here: a tolerance moves the view, it does not cut it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform

from optics.camera import Camera, camera_from_spec
from optics.kernels.arrays import FloatArray, opaque_vector, to_columns, to_rows
from optics.kernels.backend import Array3f64, Float64, Matrix3f64, UInt32, dr
from optics.kernels.refraction import reflect
from optics.layout import FACE_ELEVATION_AT_ZERO, Layout
from optics.mirror import Plane, unfold
from optics.ports.port import DomePort, FlatPort, Port, port_from_spec
from rigs import Rig

DEVIATIONS = (
    "m1_shift",
    "m1_x",
    "m1_y",
    "m2_shift",
    "m2_x",
    "m2_y",
    "gimbal_x",
    "gimbal_y",
    "gimbal_z",
    "pan_axis_x",
    "pan_axis_y",
    "tilt_axis_shift_x",
    "tilt_axis_shift_z",
    "tilt_axis_skew",
    "pan",
    "tilt",
    "port_x",
    "port_y",
    "port_z",
    "port_tilt_x",
    "port_tilt_y",
    "port_thickness",
    "n_port",
    "n_water",
)
"""What can be off, in metres, radians and units of index; all zero is the rig as drawn.

m1_shift, m2_shift: the reflecting face along its normal. m1_x .. m2_y: turns of a mirror about its own x and y.
gimbal_*: where the pan axis stands, along the gimbal's axes. pan_axis_*: its turns about the gimbal's x and y.
tilt_axis_shift_*: the tilt axis off the pan axis, in the pan frame; tilt_axis_skew: its turn about the pan frame's x.
pan, tilt: optical angles of the joints. port_z: the port along the camera's z (a flat port: along its normal);
port_x, port_y: a dome's centre sideways; port_tilt_*: a flat port's normal about the camera's x and y.
"""

Deviations = Mapping[str, FloatArray]
"""Some of `DEVIATIONS`, arrays of shape (n, k) for n built rigs in k poses; what is not named is as drawn."""


class DeviantTrain:
    """A rig's camera, port and mirrors, ready to be evaluated with deviations in some poses.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    q : array, shape (k, 2)
        Joint values (q1, q2) of the poses, radians.
    """

    def __init__(self, rig: Rig, q: FloatArray):
        self.rig = rig
        self.layout = Layout.from_rig(rig)
        self.camera: Camera = camera_from_spec(rig.camera)
        self.port: Port = port_from_spec(rig.port, rig.water)
        self.q = q

    def view(
        self, deviations: Deviations, count: int = 1, pixel: tuple[float, float] | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Where `count` built rigs look.

        Parameters
        ----------
        deviations : mapping
        count : int
            Number of built rigs, n.
        pixel : (float, float), optional
            The camera's optical axis by default.

        Returns
        -------
        origin_m, direction : arrays, shape (n, k, 3)
            Point on M2 and unit direction of the pixel's ray, camera frame.
        """
        axis = (self.camera.cx_px, self.camera.cy_px) if pixel is None else pixel
        (direction,), (valid,) = self.camera.unproject([axis])
        if not valid:
            raise ValueError(f"expected a pixel that the camera model can invert, got {axis}")
        ray = _behind_m2(type(self.port), self._parameters(deviations, count), opaque_vector(direction))
        dr.eval(ray)
        origin_m, directions = (to_rows(vector).reshape(count, len(self.q), 3) for vector in ray)
        return origin_m, directions

    def image(self, targets_m: FloatArray, deviations: Deviations, count: int = 1) -> FloatArray:
        """Pixels at which built rigs see the target of each pose.

        Parameters
        ----------
        targets_m : array, shape (k, 3)
            Camera frame.
        deviations : mapping
        count : int
            Number of built rigs, n.

        Returns
        -------
        array, shape (n, k, 2)
            (u, v); NaN where the target has no pixel or the projection's root was not found.
        """
        parameters = self._parameters(deviations, count)
        target = Array3f64(*(dr.gather(Float64, column, parameters["pose"]) for column in to_columns(targets_m)))
        pixel = _pixel(self.camera, self.port, parameters, target)
        dr.eval(pixel)
        return to_rows(pixel).reshape(count, len(self.q), 2)

    def _parameters(self, deviations: Deviations, count: int) -> dict[str, Any]:
        """One lane for each built rig and pose, the poses of a rig side by side."""
        unknown = set(deviations) - set(DEVIATIONS)
        if unknown:
            raise ValueError(f"expected deviations among {', '.join(DEVIATIONS)}, got {', '.join(sorted(unknown))}")
        lanes = count * len(self.q)
        # One table: a kernel with an input per deviation would be compiled for every alignment of each in memory.
        table = np.zeros((len(DEVIATIONS), count, len(self.q)))
        for name, values in deviations.items():
            table[DEVIATIONS.index(name)] = values
        whole, lane, step = Float64(table.ravel()), dr.arange(UInt32, lanes), dr.opaque(UInt32, lanes)
        off = {name: dr.gather(Float64, whole, lane + row * step) for row, name in enumerate(DEVIATIONS)}
        layout, pose = self.layout, lane % dr.opaque(UInt32, len(self.q))
        pan = layout.pan.sign * self.q[:, 0] + np.radians(layout.pan.offset_deg)
        tilt = layout.tilt.sign * self.q[:, 1] + np.radians(layout.tilt.offset_deg)
        return {
            "off": off,
            "pose": pose,
            "pan": dr.gather(Float64, Float64(pan), pose) + off["pan"],
            "face": dr.gather(Float64, Float64(FACE_ELEVATION_AT_ZERO + tilt), pose) + off["tilt"],
            "m1": _pose(layout.camera_from_m1),
            "gimbal": _pose(layout.camera_from_gimbal),
            "port": _port(self.port, off),
        }


def _pose(pose: RigidTransform) -> tuple[Any, Any]:
    """Axes as a matrix and origin, inputs of the kernel."""
    matrix = pose.rotation.as_matrix()
    return Matrix3f64([[dr.opaque(Float64, float(x)) for x in row] for row in matrix]), opaque_vector(pose.translation)


def _port(port: Port, off: dict[str, Any]) -> dict[str, Any]:
    """Numbers of the port with each lane's deviations."""
    if not isinstance(port, FlatPort | DomePort):
        return port.parameters()
    parameters = port.parameters()
    n_port, n_water = parameters["n_port"] + off["n_port"], parameters["n_water"] + off["n_water"]
    parameters |= {
        "n_port": n_port,
        "n_water": n_water,
        "ratio_in": parameters["n_inside"] / n_port,
        "ratio_out": n_port / n_water,
    }
    if isinstance(port, FlatPort):
        normal = _turned_x(_turned_y(parameters["normal"], off["port_tilt_y"]), off["port_tilt_x"])
        return parameters | {
            "normal": normal,
            "distance": parameters["distance"] + off["port_z"],
            "thickness": parameters["thickness"] + off["port_thickness"],
        }
    return parameters | {
        "centre": parameters["centre"] + Array3f64(off["port_x"], off["port_y"], off["port_z"]),
        "outer": parameters["outer"] + off["port_thickness"],
    }


def _mirrors(parameters: dict[str, Any]) -> tuple[Plane, Plane]:
    """Kernel: a point on each mirror and its normal, camera frame."""
    off = parameters["off"]
    axes, origin = parameters["m1"]
    normal = axes @ _tilted_normal(off["m1_x"], off["m1_y"])
    m1 = Plane(point=origin + normal * off["m1_shift"], normal=normal)

    # M2's own frame turned into the pan frame: x is the tilt axis (pan y), up and face as `optics.layout.pan_from_m2`.
    local = _tilted_normal(off["m2_x"], off["m2_y"])
    sine, cosine = dr.sincos(parameters["face"])
    in_pan = Array3f64(cosine * local.z - sine * local.y, local.x, sine * local.z + cosine * local.y)
    in_pan = _turned_x(in_pan, off["tilt_axis_skew"])
    point = Array3f64(off["tilt_axis_shift_x"], 0, off["tilt_axis_shift_z"]) + in_pan * off["m2_shift"]
    axes, origin = parameters["gimbal"]
    normal, point = (_in_gimbal(parameters, vector) for vector in (in_pan, point))
    foot = Array3f64(off["gimbal_x"], off["gimbal_y"], off["gimbal_z"])
    return m1, Plane(point=origin + axes @ (foot + point), normal=axes @ normal)


def _in_gimbal(parameters: dict[str, Any], vector: Any) -> Any:
    """Kernel: from the pan frame into the gimbal's, by the pan angle and the lean of the pan axis."""
    sine, cosine = dr.sincos(parameters["pan"])
    turned = Array3f64(cosine * vector.x - sine * vector.y, sine * vector.x + cosine * vector.y, vector.z)
    off = parameters["off"]
    return _turned_x(_turned_y(turned, off["pan_axis_y"]), off["pan_axis_x"])


def _tilted_normal(x: Any, y: Any) -> Any:
    """Kernel: z turned about y, then about x."""
    return _turned_x(Array3f64(dr.sin(y), 0, dr.cos(y)), x)


def _turned_x(vector: Any, angle: Any) -> Any:
    sine, cosine = dr.sincos(angle)
    return Array3f64(vector.x, cosine * vector.y - sine * vector.z, sine * vector.y + cosine * vector.z)


def _turned_y(vector: Any, angle: Any) -> Any:
    sine, cosine = dr.sincos(angle)
    return Array3f64(cosine * vector.x + sine * vector.z, vector.y, cosine * vector.z - sine * vector.x)


def _behind_m2(port: type[Port], parameters: dict[str, Any], in_air: Any) -> tuple[Any, Any]:
    """Kernel: one ray of the camera through the port and over both mirrors, for every lane."""
    # As wide as the lanes: without a port nothing else would make it so.
    exit_ = port.trace(parameters["port"], in_air + 0 * parameters["pan"])
    point, direction = exit_.point, exit_.direction
    for mirror in _mirrors(parameters):
        normal = mirror.normal
        distance = dr.dot(mirror.point - point, normal) / dr.dot(direction, normal)
        point, direction = dr.fma(direction, distance, point), reflect(direction, normal)
    return point, direction


def _pixel(camera: Camera, port: Port, parameters: dict[str, Any], point: Any) -> tuple[Any, Any]:
    """Kernel: project by unfolding, as `optics.train` does."""
    m1, m2 = _mirrors(parameters)
    image = unfold(m1, unfold(m2, point))
    direction, converged, in_water = type(port).project(parameters["port"], image)
    model, distorted = camera.kind
    u, v, valid = model.pixel(camera.parameters(), distorted, direction)
    good = converged & in_water & valid
    return dr.select(good, u, dr.nan), dr.select(good, v, dr.nan)
