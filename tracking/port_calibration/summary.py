"""A calibration in plain numbers and sentences."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from tracking.port_calibration.covariance import per_si_of, unit_of
from tracking.port_calibration.estimate import PortCalibration


@dataclass(frozen=True, kw_only=True)
class EstimatedParameter:
    """A parameter with its standard deviation, in the unit in which it is shown."""

    name: str
    value: float
    standard_deviation: float
    unit: str


def parameters(found: PortCalibration) -> list[EstimatedParameter]:
    """What was estimated, in the order of the covariance."""
    values, deviations = estimated_values(found) | _pose_values(found), found.covariance.standard_deviations()
    return [
        EstimatedParameter(
            name=name,
            value=values[name] * per_si_of(name),
            standard_deviation=deviations[name] * per_si_of(name),
            unit=unit_of(name),
        )
        for name in found.covariance.names
    ]


def parameter_table(found: PortCalibration) -> list[list[str]]:
    """What was estimated, for people; the head first."""
    rows = ([each.name, f"{each.value:.6g}", f"{each.standard_deviation:.2g}", each.unit] for each in parameters(found))
    return [["parameter", "estimate", "std. dev.", ""], *rows]


def findings(found: PortCalibration) -> list[str]:
    """How well it fits, what the images do not determine, and whether it needs a port, in sentences."""
    lines = [
        f"residual: {found.rms_px:.3f} px rms, {found.median_px:.3f} px median, "
        f"{found.outlier_count} outliers of {len(found.off_px)} points in {len(found.observations.images)} images"
    ]
    if found.covariance.unobservable:
        lines.append("unobservable combinations, which stay where they were given:")
        lines += [f"  {combination}" for combination in found.covariance.unobservable]
    lines += found.warnings
    for pinhole in found.pinholes:
        verdict = "fits as well" if pinhole.fits_as_well else "fits worse"
        lines.append(
            f"{pinhole.camera}: a plain pinhole {verdict}: {pinhole.rms_px:.3f} px rms in water, "
            f"{pinhole.rms_with_port_px:.3f} px with the port"
        )
    if not found.converged:
        lines.append("the solver did not converge: these numbers are a start, not a result")
    return lines


def as_dict(found: PortCalibration) -> dict[str, Any]:
    """Everything that a calibration found, for JSON; lengths in millimetres, angles in degrees."""
    return {
        "parameters": [asdict(each) for each in parameters(found)],
        "covariance": _covariance(found),
        "unobservable": list(found.covariance.unobservable),
        "warnings": list(found.warnings),
        "rms_px": found.rms_px,
        "median_px": found.median_px,
        "noise_px": found.noise_px,
        "points": len(found.off_px),
        "images": len(found.observations.images),
        "outliers": found.outlier_count,
        "converged": found.converged,
        "cameras": {name: _camera(found, index) for index, name in enumerate(found.observations.cameras)},
        "pinholes": [
            {
                "camera": each.camera,
                "rms_px": each.rms_px,
                "rms_with_port_px": each.rms_with_port_px,
                "fits_as_well": each.fits_as_well,
            }
            for each in found.pinholes
        ],
    }


def estimated_values(found: PortCalibration) -> dict[str, float]:
    """Value of each parameter of the covariance that is not of a pose between cameras, SI."""
    values = {}
    for name in found.covariance.names:
        camera, _, parameter = name.rpartition(".")
        of = found.cameras[camera] if camera else found.arrangement.cameras[0]
        if parameter in of.values():
            values[name] = of.values()[parameter]
    return values


def _pose_values(found: PortCalibration) -> dict[str, float]:
    """Shift and turn (rotation vector) of each camera from the first one's frame."""
    values: dict[str, float] = {}
    for name, pose in zip(found.observations.cameras[1:], found.arrangement.camera_from_rig[1:], strict=True):
        numbers = np.concatenate([pose.translation, pose.rotation.as_rotvec()]).tolist()
        for kind, three in (("shift", numbers[:3]), ("turn", numbers[3:])):
            values |= {f"{name}.{kind}_{axis}": value for axis, value in zip("xyz", three, strict=True)}
    return values


def _covariance(found: PortCalibration) -> dict[str, Any]:
    factors = np.array([per_si_of(name) for name in found.covariance.names])
    return {
        "names": list(found.covariance.names),
        "matrix": (found.covariance.matrix * np.outer(factors, factors)).tolist(),
    }


def _camera(found: PortCalibration, index: int) -> dict[str, Any]:
    of, pose = found.arrangement.cameras[index], found.arrangement.camera_from_rig[index]
    return {
        "model": of.model,
        "width_px": of.camera.width_px,
        "height_px": of.camera.height_px,
        "port": of.shape,
        "parameters": {name: value * per_si_of(name) for name, value in of.values().items()},
        "camera_from_first_camera": pose.as_matrix().tolist(),
    }
