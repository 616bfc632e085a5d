"""Derivatives: how a pixel moves, and a ray turns, with the point, the joints and every number of the rig.

The ray that leaves the pinhole along d and the point P that it must meet leave a residual r(d, p): the part of P that
is off the ray, two numbers. At the root that `project` found, r = 0, and the implicit function theorem gives

    dd/dp = -(dr/dd)^-1 dr/dp,        d(u, v)/dp = d(u, v)/dd dd/dp + d(u, v)/dp at fixed d

with each factor by reverse automatic differentiation (Dr.Jit, float64) of the *traced* ray. Differentiating the last
Newton step of the port's `project` would give the same first derivative, but that works in the plane of refraction,
which is not defined for a point on the port's axis nor for a centred dome; a traced ray is smooth there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optics.camera import camera_from_spec
from optics.kernels.arrays import FloatArray, check_points, opaque_vector, to_columns, to_rows
from optics.kernels.backend import Array3f64, Float64, UInt32, dr
from optics.layout import FACE_ELEVATION_AT_ZERO, Layout
from optics.mirror import MirrorPlane, reflect_over, unfold
from optics.ports.port import DomePort, FlatPort, NoPort, port_from_spec
from rigs import Rig

POINT = ("point_x_m", "point_y_m", "point_z_m")
CAMERA = ("fx_px", "fy_px", "cx_px", "cy_px")
DISTORTION = {"pinhole": ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"), "fisheye": ("k1", "k2", "k3", "k4")}
"""Coefficients as OpenCV names and orders them; a rig has as many of them as its file gives."""

FLAT_PORT = ("port_distance_m", "port_thickness_m", "port_tilt_x", "port_tilt_y", "n_port", "n_water")
DOME_PORT = ("port_centre_x_m", "port_centre_y_m", "port_centre_z_m", "port_radius_m", "port_thickness_m")
POSE = ("x_m", "y_m", "z_m", "turn_x", "turn_y", "turn_z")
MIRRORS = (
    *("q1", "q2", "fold_mirror_distance_m", "gaze_mirror_distance_m"),
    *(f"{mirror}_{freedom}" for mirror in ("m1", "m2") for freedom in POSE),
)

OFF_AXIS = 1e-9
"""A fisheye's formula divides by the sine of the angle from its axis; closer than this it is differentiated here,
where, even and odd terms being what they are, the derivative differs by less than rounding."""


@dataclass(frozen=True, kw_only=True)
class ProjectionJacobian:
    """Pixels of points and how they move.

    Attributes
    ----------
    pixels : array, shape (n, 2)
        (u, v); NaN where there is none. Whether anything is in the way is not asked: `OpticalTrain.project` knows.
    parameters : tuple of str, length k
        What the columns belong to.
    values : array, shape (n, 2, k)
        d(u, v) / d(parameter): pixels per metre, per radian, or per unit. NaN where there is no pixel.
    """

    pixels: FloatArray
    parameters: tuple[str, ...]
    values: FloatArray

    def of(self, parameter: str) -> FloatArray:
        """Column of one parameter, shape (n, 2)."""
        return self.values[:, :, self.parameters.index(parameter)]


def parameter_names(rig: Rig) -> tuple[str, ...]:
    """All parameters that `projection_jacobian` knows for a rig.

    The point; the camera with its distortion coefficients; the port and the indices; and, with mirrors, the joints, d1,
    d2 and six freedoms of each mirror's pose: shifts along its own x, y, z (normal) and turns about them, about the
    centre of its face. M2's are counted after the joints, so that `m2_z_m` is a face off the joint axes. `port_tilt_x`
    turns the port's normal about the camera's x through the pinhole, radians.
    """
    distortion = DISTORTION[rig.camera.model][: len(rig.camera.distortion)]
    return (*POINT, *CAMERA, *distortion, *_behind_the_lens(rig))


def _behind_the_lens(rig: Rig) -> tuple[str, ...]:
    """Parameters on which the path of a given ray from the pinhole depends."""
    port = {"flat": FLAT_PORT, "dome": (*DOME_PORT, "n_port", "n_water"), "none": ()}[rig.port.shape]
    return (*port, *(MIRRORS if rig.gaze is not None else ()))


def projection_jacobian(
    rig: Rig,
    points_m: ArrayLike,
    *,
    q1: ArrayLike = 0.0,
    q2: ArrayLike = 0.0,
    parameters: Sequence[str] | None = None,
    offsets: Mapping[str, ArrayLike] | None = None,
) -> ProjectionJacobian:
    """Pixels of points through port and mirrors, with their first derivatives.

    Parameters
    ----------
    rig : Rig
        With or without mirrors.
    points_m : array, shape (n, 3)
        Camera frame.
    q1, q2 : float or array, shape (n,)
        Joint values, radians: one pose for all points or one for each. They may lie beyond the limits. Unused without
        mirrors.
    parameters : sequence of str, optional
        Among `parameter_names(rig)`; all of them by default.
    offsets : mapping of str to float or array, shape (n,), optional
        How far parameters other than the point and the joints are from the rig's, where pixels and derivatives are
        taken; 0 by default.

    Notes
    -----
    All derivatives of all points are one kernel: four backward passes, whatever the number of parameters.
    """
    points = check_points("points_m", points_m, 3)
    names = _chosen(parameters, parameter_names(rig))
    joints = _joints(q1, q2, len(points))
    if not len(points):
        return ProjectionJacobian(pixels=np.empty((0, 2)), parameters=names, values=np.empty((0, 2, len(names))))
    values = _offsets(rig, offsets, len(points)) | joints | dict(zip(POINT, points.T, strict=True))
    leaves = _leaves(rig, values, len(points))
    return _differentiate(rig, leaves, names)


@dataclass(frozen=True, kw_only=True)
class RayJacobian:
    """Directions of rays behind the last surface and how they turn.

    Attributes
    ----------
    directions : array, shape (n, 3)
        Unit vectors in the water, camera frame; NaN where the port reflects the ray totally. Neither the port's
        aperture nor the mirrors' outlines are asked for.
    parameters : tuple of str, length k
    values : array, shape (n, 3, k)
        d(direction) / d(parameter), per metre, per radian, or per unit. NaN where there is no direction.
    """

    directions: FloatArray
    parameters: tuple[str, ...]
    values: FloatArray


def ray_jacobian(
    rig: Rig,
    directions_in_air: ArrayLike,
    *,
    q1: ArrayLike = 0.0,
    q2: ArrayLike = 0.0,
    parameters: Sequence[str] | None = None,
    offsets: Mapping[str, ArrayLike] | None = None,
) -> RayJacobian:
    """Where rays from the pinhole go behind port and mirrors, with the first derivatives of their directions.

    Parameters
    ----------
    rig : Rig
        With or without mirrors.
    directions_in_air : array, shape (n, 3)
        Unit vectors, camera frame.
    q1, q2 : float or array, shape (n,)
        Joint values, radians, as for `projection_jacobian`.
    parameters : sequence of str, optional
        Among those of `parameter_names(rig)` that are of the port and the mirrors; all of these by default.
    offsets : mapping of str to float or array, shape (n,), optional
        As for `projection_jacobian`.
    """
    in_air = check_points("directions_in_air", directions_in_air, 3)
    names = _chosen(parameters, _behind_the_lens(rig))
    joints = _joints(q1, q2, len(in_air))
    if not len(in_air):
        return RayJacobian(directions=np.empty((0, 3)), parameters=names, values=np.empty((0, 3, len(names))))
    leaves = _leaves(rig, _offsets(rig, offsets, len(in_air)) | joints, len(in_air))
    camera, port = camera_from_spec(rig.camera), port_from_spec(rig.port, rig.water)
    inputs = [leaves[name] for name in names]
    dr.enable_grad(*inputs)
    numbers = _numbers(rig, camera.parameters(), port, leaves)
    _, outgoing, transmitted = _trace(port, numbers, Array3f64(*to_columns(in_air)))
    # As wide as the rays, and dependent on every leaf, whatever the rig.
    outgoing = outgoing + 0 * sum(inputs, Float64(0))
    values = _gradients(list(outgoing), inputs)
    found = np.broadcast_to(np.array(transmitted), len(in_air)) & np.isfinite(values).all(axis=(1, 2))
    return RayJacobian(
        directions=np.where(found[:, np.newaxis], to_rows(dr.detach(outgoing)), np.nan),
        parameters=names,
        values=np.where(found[:, np.newaxis, np.newaxis], values, np.nan),
    )


def _chosen(parameters: Sequence[str] | None, known: tuple[str, ...]) -> tuple[str, ...]:
    names = known if parameters is None else tuple(parameters)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise ValueError(f"expected parameters among {', '.join(known)}, got {', '.join(unknown)}")
    return names


def _joints(q1: ArrayLike, q2: ArrayLike, count: int) -> dict[str, FloatArray]:
    return {name: _per_point(name, value, count) for name, value in (("q1", q1), ("q2", q2))}


def _offsets(rig: Rig, offsets: Mapping[str, ArrayLike] | None, count: int) -> dict[str, FloatArray]:
    known = tuple(name for name in parameter_names(rig) if name not in (*POINT, "q1", "q2"))
    _chosen(tuple(offsets or ()), known)
    return {name: _per_point(name, value, count) for name, value in (offsets or {}).items()}


def _leaves(rig: Rig, values: dict[str, FloatArray], count: int) -> dict[str, Any]:
    """A number per lane for every parameter there is: the given ones, and nothing for what is an offset."""
    names = list(dict.fromkeys([*parameter_names(rig), *POINT, "q1", "q2"]))
    # One table: a kernel with an input per parameter would be compiled for every alignment of each in memory.
    table = np.zeros((len(names), count))
    for row, name in enumerate(names):
        table[row] = values.get(name, 0.0)
    whole, lane, step = Float64(table.ravel()), dr.arange(UInt32, count), dr.opaque(UInt32, count)
    leaves = {name: dr.gather(Float64, whole, lane + row * step) for row, name in enumerate(names)}
    dr.eval(leaves)
    return leaves


def _per_point(name: str, value: ArrayLike, count: int) -> FloatArray:
    array = np.asarray(value, dtype=np.float64)
    if array.shape not in ((), (count,)):
        raise ValueError(f"expected {name} of shape () or ({count},), got {array.shape}")
    return np.broadcast_to(array, (count,))


def _differentiate(rig: Rig, leaves: dict[str, Any], names: tuple[str, ...]) -> ProjectionJacobian:
    camera, port = camera_from_spec(rig.camera), port_from_spec(rig.port, rig.water)
    # A lens without distortion has slopes by its coefficients too.
    model, distorted = camera.kind[0], True
    numbers = _numbers(rig, camera.parameters(), port, leaves)
    image = _point(leaves)
    for mirror in reversed(numbers["mirrors"]):
        image = unfold(mirror, image)
    root, converged, in_water = port.project(numbers["port"], image)
    u, v, valid = model.pixel(numbers["camera"], distorted, root)
    # The root is a number from here on, not the end of twelve Newton steps.
    dr.eval(root, u, v, converged, in_water, valid)
    across = _across(root)

    aside = [Float64(np.zeros(dr.width(root))) for _ in across]
    inputs = [*aside, *(leaves[name] for name in names)]
    dr.enable_grad(*inputs)
    direction = dr.normalize(root + across[0] * aside[0] + across[1] * aside[1])
    numbers = _numbers(rig, camera.parameters(), port, leaves)
    outputs = [
        *_miss(port, numbers, direction, _point(leaves)),
        *_pixel(model, numbers["camera"], distorted, direction),
    ]
    gradients = _gradients(outputs, inputs)
    of_direction, of_parameters = gradients[:, :, :2], gradients[:, :, 2:]
    found = np.array(converged & in_water & valid) & np.isfinite(gradients).all(axis=(1, 2))
    values = np.full((len(found), 2, len(names)), np.nan)
    turn = -np.linalg.solve(of_direction[found, :2], of_parameters[found, :2])
    values[found] = of_direction[found, 2:] @ turn + of_parameters[found, 2:]
    pixels = np.where(found[:, np.newaxis], to_rows((u, v)), np.nan)
    return ProjectionJacobian(pixels=pixels, parameters=names, values=values)


def _miss(port: Any, numbers: dict[str, Any], direction: Any, point: Any) -> tuple[Any, Any]:
    """Two components of the part of the point that is off the ray which leaves the pinhole along `direction`."""
    origin, outgoing, _ = _trace(port, numbers, direction)
    offset = point - origin
    offset = offset - outgoing * dr.dot(offset, outgoing)
    first, second = _across(dr.detach(outgoing))
    return dr.dot(offset, first), dr.dot(offset, second)


def _trace(port: Any, numbers: dict[str, Any], direction: Any) -> tuple[Any, Any, Any]:
    """Point on the last surface, direction behind it, and whether the port lets the ray out."""
    exit_ = port.trace(numbers["port"], direction)
    last = [exit_, *reflect_over(numbers["mirrors"], exit_.point, exit_.direction)][-1]
    return last.point, last.direction, exit_.transmitted


def _pixel(model: Any, camera: dict[str, Any], distorted: bool, direction: Any) -> tuple[Any, Any]:
    sideways = dr.maximum(dr.abs(dr.detach(direction.x)), dr.abs(dr.detach(direction.y)))
    u, v, _ = model.pixel(camera, distorted, direction + Array3f64(dr.select(sideways < OFF_AXIS, OFF_AXIS, 0), 0, 0))
    return u, v


def _gradients(outputs: Sequence[Any], inputs: Sequence[Any]) -> FloatArray:
    """Derivatives of each output with respect to each input, lane by lane: shape (n, outputs, inputs)."""
    rows = []
    for output in outputs:
        dr.backward_from(output, flags=dr.ADFlag.ClearInterior)
        rows.append([dr.grad(leaf) for leaf in inputs])
        dr.clear_grad(inputs)
    dr.eval(rows)
    count = max(dr.width(leaf) for leaf in inputs)
    table = np.empty((count, len(outputs), len(inputs)))
    for i, row in enumerate(rows):
        for j, value in enumerate(row):
            table[:, i, j] = value.numpy()
    return table


def _across(direction: Any) -> tuple[Any, Any]:
    """Two unit vectors that make a frame with a unit vector."""
    other = dr.select(dr.abs(direction.x) < 0.5, Array3f64(1, 0, 0), Array3f64(0, 1, 0))
    first = dr.normalize(dr.cross(direction, other))
    return first, dr.cross(direction, first)


def _point(leaves: dict[str, Any]) -> Any:
    return Array3f64(*(leaves[name] for name in POINT))


def _numbers(rig: Rig, camera: dict[str, Any], port: Any, leaves: dict[str, Any]) -> dict[str, Any]:
    """Kernel parameters of the train as functions of the leaves, which are offsets but for the point and the joints."""
    camera = camera | {name: camera[name] + leaves[name] for name in CAMERA}
    names = DISTORTION[rig.camera.model]
    camera["coefficients"] = [
        value + leaves[name] if name in leaves else value
        for name, value in zip(names, camera["coefficients"], strict=True)
    ]
    mirrors = _mirrors(Layout.from_rig(rig), leaves) if rig.gaze is not None else []
    return {"camera": camera, "port": _port(port, leaves), "mirrors": mirrors}


def _port(port: Any, leaves: dict[str, Any]) -> dict[str, Any]:
    numbers: dict[str, Any] = port.parameters()
    if isinstance(port, NoPort):
        return numbers
    n_port, n_water = numbers["n_port"] + leaves["n_port"], numbers["n_water"] + leaves["n_water"]
    numbers |= {"n_port": n_port, "n_water": n_water}
    numbers |= {"ratio_in": numbers["n_inside"] / n_port, "ratio_out": n_port / n_water}
    if isinstance(port, FlatPort):
        turn = Array3f64(leaves["port_tilt_x"], leaves["port_tilt_y"], 0)
        numbers["normal"] = dr.normalize(numbers["normal"] + dr.cross(turn, numbers["normal"]))
        numbers["distance"] = numbers["distance"] + leaves["port_distance_m"]
        numbers["thickness"] = numbers["thickness"] + leaves["port_thickness_m"]
    if isinstance(port, DomePort):
        numbers["centre"] = numbers["centre"] + Array3f64(*(leaves[name] for name in DOME_PORT[:3]))
        numbers["inner"] = numbers["inner"] + leaves["port_radius_m"]
        numbers["outer"] = numbers["outer"] + leaves["port_radius_m"] + leaves["port_thickness_m"]
    return numbers


def _mirrors(layout: Layout, leaves: dict[str, Any]) -> list[MirrorPlane]:
    """M1 and M2 in the camera frame, unbounded."""
    axial = Array3f64(0, 0, leaves["fold_mirror_distance_m"])
    folded = axial + opaque_vector(layout.fold_direction) * leaves["gaze_mirror_distance_m"]
    pan = layout.pan.sign * leaves["q1"] + np.radians(layout.pan.offset_deg)
    elevation = layout.tilt.sign * leaves["q2"] + FACE_ELEVATION_AT_ZERO + np.radians(layout.tilt.offset_deg)
    (sine, cosine), (rise, run) = dr.sincos(pan), dr.sincos(elevation)
    gimbal_axes = (
        Array3f64(-sine, cosine, 0),
        Array3f64(-rise * cosine, -rise * sine, run),
        Array3f64(run * cosine, run * sine, rise),
    )
    from_gimbal = [opaque_vector(column) for column in layout.camera_from_gimbal.rotation.as_matrix().T]
    m1_axes = [opaque_vector(column) for column in layout.camera_from_m1.rotation.as_matrix().T]
    m2_axes = [from_gimbal[0] * axis.x + from_gimbal[1] * axis.y + from_gimbal[2] * axis.z for axis in gimbal_axes]
    m1_point = opaque_vector(layout.camera_from_m1.translation) + axial
    m2_point = opaque_vector(layout.camera_from_gimbal.translation) + folded
    return [_moved("m1", m1_point, m1_axes, leaves), _moved("m2", m2_point, m2_axes, leaves)]


def _moved(name: str, point: Any, axes: Sequence[Any], leaves: dict[str, Any]) -> MirrorPlane:
    """A mirror shifted along its axes and turned about them, to first order in the turn."""
    x_m, y_m, z_m, turn_x, turn_y, turn_z = (leaves[f"{name}_{freedom}"] for freedom in POSE)
    turn = axes[0] * turn_x + axes[1] * turn_y + axes[2] * turn_z
    x, y, normal = (dr.normalize(axis + dr.cross(turn, axis)) for axis in axes)
    shifted = point + axes[0] * x_m + axes[1] * y_m + axes[2] * z_m
    return MirrorPlane(point=shifted, x=x, y=y, normal=normal)
