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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optics.camera import Camera
from optics.kernels.arrays import FloatArray
from optics.kernels.backend import Array3f64, Float64, dr
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
class Jacobian:
    """Pixels of points or directions of rays, and how they move; (...) is the batch of joint values and perturbations.

    Attributes
    ----------
    outputs : array, shape (..., 2) or (..., 3)
        Pixels (u, v) or unit vectors; NaN where there is none. Whether anything is in the way is not asked.
    parameters : tuple of str, length k
        What the columns belong to.
    values : array, shape (..., 2, k) or (..., 3, k)
        d(output) / d(parameter), per metre, per radian, or per unit. NaN where there is no output.
    """

    outputs: FloatArray
    parameters: tuple[str, ...]
    values: FloatArray

    def of(self, parameter: str) -> FloatArray:
        """Column of one parameter, shape (..., 2) or (..., 3)."""
        return self.values[..., self.parameters.index(parameter)]


def parameter_names(rig: Rig) -> tuple[str, ...]:
    """All that `projection_jacobian` differentiates by: the point, the joints, and the parameters of the rig."""
    return (*POINT, *(JOINTS if rig.gaze is not None else ()), *rig_parameters(rig))


def projection_jacobian(
    train: PerturbedTrain,
    points_m: ArrayLike,
    q: ArrayLike = (0.0, 0.0),
    perturbations: Perturbations = NOMINAL,
    *,
    parameters: Sequence[str] | None = None,
) -> Jacobian:
    """Pixels of points through port and mirrors, as `PerturbedTrain.project`, with their first derivatives.

    Parameters
    ----------
    train : PerturbedTrain
        With or without mirrors.
    points_m : array, shape (..., 3)
        Camera frame.
    q : array, shape (..., 2)
        Joint values, radians; they may lie beyond the limits. NaN where the point is seen past the mirrors.
    perturbations : mapping of str to float or array, optional
        Where pixels and derivatives are taken.
    parameters : sequence of str, optional
        Among `parameter_names(rig)`; all of them by default.

    Notes
    -----
    All derivatives of all points are one kernel: four backward passes, whatever the number of parameters.
    """
    names = _chosen(parameters, parameter_names(train.rig))
    return _of_pixels(train, named(POINT, points_m), q, perturbations, names)


def face_jacobian(
    train: PerturbedTrain,
    face_m: ArrayLike,
    q: ArrayLike,
    perturbations: Perturbations = NOMINAL,
    *,
    parameters: Sequence[str] | None = None,
) -> Jacobian:
    """Pixels of points of M2's face over M1, shape (n, c, 2), as `PerturbedTrain.project_face`, with derivatives."""
    names = _chosen(parameters, (*JOINTS, *rig_parameters(train.rig)))
    return _of_pixels(train, named(ON_FACE, face_m), np.asarray(q)[:, np.newaxis], perturbations, names)


def ray_jacobian(
    train: PerturbedTrain,
    directions_in_air: ArrayLike,
    q: ArrayLike = (0.0, 0.0),
    perturbations: Perturbations = NOMINAL,
    *,
    parameters: Sequence[str] | None = None,
) -> Jacobian:
    """Directions behind port and mirrors, camera frame, of rays from the pinhole, with their first derivatives.

    Parameters
    ----------
    train, q, perturbations
        As for `projection_jacobian`.
    directions_in_air : array, shape (..., 3)
        Unit vectors, camera frame.
    parameters : sequence of str, optional
        Of port, mirrors and joints; all of these by default.
    """
    joints = JOINTS if train.rig.gaze is not None else ()
    names = _chosen(parameters, (*joints, *parameters_behind_the_lens(train.rig)))
    lanes, shape = _lanes(train, named(RAY, directions_in_air), q, perturbations, names)
    directions, gradients = train.run(_ray_kernel, lanes, names)
    return _found(rows(directions, shape), _table(gradients, shape)[..., 1:], names)


def gaze_jacobian(
    train: PerturbedTrain, q: ArrayLike, perturbations: Perturbations = NOMINAL, *, parameters: Sequence[str]
) -> Jacobian:
    """Where the principal ray goes behind M2 in the body frame, as `PerturbedTrain.gaze`, with derivatives."""
    axis, _ = train.camera.unproject([(train.camera.cx_px, train.camera.cy_px)])
    found = ray_jacobian(train, axis[0], q, perturbations, parameters=parameters)
    turn = train.layout.body_from_camera.rotation.as_matrix()
    return replace(found, outputs=found.outputs @ turn.T, values=turn @ found.values)


def _chosen(parameters: Sequence[str] | None, known: tuple[str, ...]) -> tuple[str, ...]:
    names = known if parameters is None else tuple(parameters)
    check_parameters(names, known)
    return names


def _lanes(
    train: PerturbedTrain,
    seen: Mapping[str, FloatArray],
    q: ArrayLike,
    perturbations: Perturbations,
    names: tuple[str, ...],
) -> tuple[dict[str, Any], tuple[int, ...]]:
    """Lanes with a number for each parameter to differentiate by, and the batch's shape."""
    nominal = dict.fromkeys((name for name in names if name not in (*POINT, *JOINTS)), 0.0)
    return train.lanes(q, {**nominal, **perturbations}, seen)


