"""Bundle adjustment of cameras behind ports: robust least squares of pixels, with the boards' poses eliminated.

The unknowns are the parameters of the cameras and their ports, the poses of the cameras in that of the first, and six
numbers for each image's board. The last belong to one image each, so that the normal equations are an arrow: the boards
are eliminated block by block (Schur complement; Triggs et al., Bundle adjustment, 2000, section 6.1), and what is left
to solve has as many rows as there are parameters, whatever the number of images.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation
from scipy.stats import norm

from optics.kernels.arrays import FloatArray
from optics.perturbation.parameters import POINT
from optics.perturbation.port_camera import PortCamera, parameters_of
from tracking.calibration.fit import MISSING, softened
from tracking.port_calibration.observations import MEDIA, BoardObservations

POSE = 6
"""Numbers of a pose: shift and turn, in the frame that it leads to."""

POSE_NAMES = ("shift_x", "shift_y", "shift_z", "turn_x", "turn_y", "turn_z")

FIRST_DAMPING = 1e-3
LARGEST_DAMPING = 1e12
PRECISION = 1e-9
"""Relative change of the cost at which the solver stops."""

LEAST_GAIN = 1e-5
"""Change of the cost at which it stops in any case: no unknown moves by a hundredth of its standard deviation."""

LEAST_NOISE_PX = 1e-6
"""Of points without any: nothing is divided by zero."""

OUTLIER = 5.0
"""Standard deviations beyond which a point counts as an outlier."""

WIDENINGS = 10

SHARED = "n_water"
"""All cameras look into one water."""


Prior = Mapping[str, tuple[float, float]]
"""Value and standard deviation of parameters by name."""


@dataclass(frozen=True, kw_only=True)
class Arrangement:
    """Cameras behind ports, where they are, and where each image's board was.

    Attributes
    ----------
    cameras : tuple of PortCamera
    camera_from_rig : tuple of RigidTransform
        The rig's frame is that of the first camera.
    rig_from_board : RigidTransform
        As many as there are images.
    """

    cameras: tuple[PortCamera, ...]
    camera_from_rig: tuple[RigidTransform, ...]
    rig_from_board: RigidTransform


@dataclass(frozen=True, kw_only=True)
class Linearised:
    """Residuals and derivatives at an arrangement.

    Attributes
    ----------
    off_px : array, shape (n, 2)
        Predicted less observed; NaN where nothing is predicted.
    by_globals : array, shape (n, 2, g)
    by_board : array, shape (n, 2, 6)
    """

    off_px: FloatArray
    by_globals: FloatArray
    by_board: FloatArray


@dataclass(frozen=True, kw_only=True)
class Solution:
    """Where the solver arrived; `cost` is twice the minimised sum, in squares of the noise that was given."""

    arrangement: Arrangement
    cost: float
    converged: bool


class Bundle:
    """The unknowns of one adjustment, and its equations.

    Parameters
    ----------
    seen : BoardObservations
    free : sequence of tuple of str
        Parameters of each camera that are estimated.
    prior : tuple of Mapping, optional
        Of each camera, value and standard deviation of parameters: they hold what the images say nothing of.
    """

    def __init__(self, seen: BoardObservations, free: Sequence[tuple[str, ...]], prior: Sequence[Prior] | None = None):
        self.seen, self.free = seen, tuple(free)
        self.prior = tuple(prior) if prior is not None else tuple({} for _ in self.free)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Of the global unknowns: `camera.parameter`, and what all share without a camera."""
        own = [f"{camera}.{name}" for camera, names in zip(self.seen.cameras, self.free, strict=True) for name in names]
        shared = [name for name in own if name.endswith(f".{SHARED}")]
        poses = [f"{camera}.{name}" for camera in self.seen.cameras[1:] for name in POSE_NAMES]
        return (*(name for name in own if name not in shared), *poses, *((SHARED,) if shared else ()))

    def linearised(self, at: Arrangement) -> Linearised:
        """Residuals and their derivatives."""
        seen, count = self.seen, len(self.seen.pixels)
        off, by_globals = np.full((count, 2), np.nan), np.zeros((count, 2, len(self.names)))
        by_board = np.zeros((count, 2, POSE))
        for index, medium, chosen in self._groups():
            camera = in_medium(at.cameras[index], medium)
            arms, in_camera = _places(at, index, seen.image[chosen], seen.places_m[chosen])
            own = self._own(index, camera, medium)
            # All of them: one compiled kernel serves every choice of what is free.
            every = parameters_of(camera.model, camera.shape)
            found = camera.jacobian(in_camera, (*POINT, *every))
            by_point, turn = found.values[..., :3], at.camera_from_rig[index].rotation.as_matrix()
            off[chosen] = found.outputs - seen.pixels[chosen]
            by_board[chosen] = by_point @ turn @ _by_pose(arms)
            for name in own:
                by_globals[chosen, :, self._column(index, name)] = found.of(name)
            if index:
                first = self._column(index, POSE_NAMES[0])
                turned = in_camera - at.camera_from_rig[index].translation
                by_globals[chosen, :, first : first + POSE] = by_point @ _by_pose(turned)
        return Linearised(off_px=off, by_globals=by_globals, by_board=by_board)

    def residuals(self, at: Arrangement) -> FloatArray:
        """Predicted less observed, pixels, shape (n, 2); NaN where nothing is predicted."""
        off = np.full((len(self.seen.pixels), 2), np.nan)
        for index, medium, chosen in self._groups():
            in_camera = _places(at, index, self.seen.image[chosen], self.seen.places_m[chosen])[1]
            off[chosen] = in_medium(at.cameras[index], medium).project(in_camera) - self.seen.pixels[chosen]
        return off

    def cost(self, at: Arrangement, noise_px: float) -> float:
        """Twice what is minimised."""
        off, weight = self.prior_at(at)
        return robust_cost(self.residuals(at), noise_px) + float((weight * off**2).sum())

    def prior_at(self, at: Arrangement) -> tuple[FloatArray, FloatArray]:
        """How far each global unknown is off its prior, and the prior's inverse variance; zero without one."""
        off, weight = np.zeros(len(self.names)), np.zeros(len(self.names))
        for index, (camera, prior) in enumerate(zip(at.cameras, self.prior, strict=True)):
            values = camera.values()
            for name in self.free[index]:
                if name in prior and name in values:
                    centre, size = prior[name]
                    column = self._column(index, name)
                    off[column], weight[column] = values[name] - centre, size**-2
        return off, weight

    def solve(self, start: Arrangement, *, noise_px: float = 1.0, steps: int = 100) -> Solution:
        """Minimise from a start by Levenberg and Marquardt's method."""
        at, cost, damping = start, self.cost(start, noise_px), FIRST_DAMPING
        for _ in range(steps):
            equations = self._normal(self.linearised(at), noise_px).with_prior(*self.prior_at(at))
            better, damping = self._step(at, equations, cost, damping, noise_px)
            if better is None:
                return Solution(arrangement=at, cost=cost, converged=True)
            gain, (at, cost) = cost - better[1], better
            if gain <= max(PRECISION * cost, LEAST_GAIN):
                return Solution(arrangement=at, cost=cost, converged=True)
        return Solution(arrangement=at, cost=cost, converged=False)

    def information(self, at: Arrangement, noise_px: float) -> FloatArray:
        """Inverse covariance of the global unknowns with the boards' poses unknown, shape (g, g)."""
        equations = self._normal(self.linearised(at), noise_px)
        return equations.reduced(0.0)[0]

    def _step(
        self, at: Arrangement, equations: _Normal, cost: float, damping: float, noise_px: float
    ) -> tuple[tuple[Arrangement, float] | None, float]:
        """The next arrangement with its cost, None where none is better, and the next damping."""
        while damping < LARGEST_DAMPING:
            moved = self._moved(at, *equations.steps(damping))
            new_cost = self.cost(moved, noise_px)
            if new_cost < cost:
                return (moved, new_cost), damping / 9
            damping *= 4
        return None, damping

    def _moved(self, at: Arrangement, steps: FloatArray, board_steps: FloatArray) -> Arrangement:
        named = dict(zip(self.names, steps.tolist(), strict=True))
        cameras, poses = [], []
        for index, (name, camera) in enumerate(zip(self.seen.cameras, at.cameras, strict=True)):
            # What is shared moves in all cameras alike; one without a port has none of it.
            keys = {each: each if each == SHARED else f"{name}.{each}" for each in self.free[index]}
            cameras.append(camera.moved({each: named[key] for each, key in keys.items()}))
            pose = at.camera_from_rig[index]
            if index:
                pose = _moved_pose(pose, np.array([named[f"{name}.{each}"] for each in POSE_NAMES]))
            poses.append(pose)
        boards = _moved_pose(at.rig_from_board, board_steps)
        return replace(at, cameras=tuple(cameras), camera_from_rig=tuple(poses), rig_from_board=boards)

    def _normal(self, found: Linearised, noise_px: float) -> _Normal:
        off, lost = found.off_px / noise_px, np.isnan(found.off_px)
        soft, factor = softened(np.where(lost, MISSING, off))
        weight = np.where(lost, 0.0, factor / noise_px)[..., np.newaxis]
        wide = weight * np.nan_to_num(found.by_globals)
        local = weight * np.nan_to_num(found.by_board)
        return _Normal.of(wide, local, soft, self.seen.image, len(self.seen.images))

    def _groups(self) -> list[tuple[int, str, NDArray[np.intp]]]:
        seen = self.seen
        pairs = np.unique(np.stack([seen.camera, seen.medium], axis=1), axis=0).tolist()
        return [
            (camera, MEDIA[medium], np.flatnonzero((seen.camera == camera) & (seen.medium == medium)))
            for camera, medium in pairs
        ]

    def _own(self, index: int, camera: PortCamera, medium: str) -> tuple[str, ...]:
        """Free parameters of a camera that act in a medium."""
        acting = camera.values()
        return tuple(name for name in self.free[index] if name in acting and not (medium == "air" and name == SHARED))

    def _column(self, index: int, name: str) -> int:
        return self.names.index(SHARED if name == SHARED else f"{self.seen.cameras[index]}.{name}")


