"""Robust least squares: the perturbations under which a rig shows what was observed, and the derivatives there.

Minimised is

    sum c^2 (sqrt(1 + (r / c)^2) - 1)  +  1/2 sum (p / sigma_p)^2,       r = (predicted - observed) / noise,

pseudo-Huber ("soft L1") of the pixels and squares of the prior. Each first term is half the square of a residual of its
own, so that a solver of plain least squares can do it (Triggs et al., Bundle adjustment, 2000, section 4.3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares
from scipy.spatial.transform import RigidTransform, Rotation

from optics.kernels.arrays import FloatArray
from optics.perturbation.derivatives import face_jacobian, projection_jacobian
from optics.perturbation.parameters import JOINT_OFFSETS, POINT
from optics.perturbation.train import PerturbedTrain
from tracking.calibration.observations import TargetObservations
from tracking.perception.corners.exact import crop_outline_m
from tracking.perception.corners.samples import CornerSamples

TURNING_POINT = 3.0
"""c: beyond this many standard deviations a pixel's pull no longer grows."""

MISSING = 1000.0
"""Residual of what the rig with its present perturbations does not show at all, in standard deviations."""

BOARD_NUMBERS = 6
"""Of a board's pose: its shifts along and its turns about its own x, y and z."""

BOARD_SCALE = 0.01
"""Metres and radians in which a board's pose is counted by the solver."""

PRECISION = 1e-10
"""Relative change of cost, step and gradient at which the solver stops."""


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """All that is observed, and how well.

    Attributes
    ----------
    target : TargetObservations, optional
    edges : CornerSamples, optional
    noise_px, edge_noise_px : float
        Standard deviations of the pixels of target and corners, in u and in v.
    backlash : float
        Standard deviation of both joints about their commanded values, different in each pose, radians; 0: none.
    """

    target: TargetObservations | None
    edges: CornerSamples | None
    noise_px: float
    edge_noise_px: float
    backlash: float

    def poses(self) -> FloatArray:
        """All different joint values, shape (p, 2)."""
        parts = [part.q for part in (self.target, self.edges) if part is not None]
        q = np.concatenate(parts)
        return np.unique(q[np.isfinite(q).all(axis=1)], axis=0)


@dataclass(frozen=True, kw_only=True)
class Fit:
    """Where the solver arrived.

    Attributes
    ----------
    unknowns : array, shape (count,)
        As `Residuals` takes them.
    perturbations : dict of str to float
    cost : float
        Twice the minimised sum: chi-square of clean data.
    residuals : array, shape (m,)
        Predicted less observed, in standard deviations; nan where the rig shows nothing.
    jacobian : array, shape (m, k)
        Derivatives of the residuals by the perturbations, each counted in its scale.
    nuisance : array, shape (m + j, l)
        The same by the nuisance parameters, poses of boards and backlash, with the rows that regularise the backlash
        below.
    converged : bool
        Whether the solver came to rest within its evaluations.
    """

    unknowns: FloatArray
    perturbations: dict[str, float]
    cost: float
    residuals: FloatArray
    jacobian: FloatArray
    nuisance: FloatArray
    converged: bool


