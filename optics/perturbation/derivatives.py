"""Derivatives of the perturbed train: how a pixel moves, and a ray turns, with every parameter, point and joint.

A point has one image over the mirrors, `optics.perturbation.kernels.unfolded`. The ray that leaves the pinhole along d
and the image I(p) that it must hit behind the port leave a residual r(d, p): the part of I that is off the ray, two
numbers. At the root that the port's `project` found, r = 0, and the implicit function theorem gives

    dd/dp = -(dr/dd)^-1 dr/dp,        d(u, v)/dp = d(u, v)/dd dd/dp + d(u, v)/dp at fixed d

with each factor by reverse automatic differentiation (Dr.Jit, float64) of the *traced* ray. Differentiating the last
Newton step of `project` would give the same first derivative, but that works in the plane of refraction, which is not
defined for a point on the port's axis nor for a centred dome; a traced ray is smooth there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray, check_points
from optics.kernels.backend import Array3f64, Float64, dr
from optics.kernels.freezing import frozen
from optics.perturbation.kernels import ON_FACE, Kind, perturbed, projected, traced, unfolded
from optics.perturbation.parameters import (
    JOINTS,
    POINT,
    Perturbations,
    check_parameters,
    parameters_behind_the_lens,
    rig_parameters,
)
from optics.perturbation.train import NOMINAL, PerturbedTrain, named, rows
from optics.ports.port import Port
from rigs import Rig

RAY = ("ray_x", "ray_y", "ray_z")
"""Direction of a ray in air."""

OFF_AXIS = 1e-9
"""A fisheye's formula divides by the sine of the angle from its axis; closer than this it is differentiated here,
where, even and odd terms being what they are, the derivative differs by less than rounding."""


@dataclass(frozen=True, kw_only=True)
class ProjectionJacobian:
    """Pixels of points and how they move; (...) is (n,) for points and (n, c) for c points of M2's face.

    Attributes
    ----------
    pixels : array, shape (..., 2)
        (u, v); NaN where there is none. Whether anything is in the way is not asked: `OpticalTrain.project` knows.
    parameters : tuple of str, length k
        What the columns belong to.
    values : array, shape (..., 2, k)
        d(u, v) / d(parameter): pixels per metre, per radian, or per unit. NaN where there is no pixel.
    """

    pixels: FloatArray
    parameters: tuple[str, ...]
    values: FloatArray

    def of(self, parameter: str) -> FloatArray:
        """Column of one parameter, shape (..., 2)."""
        return self.values[..., self.parameters.index(parameter)]


@dataclass(frozen=True, kw_only=True)
class RayJacobian:
    """Directions of rays behind the last surface and how they turn.

    Attributes
    ----------
    directions : array, shape (n, 3)
        Unit vectors; NaN where the port reflects the ray totally. Neither the port's aperture nor the mirrors'
        outlines are asked for.
    parameters : tuple of str, length k
    values : array, shape (n, 3, k)
        d(direction) / d(parameter), per metre, per radian, or per unit. NaN where there is no direction.
    """

    directions: FloatArray
    parameters: tuple[str, ...]
    values: FloatArray


def parameter_names(rig: Rig) -> tuple[str, ...]:
    """All that `projection_jacobian` differentiates by: the point, the joints, and the parameters of the rig."""
    return (*POINT, *(JOINTS if rig.gaze is not None else ()), *rig_parameters(rig))


def projection_jacobian(
    train: PerturbedTrain,
    points_m: ArrayLike,
    *,
    q1: ArrayLike = 0.0,
    q2: ArrayLike = 0.0,
    parameters: Sequence[str] | None = None,
    perturbations: Perturbations = NOMINAL,
) -> ProjectionJacobian:
    """Pixels of points through port and mirrors, with their first derivatives.

    Parameters
    ----------
    train : PerturbedTrain
        With or without mirrors.
    points_m : array, shape (n, 3)
        Camera frame.
    q1, q2 : float or array, shape (n,)
        Joint values, radians: one pose for all points or one for each. They may lie beyond the limits; NaN where the
        point is seen past the mirrors. Unused without mirrors.
    parameters : sequence of str, optional
        Among `parameter_names(rig)`; all of them by default.
    perturbations : mapping of str to float or array, shape (n,), optional
        Where pixels and derivatives are taken; the nominal rig by default.

    Notes
    -----
    All derivatives of all points are one kernel: four backward passes, whatever the number of parameters.
    """
    points = check_points("points_m", points_m, 3)
    names = _chosen(parameters, parameter_names(train.rig))
    q = _joints(q1, q2, len(points))
    return _projection_jacobian(train, q, named(POINT, points), names, perturbations)


def face_jacobian(
    train: PerturbedTrain,
    face_m: ArrayLike,
    q: ArrayLike,
    *,
    parameters: Sequence[str],
    perturbations: Perturbations = NOMINAL,
) -> ProjectionJacobian:
    """Pixels of points of M2's face over M1, with their first derivatives.

    Parameters
    ----------
    train : PerturbedTrain
        With mirrors.
    face_m : array, shape (c, 2)
        Along M2's x and y, the same for all joint values.
    q : array, shape (n, 2)
        Radians.
    parameters : sequence of str
        Joints and parameters of the rig.
    perturbations : mapping of str to float, optional
    """
    names = _chosen(parameters, (*JOINTS, *rig_parameters(train.rig)))
    return _projection_jacobian(train, np.asarray(q)[:, np.newaxis], named(ON_FACE, face_m), names, perturbations)


def ray_jacobian(
    train: PerturbedTrain,
    directions_in_air: ArrayLike,
    *,
    q1: ArrayLike = 0.0,
    q2: ArrayLike = 0.0,
    parameters: Sequence[str] | None = None,
    perturbations: Perturbations = NOMINAL,
) -> RayJacobian:
    """Where rays from the pinhole go behind port and mirrors (camera frame), with the derivatives of their directions.

    Parameters
    ----------
    train : PerturbedTrain
    directions_in_air : array, shape (n, 3)
        Unit vectors, camera frame.
    q1, q2 : float or array, shape (n,)
        Joint values, radians, as for `projection_jacobian`.
    parameters : sequence of str, optional
        Among those of `parameter_names(rig)` that are of the port, the mirrors and the joints; all of these by default.
    perturbations : mapping of str to float or array, shape (n,), optional
        As for `projection_jacobian`.
    """
    in_air = check_points("directions_in_air", directions_in_air, 3)
    joints = JOINTS if train.rig.gaze is not None else ()
    names = _chosen(parameters, (*joints, *parameters_behind_the_lens(train.rig)))
    lanes, shape = _lanes(train, _joints(q1, q2, len(in_air)), named(RAY, in_air), names, perturbations)
    directions, gradients = compiled_ray_jacobian(train.kind, tuple(lanes), names)(train.numbers, lanes)
    values = _table(gradients)[: len(in_air), :, 1:]
    found = np.asarray(np.isfinite(values).all(axis=(1, 2)))
    return RayJacobian(
        directions=np.where(found[:, np.newaxis], rows(directions, shape), np.nan),
        parameters=names,
        values=np.where(found[:, np.newaxis, np.newaxis], values, np.nan),
    )


def gaze_jacobian(
    train: PerturbedTrain, q: FloatArray, *, parameters: Sequence[str], perturbations: Perturbations = NOMINAL
) -> RayJacobian:
    """Where the principal ray goes behind M2 in the body frame, for joint values of shape (n, 2), with derivatives."""
    camera = train.camera
    axis, _ = camera.unproject([(camera.cx_px, camera.cy_px)])
    in_air = np.repeat(axis, len(q), axis=0)
    found = ray_jacobian(train, in_air, q1=q[:, 0], q2=q[:, 1], parameters=parameters, perturbations=perturbations)
    turn = train.layout.body_from_camera.rotation.as_matrix()
    return RayJacobian(
        directions=found.directions @ turn.T, parameters=found.parameters, values=np.asarray(turn @ found.values)
    )


def _chosen(parameters: Sequence[str] | None, known: tuple[str, ...]) -> tuple[str, ...]:
    names = known if parameters is None else tuple(parameters)
    check_parameters(names, known)
    return names


def _joints(q1: ArrayLike, q2: ArrayLike, count: int) -> FloatArray:
    joints = {name: np.asarray(value, dtype=np.float64) for name, value in (("q1", q1), ("q2", q2))}
    for name, array in joints.items():
        if array.shape not in ((), (count,)):
            raise ValueError(f"expected {name} of shape () or ({count},), got {array.shape}")
    return np.stack([np.broadcast_to(array, count) for array in joints.values()], axis=-1)


def _lanes(
    train: PerturbedTrain,
    q: FloatArray,
    seen: Mapping[str, FloatArray],
    names: tuple[str, ...],
    perturbations: Perturbations,
) -> tuple[dict[str, Any], tuple[int, ...]]:
    """Lanes with a number for each parameter to differentiate by."""
    nominal = dict.fromkeys((name for name in names if name not in (*POINT, *JOINTS)), 0.0)
    return train.lanes(q, {**nominal, **perturbations}, seen)


def _projection_jacobian(
    train: PerturbedTrain,
    q: FloatArray,
    seen: Mapping[str, FloatArray],
    names: tuple[str, ...],
    perturbations: Perturbations,
) -> ProjectionJacobian:
    lanes, shape = _lanes(train, q, seen, names, perturbations)
    pixels, gradients = compiled_projection_jacobian(train.kind, tuple(lanes), names)(train.numbers, lanes)
    table = _table(gradients)[: math.prod(shape)]
    of_direction, of_parameters = table[:, :, :2], table[:, :, 2:]
    found = np.asarray(np.isfinite(table).all(axis=(1, 2)))
    values = np.full((len(found), 2, len(names)), np.nan)
    turn = -np.linalg.solve(of_direction[found, :2], of_parameters[found, :2])
    values[found] = of_direction[found, 2:] @ turn + of_parameters[found, 2:]
    return ProjectionJacobian(
        pixels=np.where(found.reshape(*shape, 1), rows(pixels, shape), np.nan),
        parameters=names,
        values=values.reshape(*shape, 2, len(names)),
    )


@cache
def compiled_projection_jacobian(kind: Kind, lanes: tuple[str, ...], names: tuple[str, ...]) -> Callable[..., Any]:
    """Frozen kernel: pixels; derivatives of residual and pixel by direction and by `names`."""

    @frozen()
    def jacobian(numbers: dict[str, Any], lanes: dict[str, Any]) -> tuple[Any, Any]:
        nominal = perturbed(kind, numbers, lanes)
        root, pixel, found = projected(kind, nominal, unfolded(nominal, lanes))
        # The root is a number from here on, not the end of twelve Newton steps.
        dr.eval(root, pixel, found)
        across = _across(root)

        lanes = {name: Float64(value) for name, value in lanes.items()}
        aside = [dr.zeros(Float64, dr.width(root)) for _ in across]
        inputs = [*aside, *(lanes[name] for name in names)]
        dr.enable_grad(*inputs)
        direction = dr.normalize(root + across[0] * aside[0] + across[1] * aside[1])
        moved = perturbed(kind, numbers, lanes)
        miss = _miss(kind[2], moved["port"], direction, unfolded(moved, lanes))
        outputs = [*miss, *_pixel(kind[1], moved["camera"], direction)]
        return pixel, _gradients(outputs, inputs, found)

    return jacobian


@cache
def compiled_ray_jacobian(kind: Kind, lanes: tuple[str, ...], names: tuple[str, ...]) -> Callable[..., Any]:
    """Frozen kernel: directions behind the train, their derivatives by the ray and by `names`."""

    @frozen()
    def jacobian(numbers: dict[str, Any], lanes: dict[str, Any]) -> tuple[Any, Any]:
        lanes = {name: Float64(value) for name, value in lanes.items()}
        # The ray itself as well: whatever the rig, the direction behind it depends on something.
        inputs = [lanes[name] for name in (RAY[0], *names)]
        dr.enable_grad(*inputs)
        in_air = Array3f64(*(lanes[name] for name in RAY))
        _, direction, transmitted = traced(kind, perturbed(kind, numbers, lanes), lanes, in_air)
        found = transmitted & dr.isfinite(lanes[RAY[0]])
        return dr.detach(direction), _gradients(list(direction), inputs, found)

    return jacobian


def _miss(port: type[Port], numbers: dict[str, Any], direction: Any, image: Any) -> tuple[Any, Any]:
    """Two components of the part of the image that is off the ray which leaves the pinhole along `direction`."""
    exit_ = port.trace(numbers, direction)
    origin, outgoing = exit_.point, exit_.direction
    offset = image - origin
    offset = offset - outgoing * dr.dot(offset, outgoing)
    first, second = _across(dr.detach(outgoing))
    return dr.dot(offset, first), dr.dot(offset, second)


def _pixel(model: Any, camera: dict[str, Any], direction: Any) -> tuple[Any, Any]:
    sideways = dr.maximum(dr.abs(dr.detach(direction.x)), dr.abs(dr.detach(direction.y)))
    u, v, _ = model.pixel(camera, True, direction + Array3f64(dr.select(sideways < OFF_AXIS, OFF_AXIS, 0), 0, 0))
    return u, v


def _gradients(outputs: Sequence[Any], inputs: Sequence[Any], found: Any) -> list[list[Any]]:
    """Derivatives of each output with respect to each input, lane by lane; NaN where nothing was found."""
    table = []
    for output in outputs:
        dr.backward_from(output, flags=dr.ADFlag.ClearInterior)
        # Selected by lane: a literal, such as zero, would stay at the width that the kernel was frozen with.
        table.append([dr.select(found, dr.grad(leaf), dr.nan) for leaf in inputs])
        dr.clear_grad(inputs)
    return table


def _table(gradients: list[list[Any]]) -> FloatArray:
    """The same as an array, shape (n, outputs, inputs)."""
    return np.moveaxis(np.array([[value.numpy() for value in row] for row in gradients]), -1, 0)


def _across(direction: Any) -> tuple[Any, Any]:
    """Two unit vectors that make a frame with a unit vector."""
    other = dr.select(dr.abs(direction.x) < 0.5, Array3f64(1, 0, 0), Array3f64(0, 1, 0))
    first = dr.normalize(dr.cross(direction, other))
    return first, dr.cross(direction, first)