@dataclass(frozen=True, kw_only=True)
class _Normal:
    """Normal equations: the global block, its coupling to each board, the boards' blocks, and the right-hand sides."""

    wide: FloatArray
    coupling: FloatArray
    boards: FloatArray
    wide_side: FloatArray
    board_sides: FloatArray

    @classmethod
    def of(cls, wide: FloatArray, local: FloatArray, off: FloatArray, image: NDArray[np.intp], images: int) -> _Normal:
        count, parameters = len(off), wide.shape[2]
        coupling = np.zeros((images, parameters, POSE))
        boards, sides = np.zeros((images, POSE, POSE)), np.zeros((images, POSE))
        np.add.at(coupling, image, np.einsum("nic,nid->ncd", wide, local, optimize=True))
        np.add.at(boards, image, np.einsum("nic,nid->ncd", local, local, optimize=True))
        np.add.at(sides, image, np.einsum("nic,ni->nc", local, off))
        flat = wide.reshape(2 * count, parameters)
        return cls(
            wide=flat.T @ flat, coupling=coupling, boards=boards, wide_side=flat.T @ off.ravel(), board_sides=sides
        )

    def with_prior(self, off: FloatArray, weight: FloatArray) -> _Normal:
        """The same with what pulls each global unknown to its prior."""
        return replace(self, wide=self.wide + np.diag(weight), wide_side=self.wide_side + weight * off)

    def reduced(self, damping: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Schur complement and its right-hand side, and the coupling times the inverse of each board's block."""
        inverse: FloatArray = np.asarray(np.linalg.pinv(_damped(self.boards, damping), hermitian=True), dtype=float)
        share = self.coupling @ inverse
        complement = _damped(self.wide, damping) - np.einsum("fac,fbc->ab", share, self.coupling, optimize=True)
        return complement, self.wide_side - np.einsum("fac,fc->a", share, self.board_sides), inverse

    def steps(self, damping: float) -> tuple[FloatArray, FloatArray]:
        """Steps of the global unknowns, shape (g,), and of the boards, shape (images, 6)."""
        complement, side, inverse = self.reduced(damping)
        scale = np.sqrt(np.maximum(np.diag(self.wide), np.finfo(np.float64).tiny))
        step = np.zeros(len(side))
        if len(side):
            step = -np.linalg.lstsq(complement / np.outer(scale, scale), side / scale)[0] / scale
        rest = self.board_sides + np.einsum("fac,a->fc", self.coupling, step)
        return step, -np.einsum("fcd,fd->fc", inverse, rest)


def _damped(matrix: FloatArray, damping: float) -> FloatArray:
    diagonal = np.einsum("...ii->...i", matrix)
    return np.asarray(matrix + damping * diagonal[..., np.newaxis] * np.eye(matrix.shape[-1]))


def robust_cost(off_px: FloatArray, noise_px: float) -> float:
    """Twice the pseudo-Huber sum of residuals, with `MISSING` for what is not shown, in squares of the noise."""
    soft, _ = softened(np.where(np.isnan(off_px), MISSING, off_px / noise_px))
    return float((soft**2).sum())


def in_medium(camera: PortCamera, medium: str) -> PortCamera:
    """A camera as it sees in one of `MEDIA`."""
    if medium == "water":
        return camera
    return camera.in_air() if medium == "air" else camera.bare()


def _places(
    at: Arrangement, camera: int, image: NDArray[np.intp], board_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points seen from the board's origin, in the rig's axes, and in the camera's frame."""
    turns = at.rig_from_board.rotation.as_matrix()
    arms = np.einsum("nij,nj->ni", turns[image], board_m)
    in_rig = arms + at.rig_from_board.translation[image]
    return arms, at.camera_from_rig[camera].apply(in_rig)


def _by_pose(arms: FloatArray) -> FloatArray:
    """Derivatives of points, shape (n, 3, 6), by shift and turn of their pose, whose origin they are `arms` from."""
    x, y, z = arms.T
    zero, one = np.zeros_like(x), np.ones_like(x)
    rows = [[one, zero, zero, zero, z, -y], [zero, one, zero, -z, zero, x], [zero, zero, one, y, -x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=1)


def _moved_pose(pose: RigidTransform, step: FloatArray) -> RigidTransform:
    """One pose or many, shifted and turned by as many steps, shape (..., 6)."""
    turn = Rotation.from_rotvec(step[..., 3:]) * pose.rotation
    return RigidTransform.from_components(pose.translation + step[..., :3], turn)


def standard_noise(off_px: FloatArray) -> float:
    """Root mean square of residuals without outliers, pixels.

    It begins with the median size, which a few outliers cannot change, and takes in what is within `OUTLIER` of it, so
    often until no more comes: long tails count, points far away do not.
    """
    sizes = np.abs(off_px[np.isfinite(off_px)])
    width = float(np.median(sizes) / norm.ppf(0.75)) if len(sizes) else 0.0
    for _ in range(WIDENINGS):
        kept = sizes[sizes <= OUTLIER * width]
        width = float(np.sqrt((kept**2).mean())) if len(kept) else width
    return max(width, LEAST_NOISE_PX)
