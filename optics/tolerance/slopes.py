"""What a small deviation does to gaze and image, to first order: automatic derivatives, chained.

`optics.derivatives` knows the freedoms of each mirror's pose, the joints and the port. What is off in a built rig moves
some of these: a gimbal's axis that leans turns M2, a gimbal that stands aside shifts it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from optics.camera import camera_from_spec
from optics.derivatives import projection_jacobian, ray_jacobian
from optics.kernels.arrays import FloatArray
from optics.layout import Layout, pan_from_m2
from rigs import Rig

SAME = {
    "m1_shift": "m1_z_m",
    "m1_x": "m1_turn_x",
    "m1_y": "m1_turn_y",
    "m2_shift": "m2_z_m",
    "m2_x": "m2_turn_x",
    "m2_y": "m2_turn_y",
    "port_tilt_x": "port_tilt_x",
    "port_tilt_y": "port_tilt_y",
    "port_thickness": "port_thickness_m",
    "n_port": "n_port",
    "n_water": "n_water",
}
"""Deviations (`optics.tolerance.train.DEVIATIONS`) that are a parameter of `optics.derivatives`."""

PORT_PLACE = {
    "flat": {"port_z": "port_distance_m"},
    "dome": {f"port_{axis}": f"port_centre_{axis}_m" for axis in "xyz"},
    "none": {},
}

OF_THE_GIMBAL = {
    "gimbal_x": (0, "m"),
    "gimbal_y": (1, "m"),
    "gimbal_z": (2, "m"),
    "pan_axis_x": (0, "turn"),
    "pan_axis_y": (1, "turn"),
}
"""Shifts along (m) and turns about an axis of the gimbal's frame."""

OF_THE_PAN = {"tilt_axis_shift_x": (0, "m"), "tilt_axis_shift_z": (2, "m"), "tilt_axis_skew": (0, "turn")}
"""The same in the pan frame."""


def gaze_slopes(rig: Rig, q: FloatArray, deviations: Sequence[str]) -> FloatArray:
    """Derivatives of the gaze's direction (camera frame) by some deviations, shape (deviations, k, 3).

    Parameters
    ----------
    rig : Rig
        With mirrors.
    q : array, shape (k, 2)
        Joint values (q1, q2) of the poses, radians.
    deviations : sequence of str
        Among `optics.tolerance.train.DEVIATIONS`.
    """
    camera = camera_from_spec(rig.camera)
    axis, _ = camera.unproject([(camera.cx_px, camera.cy_px)])
    found = ray_jacobian(rig, np.repeat(axis, len(q), axis=0), q1=q[:, 0], q2=q[:, 1])
    return _chained(rig, q, found.parameters, found.values, deviations)


def image_slopes(rig: Rig, q: FloatArray, targets_m: FloatArray, deviations: Sequence[str]) -> FloatArray:
    """Derivatives of the pixel of each pose's target, shape (k, 3), camera frame, shape (deviations, k, 2)."""
    found = projection_jacobian(rig, targets_m, q1=q[:, 0], q2=q[:, 1])
    return _chained(rig, q, found.parameters, found.values, deviations)


def _chained(
    rig: Rig, q: FloatArray, parameters: tuple[str, ...], values: FloatArray, deviations: Sequence[str]
) -> FloatArray:
    """Slopes by deviations from slopes by parameters, shape (k, components, parameters)."""
    rates = np.zeros((len(deviations), len(q), len(parameters)))
    for row, deviation in enumerate(deviations):
        for name, rate in _rates(rig, q, deviation).items():
            rates[row, :, parameters.index(name)] = rate
    return np.asarray(np.einsum("dkp,kcp->dkc", rates, values))


def _rates(rig: Rig, q: FloatArray, deviation: str) -> dict[str, FloatArray | float]:
    """How fast each parameter changes with a deviation, in each pose."""
    layout = Layout.from_rig(rig)
    same = SAME | PORT_PLACE[rig.port.shape]
    if deviation in same:
        return {same[deviation]: 1.0}
    if deviation in ("pan", "tilt"):
        joint, name = (layout.pan, "q1") if deviation == "pan" else (layout.tilt, "q2")
        return {name: float(joint.sign)}
    in_gimbal = deviation in OF_THE_GIMBAL
    axis, kind = (OF_THE_GIMBAL if in_gimbal else OF_THE_PAN)[deviation]
    pan_from_mirror = [pan_from_m2(layout.tilt.angle(tilt)).rotation for tilt in q[:, 1]]
    outer = [Rotation.from_euler("z", layout.pan.angle(pan) if in_gimbal else 0.0) for pan in q[:, 0]]
    along = np.array([(a * b).inv().apply(np.eye(3)[axis]) for a, b in zip(outer, pan_from_mirror, strict=True)])
    names = ("m2_x_m", "m2_y_m", "m2_z_m") if kind == "m" else ("m2_turn_x", "m2_turn_y", "m2_turn_z")
    return dict(zip(names, along.T, strict=True))
