"""The perturbed train: where a built rig looks, where it sees points, and where its mirrors stand; exact, in float64.

A lane is one built rig at one pair of joint values. Every perturbation is a number per lane, so that thousands of rigs
and all their poses run in one kernel. Mirrors and aperture are unbounded here: a perturbation moves the view, it does
not cut it. `optics.perturbation.derivatives` differentiates the same kernels.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import RigidTransform, Rotation

from optics.camera import camera_from_spec
from optics.kernels.arrays import FloatArray, aligned, to_rows
from optics.kernels.backend import Float64, UInt32, dr
from optics.layout import Layout
from optics.mirror import PlaneMirror
from optics.mirror_outline import mirror_outline
from optics.perturbation.kernels import (
    ON_FACE,
    PIXEL,
    Kernel,
    Kind,
    compiled,
    mirror_frames,
    mirror_numbers,
    perturbed,
    pixels,
    rays,
)
from optics.perturbation.parameters import CAMERA, JOINTS, POINT, Perturbations, check_perturbations
from optics.ports.port import DomePort, FlatPort, Port, port_from_spec
from optics.train import OpticalTrain
from rigs import Rig
from rigs.gaze import FlatMirror

NOMINAL: Perturbations = {}
"""Nothing is perturbed."""


class PerturbedTrain:
    """Camera, port and mirrors of a rig, ready to be evaluated with perturbations (`optics.perturbation.parameters`).

    Perturbations and joint values may be arrays that broadcast together: batches of any shape, named (...) below.

    Parameters
    ----------
    rig : Rig
        With or without mirrors.
    """

    def __init__(self, rig: Rig):
        self.rig = rig
        self.camera = camera_from_spec(rig.camera)
        self.port: Port = port_from_spec(rig.port, rig.water)
        camera, distorted = self.camera.kind
        self.kind = Kind(model=rig.camera.model, camera=camera, distorted=distorted, port=type(self.port))
        self.numbers: dict[str, Any] = {"camera": self.camera.parameters(), "port": self.port.parameters()}
        if rig.gaze is not None:
            self.layout = Layout.from_rig(rig)
            self.numbers["mirrors"] = mirror_numbers(self.layout)

    def trace(
        self, q: ArrayLike, perturbations: Perturbations = NOMINAL, *, pixels: ArrayLike | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Follow rays of pixels out into the water.

        Parameters
        ----------
        q : array, shape (..., 2)
            Joint values, radians; NaN where the camera looks past the mirrors.
        perturbations : mapping
        pixels : array, shape (..., 2), optional
            The nominal principal point by default.

        Returns
        -------
        origin_m, direction : arrays, shape (..., 3)
            Point on the last surface and unit direction, camera frame; NaN where the camera has no ray or the port lets
            none out.
        """
        seen = (self.camera.cx_px, self.camera.cy_px) if pixels is None else pixels
        lanes, shape = self.lanes(q, perturbations, named(PIXEL, seen))
        origin_m, direction = (rows(vector, shape) for vector in self.run(rays, lanes))
        return origin_m, direction

    def project(self, points_m: ArrayLike, q: ArrayLike, perturbations: Perturbations = NOMINAL) -> FloatArray:
        """Pixels, shape (..., 2), of points of the camera frame, shape (..., 3).

        Where q is NaN they are seen past the mirrors. NaN where there is no pixel or the projection's root was not
        found; whether anything is in the way is not asked.
        """
        return self._project(q, perturbations, named(POINT, points_m))

    def project_face(self, face_m: ArrayLike, q: ArrayLike, perturbations: Perturbations = NOMINAL) -> FloatArray:
        """Pixels of points of M2's face over M1, whether or not M2 turns it to M1.

        Parameters
        ----------
        face_m : array, shape (k, 2)
            Along M2's x and y.
        q : array, shape (n, 2)
        perturbations : mapping
            One number each.

        Returns
        -------
        array, shape (n, k, 2)
        """
        return self._project(np.asarray(q)[:, np.newaxis], perturbations, named(ON_FACE, face_m))

    def gaze(self, q: ArrayLike, perturbations: Perturbations = NOMINAL) -> FloatArray:
        """Where the principal ray goes behind M2: unit vectors of the body frame, shape (..., 3)."""
        directions = self.trace(q, perturbations)[1]
        return np.asarray(directions @ self.layout.body_from_camera.rotation.as_matrix().T)

    def mirror_poses(self, q: ArrayLike, perturbations: Perturbations = NOMINAL) -> tuple[RigidTransform, ...]:
        """Poses of M1 and of M2 in the camera frame, as many as lanes each."""
        lanes, _ = self.lanes(q, perturbations, {})
        poses = []
        for origin, *axes in self.run(mirror_frames, lanes):
            rotation = Rotation.from_matrix(np.stack([to_rows(axis) for axis in axes], axis=-1))
            poses.append(RigidTransform.from_components(to_rows(origin), rotation))
        return tuple(poses)

    def optical_trains(self, q: ArrayLike, perturbations: Perturbations = NOMINAL) -> list[OpticalTrain]:
        """Exact trains, with aperture and outlines, at joint values of shape (n, 2); one number a perturbation.

        Raises
        ------
        ValueError
            Outside the joint limits.
        """
        gaze = self.rig.require_gaze()
        for q1, q2 in np.asarray(q).tolist():
            self.layout.check_joints(q1, q2)
        direct, plates = self.direct_train(perturbations), (gaze.fold_mirror, gaze.gaze_mirror)
        poses = zip(*self.mirror_poses(q, perturbations), strict=True)
        return [replace(direct, mirrors=tuple(map(_bounded, plates, pair))) for pair in poses]

    def direct_train(self, perturbations: Perturbations = NOMINAL) -> OpticalTrain:
        """Exact train of camera and port, past the mirrors; one number a perturbation."""
        lanes, _ = self.lanes((0.0, 0.0), perturbations, {})
        numbers = perturbed(self.kind, {name: self.numbers[name] for name in ("camera", "port")}, lanes)
        fields: dict[str, Any] = {f"{name}_px": _number(numbers["camera"][f"{name}_px"]) for name in CAMERA}
        coefficients = map(_number, numbers["camera"]["coefficients"])
        fields["distortion"] = tuple(coefficients)[: len(self.rig.camera.distortion)]
        camera = replace(self.camera, **fields)
        return OpticalTrain(camera=camera, port=_exact_port(self.port, numbers["port"]))

    def lanes(
        self, q: ArrayLike, perturbations: Perturbations, others: Mapping[str, ArrayLike]
    ) -> tuple[dict[str, Any], tuple[int, ...]]:
        """Numbers of every lane as Dr.Jit arrays by name, and the batch's shape."""
        check_perturbations(self.rig, perturbations)
        values = {**perturbations, **others}
        if "mirrors" in self.numbers:
            joints = np.asarray(q, dtype=np.float64)
            if joints.shape[-1:] != (2,):
                raise ValueError(f"expected q of shape (..., 2), got {joints.shape}")
            mirrored = np.asarray(np.isfinite(joints).all(axis=-1))
            values |= named(JOINTS, np.where(mirrored[..., np.newaxis], joints, 0.0))
            if not mirrored.all():
                values["mirrored"] = mirrored
        return lanes_of(values)

    def _project(self, q: ArrayLike, perturbations: Perturbations, seen: Mapping[str, ArrayLike]) -> FloatArray:
        lanes, shape = self.lanes(q, perturbations, seen)
        return rows(self.run(pixels, lanes), shape)

    def run(self, kernel: Kernel, lanes: dict[str, Any], *options: Any) -> Any:
        """Call a kernel of `optics.perturbation.kernels`, compiled once for lanes of these names."""
        return compiled(kernel, self.kind, tuple(lanes), *options)(self.numbers, lanes)


