"""What a calibration is made from: where the points of a board were seen, and at which joint values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from optics.layout import ROUNDING_DEG
from rigs import Rig
from tracking.perception.corners.samples import CornerSamples

FEWEST_POINTS = 12
"""Of a target: 24 numbers for the dozen or more that can be off."""

FEWEST_POINTS_OF_A_BOARD = 6
"""Of a board whose pose is not known: 12 numbers for its 6."""

FEWEST_POSES = 3
"""Different joint values: two numbers each for the two joints, and one to spare."""

FLATTEST = 1e-3
"""Points of a board are on a line when they are this much wider one way than the other."""


@dataclass(frozen=True, kw_only=True)
class TargetObservations:
    """Points of a known target in images.

    Attributes
    ----------
    q : array, shape (n, 2)
        Pan and tilt as they were commanded, radians; nan where the camera saw the point directly, past the mirrors.
    points_m : array, shape (n, 3)
        In the body frame; or, with boards, in the frame of the point's board, z = 0.
    pixels : array, shape (n, 2)
        Where the point was seen.
    boards : tuple of str
        Names of the boards whose pose is not known; empty when points are given in the body frame.
    board : array, shape (n,)
        Which of the boards each point is on; -1 without boards.
    """

    q: FloatArray
    points_m: FloatArray
    pixels: FloatArray
    boards: tuple[str, ...] = ()
    board: NDArray[np.intp]

    def __post_init__(self) -> None:
        count = len(self.q)
        shapes = (self.q.shape, self.points_m.shape, self.pixels.shape, self.board.shape)
        if shapes != ((count, 2), (count, 3), (count, 2), (count,)):
            raise ValueError(
                f"expected q (n, 2), points_m (n, 3), pixels (n, 2) and board (n,), got {', '.join(map(str, shapes))}"
            )

    @classmethod
    def in_body(cls, q: FloatArray, points_m: FloatArray, pixels: FloatArray) -> TargetObservations:
        """Of points whose places in the body frame are known."""
        return cls(q=q, points_m=points_m, pixels=pixels, board=np.full(len(q), -1))

    def rows(self, chosen: NDArray[np.bool_]) -> TargetObservations:
        """Some of the observations, of the same boards."""
        return TargetObservations(
            q=self.q[chosen],
            points_m=self.points_m[chosen],
            pixels=self.pixels[chosen],
            boards=self.boards,
            board=self.board[chosen],
        )


def observation_problems(rig: Rig, observations: TargetObservations, places: Sequence[str] | None = None) -> list[str]:
    """What keeps observations from being used for a rig: a sentence each, with its place."""
    told = places or [f"observation {index}" for index in range(len(observations.q))]
    problems = []
    camera = rig.camera
    high = np.array([camera.width_px, camera.height_px]) - 0.5
    numbers = np.isfinite(observations.points_m).all(axis=1) & np.isfinite(observations.pixels).all(axis=1)
    # Both joint values or neither: half a pose is a mistake, none is the direct view.
    numbers &= np.isfinite(observations.q).sum(axis=1) != 1
    problems += [f"{told[row]}: expected finite numbers" for row in np.flatnonzero(~numbers).tolist()]
    outside = numbers & ~((observations.pixels >= -0.5) & (observations.pixels <= high)).all(axis=1)
    problems += [
        f"{told[row]}: expected a pixel inside the {camera.width_px} x {camera.height_px} image, "
        f"got {observations.pixels[row].tolist()}"
        for row in np.flatnonzero(outside).tolist()
    ]
    problems += joint_problems(rig, observations.q, told)
    if len(observations.q) < FEWEST_POINTS:
        problems.append(f"expected at least {FEWEST_POINTS} observations, got {len(observations.q)}")
    problems += _pose_problems(observations.q)
    for index, name in enumerate(observations.boards):
        problems += _board_problems(name, observations.points_m[(observations.board == index) & numbers, :2])
    return problems


def joint_problems(rig: Rig, q: FloatArray, places: Sequence[str]) -> list[str]:
    """Joint values beyond the limits of a rig, shape (n, 2), radians; nan is none."""
    gaze = rig.require_gaze()
    problems = []
    for column, (name, joint) in enumerate((("q1", gaze.joints.pan), ("q2", gaze.joints.tilt))):
        degrees = np.degrees(q[:, column])
        beyond = (degrees < joint.min_deg - ROUNDING_DEG) | (degrees > joint.max_deg + ROUNDING_DEG)
        problems += [
            f"{places[row]}: expected {name} between {joint.min_deg:g} and {joint.max_deg:g} deg, got {degrees[row]:g}"
            for row in np.flatnonzero(beyond).tolist()
        ]
    return problems


def edge_problems(rig: Rig, edges: CornerSamples) -> list[str]:
    """What keeps corner samples from being used for a rig."""
    if problem := corners_problem(rig):
        return [problem]
    places = [f"sample {index}" for index in range(len(edges.q))]
    return [*joint_problems(rig, edges.q, places), *_pose_problems(edges.q)]


def corners_problem(rig: Rig) -> str:
    """What keeps the gaze mirror's corners from being found in images; empty for a rectangle.

    An octagon's long sides are too short to lead to the corners of the rectangle around it: 1.4 px off on aqua2.
    """
    outline = rig.require_gaze().gaze_mirror.outline
    if outline == "rectangle":
        return ""
    return (
        f"gaze_mirror.outline = {outline!r}: expected a rectangle, whose corners can be found in images; calibrate "
        "this mirror with the points of a board alone"
    )


def _pose_problems(q: FloatArray) -> list[str]:
    count = len(np.unique(q[np.isfinite(q).all(axis=1)], axis=0))
    return [] if count >= FEWEST_POSES else [f"expected at least {FEWEST_POSES} pairs of joint values, got {count}"]


def _board_problems(name: str, on_board_m: FloatArray) -> list[str]:
    if len(on_board_m) < FEWEST_POINTS_OF_A_BOARD:
        return [f"board {name}: expected at least {FEWEST_POINTS_OF_A_BOARD} observations, got {len(on_board_m)}"]
    spread = np.linalg.svd(on_board_m - on_board_m.mean(axis=0), compute_uv=False)
    if not spread[1] > FLATTEST * spread[0]:
        return [f"board {name}: expected points that are not on a line"]
    return []
