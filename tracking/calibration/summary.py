"""A calibration in numbers: what was estimated, how well, and what the images left open."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from optics.layout import Layout
from optics.perturbation.parameters import shown_per_si, shown_unit
from tracking.calibration.calibrated_rig import CalibratedRig
from tracking.calibration.estimate import Estimate

GAZE_STEPS = 5
"""Joint values of each joint over which the gaze's deviation is averaged."""


@dataclass(frozen=True, kw_only=True)
class EstimatedParameter:
    """A perturbation of the rig in its own unit; `tolerance` is the standard deviation of its prior."""

    parameter: str
    unit: str
    value: float
    standard_deviation: float
    standard_deviation_from_data: float
    tolerance: float


@dataclass(frozen=True, kw_only=True)
class CalibrationSummary:
    """Numbers of a calibration.

    Attributes
    ----------
    rig : str
    prior : bool
        Whether tolerances were used as a prior.
    pan_sign, tilt_sign : int
    signs_decided : bool
        Whether the images decide them; else they are the rig file's.
    sign_costs : list
        Pan sign, tilt sign and cost of each combination.
    perturbations : list of EstimatedParameter
    unobservable : list of str
        Combinations of parameters that the images tell nothing of.
    residual_px : float
        Root mean square.
    residual_width : float
        Of the residuals, by the noise that was given.
    converged : bool
    outliers, missing : int
    gaze_deviation_deg : float
        Root mean square over the joints' range of the gaze's standard deviation.
    pan_offset_deg, tilt_offset_deg : float
        Of the nearest rig file.
    """

    rig: str
    prior: bool
    pan_sign: int
    tilt_sign: int
    signs_decided: bool
    sign_costs: list[list[float]]
    perturbations: list[EstimatedParameter]
    unobservable: list[str]
    residual_px: float
    residual_width: float
    converged: bool
    outliers: int
    missing: int
    gaze_deviation_deg: float
    pan_offset_deg: float
    tilt_offset_deg: float

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return asdict(self)

    @property
    def signs(self) -> str:
        """Signs of the joints, in words."""
        doubt = "" if self.signs_decided else " (unobservable; as in the rig file)"
        return f"signs: pan {self.pan_sign:+d}, tilt {self.tilt_sign:+d}{doubt}"

    def table(self) -> list[list[str]]:
        """What was estimated, for people; the head first."""
        rows = [["parameter", "estimate", "std. dev.", "from the images alone", "tolerance", ""]]
        for row in self.perturbations:
            numbers = (row.value, row.standard_deviation, row.standard_deviation_from_data, row.tolerance)
            digits = 5 if row.unit == "" else 3
            rows.append([row.parameter, *(f"{number:.{digits}f}" for number in numbers), row.unit])
        return rows

    def findings(self) -> list[str]:
        """What the images do not determine, how well the rest fits, and what a rig file can say of it, in sentences."""
        lines = []
        if self.unobservable:
            kept = "keep their prior" if self.prior else "are unknown"
            lines = [f"unobservable combinations, which {kept}:", *(f"  {each}" for each in self.unobservable)]
        lines.append(f"residual: {self.residual_px:.2f} px rms, {self.outliers} outliers, {self.missing} missing")
        if self.residual_width > 1:
            lines.append(
                f"that is {self.residual_width:.2f} times the noise given; all standard deviations are scaled by it"
            )
        if not self.converged:
            lines.append("the solver did not converge: these numbers are a start, not a result")
        return [
            *lines,
            f"gaze: standard deviation {self.gaze_deviation_deg:.3f} deg over the joints' range",
            f"nearest rig file: joints.pan.offset_deg = {self.pan_offset_deg:.3f}, "
            f"joints.tilt.offset_deg = {self.tilt_offset_deg:.3f}",
        ]


def calibration_summary(found: Estimate) -> CalibrationSummary:
    """Numbers of a calibration."""
    calibrated = found.calibrated
    joints = calibrated.rig.require_gaze().joints
    corrected = calibrated.with_joint_offsets().require_gaze().joints
    return CalibrationSummary(
        rig=calibrated.rig.name,
        prior=calibrated.covariance.has_prior,
        pan_sign=joints.pan.sign,
        tilt_sign=joints.tilt.sign,
        signs_decided=found.signs_decided,
        sign_costs=[[trial.pan_sign, trial.tilt_sign, trial.cost] for trial in found.trials],
        perturbations=_parameters(calibrated),
        unobservable=list(calibrated.covariance.combinations()),
        residual_px=found.residual_px,
        residual_width=found.residual_width,
        converged=found.converged,
        outliers=found.outlier_count,
        missing=found.missing_count,
        gaze_deviation_deg=_gaze_deviation_deg(calibrated),
        pan_offset_deg=corrected.pan.offset_deg,
        tilt_offset_deg=corrected.tilt.offset_deg,
    )


def _parameters(calibrated: CalibratedRig) -> list[EstimatedParameter]:
    covariance = calibrated.covariance
    deviations = covariance.standard_deviations()
    rows = []
    for index, name in enumerate(covariance.names):
        factor = shown_per_si(name)
        rows.append(
            EstimatedParameter(
                parameter=name,
                unit=shown_unit(name),
                value=calibrated.perturbations[name] * factor,
                standard_deviation=float(deviations[index]) * factor,
                standard_deviation_from_data=float(covariance.data_deviations[index]) * factor,
                tolerance=float(covariance.scales[index]) * factor,
            )
        )
    return rows


def _gaze_deviation_deg(calibrated: CalibratedRig) -> float:
    deviation = calibrated.gaze_deviation(Layout.from_rig(calibrated.rig).joint_grid(GAZE_STEPS))
    return float(np.degrees(np.sqrt((deviation**2).mean())))