def _of_pixels(
    train: PerturbedTrain,
    seen: Mapping[str, FloatArray],
    q: ArrayLike,
    perturbations: Perturbations,
    names: tuple[str, ...],
) -> Jacobian:
    lanes, shape = _lanes(train, seen, q, perturbations, names)
    pixels, gradients = train.run(pixel_gradients, lanes, names)
    return jacobian_of_pixels(pixels, gradients, shape, names)


def jacobian_of_pixels(
    pixels: Any, gradients: list[list[Any]], shape: tuple[int, ...], names: tuple[str, ...]
) -> Jacobian:
    """Jacobian of pixels from what `pixel_gradients` returns: the implicit function theorem, lane by lane."""
    table = _table(gradients, shape)
    found = np.asarray(np.isfinite(table).all(axis=(-2, -1)))
    of_direction, of_parameters = table[found][..., :2], table[found][..., 2:]
    values = np.full((*shape, 2, len(names)), np.nan)
    turn = -np.linalg.solve(of_direction[:, :2], of_parameters[:, :2])
    values[found] = of_direction[:, 2:] @ turn + of_parameters[:, 2:]
    return _found(rows(pixels, shape), values, names)


def _found(outputs: FloatArray, values: FloatArray, names: tuple[str, ...]) -> Jacobian:
    """Nothing but NaN where anything is."""
    lost = ~np.isfinite(values).all(axis=(-2, -1))
    outputs[lost], values[lost] = np.nan, np.nan
    return Jacobian(outputs=outputs, parameters=names, values=values)


def pixel_gradients(
    kind: Kind, numbers: dict[str, Any], lanes: dict[str, Any], names: tuple[str, ...]
) -> tuple[Any, list[list[Any]]]:
    """Kernel: pixels, and derivatives of residual and pixel by direction and by `names`."""
    nominal = perturbed(kind, numbers, lanes)
    root, pixel, found = projected(kind, nominal, lanes)
    # The root is a number from here on, not the end of twelve Newton steps.
    dr.eval(root, pixel, found)
    across = _across(root)

    lanes = {name: Float64(value) for name, value in lanes.items()}
    aside = [dr.zeros(Float64, dr.width(root)) for _ in across]
    inputs = [*aside, *(lanes[name] for name in names)]
    dr.enable_grad(*inputs)
    direction = dr.normalize(root + across[0] * aside[0] + across[1] * aside[1])
    moved = perturbed(kind, numbers, lanes)
    miss = _miss(kind.port, moved["port"], direction, unfolded(moved, lanes))
    there = _pixel(kind.camera, moved["camera"], kind.distorts(lanes), direction)
    return pixel, _gradients([*miss, *there], inputs, found)


def _ray_kernel(
    kind: Kind, numbers: dict[str, Any], lanes: dict[str, Any], names: tuple[str, ...]
) -> tuple[Any, list[list[Any]]]:
    """Kernel: directions behind the train, and their derivatives by the ray and by `names`."""
    lanes = {name: Float64(value) for name, value in lanes.items()}
    # The ray itself as well: whatever the rig, the direction behind it depends on something.
    inputs = [lanes[name] for name in (RAY[0], *names)]
    dr.enable_grad(*inputs)
    in_air = Array3f64(*(lanes[name] for name in RAY))
    _, direction, transmitted = traced(kind, perturbed(kind, numbers, lanes), lanes, in_air)
    found = transmitted & dr.isfinite(lanes[RAY[0]])
    return dr.detach(direction), _gradients(list(direction), inputs, found)


def _miss(port: type[Port], numbers: dict[str, Any], direction: Any, image: Any) -> tuple[Any, Any]:
    """Two components of the part of the image that is off the ray which leaves the pinhole along `direction`."""
    exit_ = port.trace(numbers, direction)
    origin, outgoing = exit_.point, exit_.direction
    offset = image - origin
    offset = offset - outgoing * dr.dot(offset, outgoing)
    first, second = _across(dr.detach(outgoing))
    return dr.dot(offset, first), dr.dot(offset, second)


def _pixel(model: type[Camera], camera: dict[str, Any], distorted: bool, direction: Any) -> tuple[Any, Any]:
    sideways = dr.maximum(dr.abs(dr.detach(direction.x)), dr.abs(dr.detach(direction.y)))
    u, v, _ = model.pixel(camera, distorted, direction + Array3f64(dr.select(sideways < OFF_AXIS, OFF_AXIS, 0), 0, 0))
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


def _table(gradients: list[list[Any]], shape: tuple[int, ...]) -> FloatArray:
    """The same as an array, shape (..., outputs, inputs)."""
    table = np.array([[value.numpy() for value in row] for row in gradients])
    return np.moveaxis(table, -1, 0)[: math.prod(shape)].reshape(*shape, *table.shape[:2])


def _across(direction: Any) -> tuple[Any, Any]:
    """Two unit vectors that make a frame with a unit vector."""
    other = dr.select(dr.abs(direction.x) < 0.5, Array3f64(1, 0, 0), Array3f64(0, 1, 0))
    first = dr.normalize(dr.cross(direction, other))
    return first, dr.cross(direction, first)