def lanes_of(values: Mapping[str, ArrayLike]) -> tuple[dict[str, Any], tuple[int, ...]]:
    """Numbers by name, which broadcast together, as Dr.Jit arrays with one for every lane, and the batch's shape."""
    shape = np.broadcast_shapes(*map(np.shape, values.values()))
    # An empty batch never reaches Dr.Jit, whose frozen functions end the process when they meet width 0.
    batch = shape if math.prod(shape) else ()
    # One table: a kernel with an input per number would be compiled for every alignment of each in memory.
    table = np.empty((len(values), *batch))
    for row, value in enumerate(values.values()):
        table[row] = value if math.prod(shape) else np.nan
    count = math.prod(batch)
    whole, lane, step = Float64(aligned(table, np.float64)), dr.arange(UInt32, count), dr.opaque(UInt32, count)
    lanes = {name: dr.gather(Float64, whole, lane + row * step) for row, name in enumerate(values)}
    dr.eval(lanes)
    return lanes, shape


def named(names: tuple[str, ...], vectors: ArrayLike) -> dict[str, FloatArray]:
    """Components of vectors, shape (..., len(names)), by name."""
    return dict(zip(names, np.moveaxis(np.asarray(vectors, dtype=np.float64), -1, 0), strict=True))


def rows(columns: Collection[Any], shape: tuple[int, ...]) -> FloatArray:
    """Columns of lanes, such as the components of vectors, as an array of the batch's shape, (..., columns)."""
    return to_rows(columns)[: math.prod(shape)].reshape(*shape, len(columns))


def _number(value: Any) -> float:
    return float(value[0])


def _exact_port(port: Port, numbers: dict[str, Any]) -> Port:
    if not isinstance(port, FlatPort | DomePort):
        return port
    indices = {name: _number(numbers[name]) for name in ("n_port", "n_water")}
    if isinstance(port, FlatPort):
        normal, lengths = to_rows(numbers["normal"])[0], (numbers["distance"], numbers["thickness"])
        distance_m, thickness_m = map(_number, lengths)
        return replace(port, normal=normal, distance_m=distance_m, thickness_m=thickness_m, **indices)
    centre_m, inner_m, outer_m = to_rows(numbers["centre"])[0], _number(numbers["inner"]), _number(numbers["outer"])
    return replace(port, centre_m=centre_m, radius_m=inner_m, thickness_m=outer_m - inner_m, **indices)


def _bounded(plate: FlatMirror, camera_from_mirror: RigidTransform) -> PlaneMirror:
    return PlaneMirror.from_pose(camera_from_mirror, mirror_outline(plate))
