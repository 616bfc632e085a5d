"""Robust least squares: the errors under which a rig shows what was observed, and what the observations say of them.

Minimised is

    sum c^2 (sqrt(1 + (r / c)^2) - 1)  +  1/2 sum (p / sigma_p)^2,       r = (seen - observed) / noise,

pseudo-Huber ("soft L1") of the pixels and squares of what is believed beforehand. Each first term is half the square of
a residual of its own, so that a solver of plain least squares can do it (Triggs et al., Bundle adjustment, 2000,
section 4.3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import FloatArray
from tracking.calibration.chain import Chain
from tracking.calibration.model import ErrorModel
from tracking.calibration.observations import TargetObservations
from tracking.perception.corner_samples import CornerSamples

TURNING_POINT = 3.0
"""c: beyond this many standard deviations a pixel's pull no longer grows."""

MISSING = 1000.0
"""Residual of what the rig with its present errors does not show at all, in standard deviations."""

BOARD_STEPS = ("x", "y", "z", "turn_x", "turn_y", "turn_z")
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
    play : float
        Standard deviation of both joints about what they were told, anew in each pose, radians; 0: they obey.
    """

    target: TargetObservations | None
    edges: CornerSamples | None
    noise_px: float
    edge_noise_px: float
    play: float

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
    errors : dict of str to float
    cost : float
        Twice the minimised sum: chi-square of clean data.
    residuals : array, shape (m,)
        Seen less observed, in standard deviations; nan where nothing is seen.
    slopes : array, shape (m, k)
        Of the residuals by the errors, each counted in its scale.
    nuisance : array, shape (m + j, l)
        The same by what nobody asks for, poses of boards and play, with the rows that hold back the play below.
    converged : bool
        Whether the solver came to rest within its evaluations.
    """

    unknowns: FloatArray
    errors: dict[str, float]
    cost: float
    residuals: FloatArray
    slopes: FloatArray
    nuisance: FloatArray
    converged: bool


