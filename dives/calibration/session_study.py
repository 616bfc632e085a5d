"""What calibration sessions of different kinds and lengths would give for a rig: which one to hold, and how long."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby, product
from statistics import median

import numpy as np

from dives.calibration.simulation import JUDGED, Remaining, remaining, simulated_edges, simulated_target, useful_poses
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from rigs import Rig
from tracking.calibration.estimate import NOISE_PX, calibrate
from tracking.calibration.observations import corners_problem
from tracking.calibration.prior import PRINT_TOLERANCES, draw_perturbations

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
    """What one session with one rig gave.

    Attributes
    ----------
    seed : int
        Of the rig.
    session : Session
    pose_count : int
    after : Remaining
        Against the truth.
    gaze_expected_deg : float
        What the covariance says of the gaze: root mean square of its standard deviation over the joints' range.
    unobservable : tuple of str
    signs_right : bool
    """

    seed: int
    session: Session
    pose_count: int
    after: Remaining
    gaze_expected_deg: float
    unobservable: tuple[str, ...]
    signs_right: bool


@dataclass(frozen=True, kw_only=True)
class SessionStudy:
    """Result of `session_study`.

    Attributes
    ----------
    before : tuple of Remaining
        Each built rig against the nominal one.
    outcomes : tuple of Outcome
        Every session of a length with every rig before the next session.
    """

    before: tuple[Remaining, ...]
    outcomes: tuple[Outcome, ...]

    def table(self) -> list[tuple[str, ...]]:
        """Median and worst rig of each session and length, the nominal rig first, below the head."""
        head = ("session", "poses", "gaze (deg)", "worst rig", "worst pose", "expected", "image (px)", "worst rig")
        rows = [(*head, "corners (px)", "worst rig"), _row("nominal rig, before", "-", self.before, "-")]
        for (name, count), group in groupby(self.outcomes, key=lambda each: (each.session.name, each.pose_count)):
            outcomes = list(group)
            expected = f"{median(outcome.gaze_expected_deg for outcome in outcomes):.3f}"
            rows.append(_row(name, str(count), [outcome.after for outcome in outcomes], expected))
        return rows


def _row(name: str, poses: str, rigs: Sequence[Remaining], expected: str) -> tuple[str, ...]:
    gaze, image, corners = ([getattr(each, key) for each in rigs] for key in ("gaze_deg", "image_px", "corners_px"))
    worst_pose = f"{max(each.gaze_worst_deg for each in rigs):.3f}"
    of_gaze = (f"{median(gaze):.3f}", f"{max(gaze):.3f}", worst_pose, expected)
    in_pixels = (f"{value:.2f}" for values in (image, corners) for value in (median(values), max(values)))
    return (name, poses, *of_gaze, *in_pixels)


def session_study(
    rig: Rig,
    *,
    seeds: Sequence[int],
    pose_counts: Sequence[int] = POSE_COUNTS,
    sessions: Sequence[Session] = SESSIONS,
    noise_px: float = NOISE_PX,
    backlash_deg: float = 0.0,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> SessionStudy:
    """Build rigs with perturbations of a print, hold sessions with each, and compare what they find with what is true.

    Parameters
    ----------
    rig : Rig
        With mirrors, nominal.
    seeds : sequence of int
        One for each rig: of its perturbations, the noise and the backlash.
    pose_counts : sequence of int
    sessions : sequence of Session
    noise_px : float
        Standard deviation of every pixel in u and in v.
    backlash_deg : float
        Standard deviation of each joint about its commanded value, different in each pose.
    progress : callable
        Called with how many sessions are done, and of how many.
    """
    # Each is chosen as far as possible from those before: the first few of many are the poses of a short session.
    poses = useful_poses(rig, max(pose_counts))
    # Corners that a mirror does not have are not found.
    held = [session for session in sessions if not (session.edges and corners_problem(rig))]
    runs = list(product(pose_counts, held, seeds))
    outcomes: list[Outcome] = []
    for count, session, seed in runs:
        progress(len(outcomes), len(runs))
        outcomes.append(_outcome(rig, session, poses[:count], seed=seed, noise_px=noise_px, backlash_deg=backlash_deg))
    progress(len(outcomes), len(runs))
    built = [draw_perturbations(rig, PRINT_TOLERANCES, seed=seed) for seed in seeds]
    return SessionStudy(
        before=tuple(remaining(rig, perturbations, rig) for perturbations in built), outcomes=tuple(outcomes)
    )


def _outcome(rig: Rig, session: Session, q: FloatArray, *, seed: int, noise_px: float, backlash_deg: float) -> Outcome:
    perturbations = draw_perturbations(rig, PRINT_TOLERANCES, seed=seed)
    # Seeds of their own: the same draws would make the noise know the perturbations.
    of_target, of_edges, of_backlash, of_edge_backlash = np.random.SeedSequence(seed).generate_state(4).tolist()
    target = edges = None
    if session.boards:
        target = simulated_target(
            rig,
            perturbations,
            q,
            known=session.known,
            direct=session.direct,
            noise_px=noise_px,
            seed=of_target,
            true_q=_with_backlash(rig, q, backlash_deg, seed=of_backlash),
        )
    if session.edges:
        over_the_range = Layout.from_rig(rig).joint_grid(max(2, round(np.sqrt(len(q)))))
        true_q = _with_backlash(rig, over_the_range, backlash_deg, seed=of_edge_backlash)
        edges = simulated_edges(rig, perturbations, over_the_range, noise_px=noise_px, seed=of_edges, true_q=true_q)
    found = calibrate(
        rig, target=target, edges=edges, noise_px=noise_px, edge_noise_px=noise_px, backlash_deg=backlash_deg
    )
    calibrated = found.calibrated
    expected = np.degrees(calibrated.gaze_deviation(Layout.from_rig(rig).joint_grid(JUDGED)))
    return Outcome(
        seed=seed,
        session=session,
        pose_count=len(q),
        after=remaining(rig, perturbations, calibrated),
        gaze_expected_deg=float(np.sqrt((expected**2).mean())),
        unobservable=calibrated.covariance.combinations(),
        signs_right=calibrated.rig.require_gaze().joints == rig.require_gaze().joints,
    )


def _with_backlash(rig: Rig, q: FloatArray, backlash_deg: float, *, seed: int) -> FloatArray:
    """Where joints really go that are commanded to go somewhere; within their limits."""
    gaze = rig.require_gaze()
    rng = np.random.default_rng(seed)
    limits = np.radians([[joint.min_deg, joint.max_deg] for joint in (gaze.joints.pan, gaze.joints.tilt)])
    moved = q + np.radians(backlash_deg) * rng.standard_normal(q.shape)
    return np.asarray(np.clip(moved, limits[:, 0], limits[:, 1]))