class Residuals:
    """Residuals of the evidence by one vector of unknowns: perturbations, poses of boards, backlash of each pose.

    Parameters
    ----------
    train : PerturbedTrain
    evidence : Evidence
    scales : dict of str to float
        The parameters that are estimated, and the size in which each is counted.
    boards : list of RigidTransform
        `camera_from_board` at the start.
    """

    def __init__(
        self, train: PerturbedTrain, evidence: Evidence, scales: dict[str, float], boards: list[RigidTransform]
    ):
        self.train, self.evidence, self.boards = train, evidence, boards
        self.names = tuple(scales)
        self.scales = np.array([*scales.values(), *[BOARD_SCALE] * (BOARD_NUMBERS * len(boards))])
        self.poses = evidence.poses() if evidence.backlash > 0 else np.empty((0, 2))
        self._parameters = tuple(dict.fromkeys([*self.names, *JOINT_OFFSETS]))
        self._outline = crop_outline_m(train.rig)

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return len(self.scales) + 2 * len(self.poses)

    def __call__(self, unknowns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals, shape (m,), in standard deviations, and their Jacobian, shape (m, count)."""
        values = unknowns[: len(self.scales)] * self.scales
        perturbations = dict(zip(self.names, values[: len(self.names)].tolist(), strict=True))
        backlash = unknowns[len(self.scales) :].reshape(-1, 2) * self.evidence.backlash
        parts = []
        if (target := self.evidence.target) is not None:
            points, by_boards = self._points(target, values[len(self.names) :].reshape(-1, BOARD_NUMBERS))
            moved = _with_backlash(perturbations, self._of_pose(target.q) @ backlash)
            names = (*POINT, *self._parameters)
            found = projection_jacobian(self.train, points, target.q, moved, parameters=names)
            by_point, by_parameters = found.values[:, :, :3], found.values[:, :, 3:]
            off = found.outputs - target.pixels
            parts.append(self._scaled(off, by_parameters, by_point @ by_boards, target.q, self.evidence.noise_px))
        if (edges := self.evidence.edges) is not None:
            moved = _with_backlash(perturbations, (self._of_pose(edges.q) @ backlash)[:, np.newaxis])
            found = face_jacobian(self.train, self._outline, edges.q, moved, parameters=self._parameters)
            off, by_parameters = found.outputs - edges.corners_px, found.values.reshape(-1, 2, len(self._parameters))
            rows = np.repeat(edges.q, len(self._outline), axis=0)
            parts.append(self._scaled(off.reshape(-1, 2), by_parameters, 0.0, rows, self.evidence.edge_noise_px))
        return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])

    def _points(self, target: TargetObservations, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points in the camera frame, and their derivatives by the boards' numbers."""
        by_boards = np.zeros((len(target.q), 3, numbers.size))
        if not target.boards:
            return self.train.layout.body_from_camera.inv().apply(target.points_m), by_boards
        points = np.empty_like(target.points_m)
        for index, (start, of_board) in enumerate(zip(self.boards, numbers, strict=True)):
            on = target.board == index
            columns = slice(BOARD_NUMBERS * index, BOARD_NUMBERS * (index + 1))
            points[on], by_boards[on, :, columns] = moved_board(start, of_board, target.points_m[on])
        return points, by_boards

    def _of_pose(self, q: FloatArray) -> FloatArray:
        """Which pose each row belongs to, as ones and zeros, shape (n, poses)."""
        return np.asarray((q[:, np.newaxis] == self.poses).all(axis=2), dtype=np.float64)

    def _scaled(
        self, off: FloatArray, by_parameters: FloatArray, by_boards: FloatArray | float, q: FloatArray, noise: float
    ) -> tuple[FloatArray, FloatArray]:
        """Residuals and Jacobian of one kind of evidence, row by row, with a column for each unknown."""
        count, board_end = len(self.names), len(self.scales)
        whole = np.empty((len(off), 2, self.count))
        whole[:, :, :count] = by_parameters[:, :, :count] * self.scales[:count]
        whole[:, :, count:board_end] = by_boards * self.scales[count:]
        by_offsets = by_parameters[:, :, [self._parameters.index(name) for name in JOINT_OFFSETS]]
        by_poses = self._of_pose(q)[:, np.newaxis, :, np.newaxis] * by_offsets[:, :, np.newaxis]
        whole[:, :, board_end:] = self.evidence.backlash * by_poses.reshape(len(off), 2, 2 * len(self.poses))
        return (off / noise).ravel(), (whole / noise).reshape(-1, self.count)


def _with_backlash(perturbations: dict[str, float], backlash: FloatArray) -> dict[str, ArrayLike]:
    """Perturbations with the backlash of both joints, shape (..., 2), which acts as an offset of each in one pose."""
    offsets = {name: perturbations.get(name, 0.0) + backlash[..., i] for i, name in enumerate(JOINT_OFFSETS)}
    return {**perturbations, **offsets}


def moved_board(start: RigidTransform, numbers: FloatArray, points_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points of a board, shape (n, 3), whose pose is shifted along its axes and then turned about its x, y and z.

    Returns
    -------
    points_m, values : arrays, shape (n, 3) and (n, 3, 6)
        Camera frame, and derivatives by the three shifts and the three turns.
    """
    shift, angles = numbers[:3], numbers[3:]
    frames = [start.rotation]
    for angle, axis in zip(angles, np.eye(3), strict=True):
        frames.append(frames[-1] * Rotation.from_rotvec(angle * axis))
    arms, along = frames[-1].apply(points_m), frames[0].as_matrix()
    about = np.column_stack([frame.as_matrix()[:, index] for index, frame in enumerate(frames[:3])])
    turning = np.cross(about, arms[..., np.newaxis], axisa=0, axisb=1, axisc=1)
    shifting = np.broadcast_to(along, turning.shape)
    return arms + start.translation + along @ shift, np.concatenate([shifting, turning], axis=2)


def fit(
    residuals: Residuals,
    *,
    largest_evaluations: int,
    regularised: FloatArray | None = None,
    start: FloatArray | None = None,
) -> Fit:
    """Minimise by Levenberg and Marquardt's method (MINPACK).

    Parameters
    ----------
    residuals : Residuals
    largest_evaluations : int
        Of the solver.
    regularised : array, shape (h, k), optional
        Combinations of the perturbations, each counted in its scale, whose prior is 0 +- 1; every one by default.
    start : array, shape (count,), optional
        Unknowns to begin with; zero by default.
    """
    parameter_count, count = len(residuals.names), residuals.count
    combinations = np.eye(parameter_count) if regularised is None else regularised
    # Boards may be anywhere; backlash is counted in its standard deviation.
    backlash_count = 2 * len(residuals.poses)
    regularising = np.zeros((len(combinations) + backlash_count, count))
    regularising[: len(combinations), :parameter_count] = combinations
    regularising[len(combinations) :, count - backlash_count :] = np.eye(backlash_count)
    known: dict[bytes, tuple[FloatArray, FloatArray]] = {}

    def evaluated(unknowns: FloatArray) -> tuple[FloatArray, FloatArray]:
        key = unknowns.tobytes()
        if key not in known:
            known.clear()
            off, jacobian = residuals(unknowns)
            lost = ~np.isfinite(off)
            off, jacobian = np.where(lost, MISSING, off), np.where(lost[:, np.newaxis], 0.0, jacobian)
            soft, factor = softened(off)
            known[key] = (
                np.concatenate([soft, regularising @ unknowns]),
                np.concatenate([factor[:, np.newaxis] * jacobian, regularising]),
            )
        return known[key]

    found: Any = least_squares(
        lambda unknowns: evaluated(unknowns)[0],
        np.zeros(count) if start is None else start,
        method="lm",
        jac=lambda unknowns: evaluated(unknowns)[1],
        xtol=PRECISION,
        ftol=PRECISION,
        gtol=PRECISION,
        max_nfev=largest_evaluations,
    )
    off, jacobian = residuals(found.x)
    jacobian = np.where(np.isfinite(off)[:, np.newaxis], jacobian, 0.0)
    perturbations = found.x[:parameter_count] * residuals.scales[:parameter_count]
    return Fit(
        unknowns=found.x,
        perturbations=dict(zip(residuals.names, perturbations.tolist(), strict=True)),
        cost=float(2 * found.cost),
        residuals=off,
        jacobian=jacobian[:, :parameter_count],
        nuisance=np.concatenate([jacobian[:, parameter_count:], regularising[len(combinations) :, parameter_count:]]),
        converged=bool(found.success),
    )


def softened(residuals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Residuals whose half squares are pseudo-Huber's, and their derivatives by the plain ones."""
    root = np.sqrt(1 + (residuals / TURNING_POINT) ** 2)
    # c sqrt(2 (root - 1)) without the difference of nearly equal numbers: root - 1 = (r / c)^2 / (root + 1).
    shrink = np.sqrt(2 / (root + 1))
    return residuals * shrink, 1 / (root * shrink)