class Residuals:
    """Residuals of the evidence as a function of one vector of unknowns: errors, poses of boards, play of each pose.

    Parameters
    ----------
    model : ErrorModel
    evidence : Evidence
    scales : dict of str to float
        The errors that are looked for, and the size in which each is counted.
    boards : list of RigidTransform
        `camera_from_board` at the start.
    """

    def __init__(self, model: ErrorModel, evidence: Evidence, scales: dict[str, float], boards: list[RigidTransform]):
        self.model, self.evidence, self.boards = model, evidence, boards
        self.names = tuple(scales)
        self.scales = np.array([*scales.values(), *[BOARD_SCALE] * (6 * len(boards))])
        self.poses = evidence.poses() if evidence.play > 0 else np.empty((0, 2))
        self._board_names = tuple(f"board {i} {step}" for i in range(len(boards)) for step in BOARD_STEPS)
        # Play acts as a pan and a tilt of one pose.
        self._asked = tuple(dict.fromkeys([*self.names, *self._board_names, "pan", "tilt"]))

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return len(self.scales) + 2 * len(self.poses)

    def __call__(self, unknowns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals, shape (m,), in standard deviations, and their slopes, shape (m, count)."""
        values = unknowns[: len(self.scales)] * self.scales
        errors = dict(zip(self.names, values[: len(self.names)].tolist(), strict=True))
        play = unknowns[len(self.scales) :].reshape(-1, 2) * self.evidence.play
        parts = []
        if (target := self.evidence.target) is not None:
            points, rates = self._points(target, values[len(self.names) :])
            pixels, slopes = self.model.points(errors, self._moved(target.q, play), points, self._asked, rates)
            parts.append(self._scaled(pixels - target.pixels, slopes, target.q, self.evidence.noise_px))
        if (edges := self.evidence.edges) is not None:
            corners, slopes = self.model.corners(errors, self._moved(edges.q, play), self._asked)
            off = (corners - edges.corners_px).reshape(-1, 2)
            slopes = slopes.reshape(-1, 2, len(self._asked))
            parts.append(self._scaled(off, slopes, np.repeat(edges.q, 4, axis=0), self.evidence.edge_noise_px))
        return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])

    def _points(self, target: TargetObservations, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points in the camera frame, and how they move with the boards."""
        rates = np.zeros((len(target.q), 3, len(self._asked)))
        if not target.boards:
            return self.model.layout.body_from_camera.inv().apply(target.points_m), rates
        points = np.empty_like(target.points_m)
        for index, start in enumerate(self.boards):
            on, names = target.board == index, self._board_names[6 * index : 6 * index + 6]
            chain = Chain(start, 1)
            for axis in range(3):
                chain.shift(names[axis], axis, float(numbers[6 * index + axis]))
            for axis in range(3):
                chain.turn(names[3 + axis], axis, float(numbers[6 * index + 3 + axis]))
            of_origin, turning = chain.rates(self._asked)
            arms = target.points_m[on] @ chain.axes[0].T
            points[on] = arms + chain.origin_m
            rates[on] = of_origin + np.cross(turning, arms[..., np.newaxis], axis=1)
        return points, rates

    def _moved(self, q: FloatArray, play: FloatArray) -> FloatArray:
        """Joint values with the play of their poses."""
        if not len(play):
            return q
        layout = self.model.layout
        moved = (self._of_pose(q)[..., np.newaxis] * play).sum(axis=1)
        return np.asarray(q + moved * [layout.pan.sign, layout.tilt.sign])

    def _of_pose(self, q: FloatArray) -> FloatArray:
        """Which pose each row belongs to, as ones and zeros, shape (n, poses)."""
        return np.asarray((q[:, np.newaxis] == self.poses).all(axis=2), dtype=np.float64)

    def _scaled(
        self, off: FloatArray, slopes: FloatArray, q: FloatArray, noise: float
    ) -> tuple[FloatArray, FloatArray]:
        """Residuals and slopes of one kind of evidence, row by row, with a column for each unknown."""
        columns = [self._asked.index(name) for name in (*self.names, *self._board_names)]
        whole = np.empty((len(off), 2, self.count))
        whole[:, :, : len(columns)] = slopes[:, :, columns] * self.scales
        of_play = slopes[:, :, [self._asked.index(name) for name in ("pan", "tilt")]] * self.evidence.play
        of_poses = self._of_pose(q)[:, np.newaxis, :, np.newaxis] * of_play[:, :, np.newaxis, :]
        whole[:, :, len(columns) :] = of_poses.reshape(len(off), 2, 2 * len(self.poses))
        return (off / noise).ravel(), (whole / noise).reshape(-1, self.count)


def fit(
    residuals: Residuals,
    *,
    largest_evaluations: int,
    held: FloatArray | None = None,
    start: FloatArray | None = None,
) -> Fit:
    """Minimise by Levenberg and Marquardt's method (MINPACK).

    Parameters
    ----------
    residuals : Residuals
    largest_evaluations : int
        Of the solver.
    held : array, shape (h, k), optional
        Combinations of the errors, each counted in its scale, that are believed to be 0 +- 1; every error by default.
    start : array, shape (count,), optional
        Unknowns to begin with; zero by default.
    """
    error_count, count = len(residuals.names), residuals.count
    combinations = np.eye(error_count) if held is None else held
    # Boards may be anywhere; play is counted in its standard deviation.
    play_count = 2 * len(residuals.poses)
    holding = np.zeros((len(combinations) + play_count, count))
    holding[: len(combinations), :error_count] = combinations
    holding[len(combinations) :, count - play_count :] = np.eye(play_count)
    known: dict[bytes, tuple[FloatArray, FloatArray]] = {}

    def evaluated(unknowns: FloatArray) -> tuple[FloatArray, FloatArray]:
        key = unknowns.tobytes()
        if key not in known:
            known.clear()
            off, slopes = residuals(unknowns)
            lost = ~np.isfinite(off)
            off, slopes = np.where(lost, MISSING, off), np.where(lost[:, np.newaxis], 0.0, slopes)
            soft, factor = softened(off)
            known[key] = (
                np.concatenate([soft, holding @ unknowns]),
                np.concatenate([factor[:, np.newaxis] * slopes, holding]),
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
    off, slopes = residuals(found.x)
    slopes = np.where(np.isfinite(off)[:, np.newaxis], slopes, 0.0)
    errors = found.x[:error_count] * residuals.scales[:error_count]
    return Fit(
        unknowns=found.x,
        errors=dict(zip(residuals.names, errors.tolist(), strict=True)),
        cost=float(2 * found.cost),
        residuals=off,
        slopes=slopes[:, :error_count],
        nuisance=np.concatenate([slopes[:, error_count:], holding[len(combinations) :, error_count:]]),
        converged=bool(found.success),
    )


def softened(residuals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Residuals whose half squares are pseudo-Huber's, and their slopes by the plain ones."""
    root = np.sqrt(1 + (residuals / TURNING_POINT) ** 2)
    # c sqrt(2 (root - 1)) without the difference of nearly equal numbers: root - 1 = (r / c)^2 / (root + 1).
    shrink = np.sqrt(2 / (root + 1))
    return residuals * shrink, 1 / (root * shrink)
