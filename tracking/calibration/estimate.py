"""From observations to a calibrated rig: signs by trial, perturbations by robust least squares, their covariance."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.perturbation.train import PerturbedTrain
from optics.tolerance.sources import Tolerances
from rigs import Rig
from tracking.calibration.board_start import board_poses
from tracking.calibration.calibrated_rig import CalibratedRig, with_signs
from tracking.calibration.covariance import covariance_of, residual_width, unobservable_directions
from tracking.calibration.fit import Evidence, Fit, Residuals, fit
from tracking.calibration.observations import TargetObservations, edge_problems, observation_problems
from tracking.calibration.prior import IN_PLANE, PRIOR_TOLERANCES, standard_deviations
from tracking.perception.corners.samples import CornerSamples

NOISE_PX = 0.3
"""Standard deviation of a corner found to a fraction of a pixel, unless said otherwise."""

LARGEST_EVALUATIONS = 100

TRIAL_EVALUATIONS = 10
"""For signs that are only tried."""

DECIDED = 25.0
"""Difference of chi-square above which signs count as decided: e^(-25 / 2) to one against the others."""


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One guess of the joints' signs and the cost at which it explains the observations."""

    pan_sign: int
    tilt_sign: int
    cost: float


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Result of `calibrate`.

    Attributes
    ----------
    calibrated : CalibratedRig
    trials : tuple of Trial
        All guesses of the signs, the best first.
    signs_decided : bool
        Whether the best is better than the others beyond doubt; if not, the rig file's were kept.
    residual_px : float
        Root mean square of what is left, in u and in v, over all observations that the rig shows.
    residual_width : float
        Typical size of what is left over the noise that was given, 1 unless it is larger by more than chance: the
        covariance is widened by its square.
    converged : bool
        Whether the solver came to rest.
    outlier_count, missing_count : int
        Coordinates beyond 5 standard deviations of what is left, and coordinates that the rig does not show at all.
    """

    calibrated: CalibratedRig
    trials: tuple[Trial, ...]
    signs_decided: bool
    residual_px: float
    residual_width: float
    converged: bool
    outlier_count: int
    missing_count: int


def calibrate(
    rig: Rig,
    *,
    target: TargetObservations | None = None,
    edges: CornerSamples | None = None,
    tolerances: Tolerances = PRIOR_TOLERANCES,
    prior: bool = True,
    noise_px: float = NOISE_PX,
    edge_noise_px: float = NOISE_PX,
    backlash_deg: float = 0.0,
) -> Estimate:
    """Estimate the perturbations of a built rig.

    Parameters
    ----------
    rig : Rig
        The nominal one.
    target : TargetObservations, optional
    edges : CornerSamples, optional
        One of both at least.
    tolerances : Tolerances
        How far each parameter may be off. What has a tolerance of 0 is not estimated.
    prior : bool
        Whether the tolerances are a prior: the estimate is then the maximum a posteriori under normal perturbations of
        these standard deviations. Otherwise only the unobservable combinations are regularised by them, which are
        reported with an infinite standard deviation.
    noise_px, edge_noise_px : float
        Standard deviations of the observed pixels of target and corners.
    backlash_deg : float
        Standard deviation of each joint about its commanded value, different in each pose.

    Raises
    ------
    ValueError
        With everything that keeps the observations from being used.
    """
    evidence = Evidence(
        target=target,
        edges=edges,
        noise_px=noise_px,
        edge_noise_px=edge_noise_px,
        backlash=float(np.radians(backlash_deg)),
    )
    _check(rig, evidence, backlash_deg)
    gaze = rig.require_gaze()
    in_plane = edges is not None
    scales = {
        name: sigma
        for name, sigma in standard_deviations(rig, tolerances).items()
        if sigma > 0 and (in_plane or name not in IN_PLANE)
    }
    fits = {
        signs: _fitted(with_signs(rig, *signs), evidence, scales, TRIAL_EVALUATIONS)
        for signs in product((1, -1), repeat=2)
    }
    ordered = sorted(fits, key=lambda signs: fits[signs].cost)
    trials = tuple(Trial(pan_sign=pan, tilt_sign=tilt, cost=fits[pan, tilt].cost) for pan, tilt in ordered)
    best, second = trials[:2]
    decided = second.cost - best.cost > DECIDED
    nominal = (gaze.joints.pan.sign, gaze.joints.tilt.sign)
    signs = (best.pan_sign, best.tilt_sign) if decided else nominal
    signed = with_signs(rig, *signs)
    found = _fitted(signed, evidence, scales, LARGEST_EVALUATIONS, start=fits[signs].unknowns)
    if not prior:
        found = _fitted(
            signed,
            evidence,
            scales,
            LARGEST_EVALUATIONS,
            regularised=unobservable_directions(found),
            start=found.unknowns,
        )
    seen = found.residuals[np.isfinite(found.residuals)]
    width = residual_width(found.residuals)
    return Estimate(
        calibrated=CalibratedRig(
            rig=signed,
            perturbations=found.perturbations,
            covariance=covariance_of(found, scales, prior=prior),
        ),
        trials=trials,
        signs_decided=decided,
        residual_px=_rms_px(found, evidence),
        residual_width=width,
        converged=found.converged,
        outlier_count=int((np.abs(seen) > 5 * width).sum()),
        missing_count=int((~np.isfinite(found.residuals)).sum()),
    )


def _fitted(
    rig: Rig,
    evidence: Evidence,
    scales: dict[str, float],
    evaluations: int,
    *,
    regularised: FloatArray | None = None,
    start: FloatArray | None = None,
) -> Fit:
    train = PerturbedTrain(rig)
    boards = board_poses(train, evidence.target) if evidence.target is not None else []
    residuals = Residuals(train, evidence, scales, boards)
    return fit(residuals, largest_evaluations=evaluations, regularised=regularised, start=start)


def _rms_px(found: Fit, evidence: Evidence) -> float:
    of_target = 0 if evidence.target is None else 2 * len(evidence.target.q)
    pixels = found.residuals * np.where(
        np.arange(len(found.residuals)) < of_target, evidence.noise_px, evidence.edge_noise_px
    )
    return float(np.sqrt(np.nanmean(pixels**2)))


def _check(rig: Rig, evidence: Evidence, backlash_deg: float) -> None:
    rig.require_gaze()
    problems = [
        f"expected {name} > 0, got {value}"
        for name, value in (("noise_px", evidence.noise_px), ("edge_noise_px", evidence.edge_noise_px))
        if not (np.isfinite(value) and value > 0)
    ]
    if not (np.isfinite(backlash_deg) and backlash_deg >= 0):
        problems.append(f"expected backlash_deg >= 0, got {backlash_deg}")
    target, edges = evidence.target, evidence.edges
    if target is None and edges is None:
        problems.append("expected observations of a target, corner samples, or both, got neither")
    problems += [] if target is None else observation_problems(rig, target)
    problems += [] if edges is None else edge_problems(rig, edges)
    if problems:
        raise ValueError("; ".join(problems))
