"""What calibration sessions of different kinds and lengths would give for a rig: which one to hold, and how long."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from optics.arrays import FloatArray
from rigs import Rig
from tracking.calibration.calibrated_rig import joint_grid
from tracking.calibration.errors import PRINT_TOLERANCES, draw_errors
from tracking.calibration.estimate import NOISE_PX, calibrate
from tracking.calibration.simulation import (
    Remaining,
    remaining,
    simulated_edges,
    simulated_target,
    useful_poses,
)

POSE_COUNTS = (6, 12, 24, 48)


@dataclass(frozen=True, kw_only=True)
class Session:
    """A kind of session.

    Attributes
    ----------
    name : str
    boards : bool
        Whether the tank's boards are looked at.
    known : bool
        Whether their places in the body frame are known.
    direct : bool
        Whether they are also seen without the mirrors.
    edges : bool
        Whether M2's corners are found, over the joints' whole range.
    """

    name: str
    boards: bool
    known: bool = False
    direct: bool = False
    edges: bool = False


SESSIONS = (
    Session(name="edges only", boards=False, edges=True),
    Session(name="boards anywhere", boards=True),
    Session(name="boards anywhere, also seen directly", boards=True, direct=True),
    Session(name="boards anywhere, also seen directly, and edges", boards=True, direct=True, edges=True),
    Session(name="boards in known places", boards=True, known=True),
    Session(name="boards in known places, and edges", boards=True, known=True, edges=True),
)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What one session gave.

    Attributes
    ----------
    session : Session
    pose_count : int
    after : Remaining
        Against the truth.
    gaze_expected_deg : float
        What the covariance says of the gaze: root mean square of its standard deviation over the joints' range.
    unobservable : tuple of str
    signs_right : bool
    """

    session: Session
    pose_count: int
    after: Remaining
    gaze_expected_deg: float
    unobservable: tuple[str, ...]
    signs_right: bool


@dataclass(frozen=True, kw_only=True)
class SessionStudy:
    """Result of `session_study`; `before` is the built rig against the rig as drawn."""

    before: Remaining
    outcomes: tuple[Outcome, ...]


def session_study(
    rig: Rig,
    *,
    seed: int,
    pose_counts: Sequence[int] = POSE_COUNTS,
    sessions: Sequence[Session] = SESSIONS,
    noise_px: float = NOISE_PX,
    play_deg: float = 0.0,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> SessionStudy:
    """Build a rig with errors of a print, hold sessions with it, and compare what they find with what is true.

    Parameters
    ----------
    rig : Rig
        With mirrors, as drawn.
    seed : int
        Of the errors, the noise and the play.
    pose_counts : sequence of int
    sessions : sequence of Session
    noise_px : float
        Standard deviation of every pixel in u and in v.
    play_deg : float
        Standard deviation of each joint about what it is told, anew in each pose.
    progress : callable
        Told how many sessions are done, and of how many.
    """
    errors = draw_errors(rig, PRINT_TOLERANCES, seed=seed)
    judged = joint_grid(rig, 5)
    # Each is chosen as far as possible from those before: the first few of many are the poses of a short session.
    poses = useful_poses(rig, max(pose_counts))
    outcomes: list[Outcome] = []
    for count in pose_counts:
        q = poses[:count]
        over_the_range = joint_grid(rig, max(2, round(np.sqrt(count))))
        for session in sessions:
            progress(len(outcomes), len(pose_counts) * len(sessions))
            target = edges = None
            if session.boards:
                target = simulated_target(
                    rig,
                    errors,
                    q,
                    known=session.known,
                    direct=session.direct,
                    noise_px=noise_px,
                    seed=seed,
                    true_q=_played(rig, q, play_deg, seed=seed),
                )
            if session.edges:
                true_q = _played(rig, over_the_range, play_deg, seed=seed + 1)
                edges = simulated_edges(rig, errors, over_the_range, noise_px=noise_px, seed=seed, true_q=true_q)
            found = calibrate(
                rig, target=target, edges=edges, noise_px=noise_px, edge_noise_px=noise_px, play_deg=play_deg
            )
            calibrated = found.calibrated
            expected = np.degrees(calibrated.gaze_deviation(judged))
            outcomes.append(
                Outcome(
                    session=session,
                    pose_count=count,
                    after=remaining(rig, errors, calibrated),
                    gaze_expected_deg=float(np.sqrt((expected**2).mean())),
                    unobservable=calibrated.knowledge.combinations(),
                    signs_right=calibrated.rig.joints == rig.joints,
                )
            )
    progress(len(outcomes), len(outcomes))
    return SessionStudy(before=remaining(rig, errors, rig), outcomes=tuple(outcomes))


def _played(rig: Rig, q: FloatArray, play_deg: float, *, seed: int) -> FloatArray:
    """Where joints really go that are told to go somewhere; within their limits."""
    assert rig.joints is not None
    rng = np.random.default_rng(seed)
    limits = np.radians([[joint.min_deg, joint.max_deg] for joint in (rig.joints.pan, rig.joints.tilt)])
    moved = q + np.radians(play_deg) * rng.standard_normal(q.shape)
    return np.asarray(np.clip(moved, limits[:, 0], limits[:, 1]))
