"""A calibrated rig: the rig file with estimated perturbations, their covariance, and what follows for the loop."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
import tomlkit
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray
from optics.perturbation.derivatives import gaze_jacobian
from optics.perturbation.parameters import JOINT_OFFSETS, check_perturbations, shown_per_si, shown_unit
from optics.perturbation.train import PerturbedTrain
from optics.train import OpticalTrain
from rigs import Joint, Rig
from rigs.atomic_files import write_text
from rigs.documents.toml import TomlError, parsed
from tracking.calibration.covariance import PerturbationCovariance
from tracking.perception.corners.exact import crop_outline_m
from tracking.perception.crop import runs_clockwise

GRID = 9
"""Joint values a joint at which the offsets of `with_joint_offsets` are fitted."""

ITERATIONS = 6
"""Gauss-Newton steps of that fit: each shrinks what is missing by the error in radians."""

VERSION = 2


@dataclass(frozen=True, kw_only=True)
class CalibratedRig:
    """A rig and its estimated perturbations.

    Attributes
    ----------
    rig : Rig
        The nominal one, but with the joints' signs as they were found.
    perturbations : dict of str to float
        Metres, radians, units of index (`optics.perturbation.parameters`); what is not named is nominal.
    covariance : PerturbationCovariance
        How well they are known.
    """

    rig: Rig
    perturbations: dict[str, float]
    covariance: PerturbationCovariance

    def __post_init__(self) -> None:
        check_perturbations(self.rig, self.perturbations)

    @cached_property
    def perturbed_train(self) -> PerturbedTrain:
        """The rig, to be evaluated with its perturbations."""
        return PerturbedTrain(self.rig)

    def train(self, q1: float, q2: float) -> OpticalTrain:
        """Exact train of the built rig: to trace pixels into the water and to project points; radians."""
        (train,) = self.perturbed_train.optical_trains([(q1, q2)], self.perturbations)
        return train

    def corners(self, q: ArrayLike) -> FloatArray:
        """Pixels of M2's corners, shape (..., 4, 2), in the crop's order for joint values of shape (..., 2), radians.

        All four are nan where the camera does not see M2's face: as `tracking.perception.ExactCorners`.
        """
        q = np.asarray(q, dtype=np.float64)
        outline = crop_outline_m(self.rig)
        pixels = self.perturbed_train.project_face(outline, q.reshape(-1, 2), self.perturbations)
        pixels = pixels.reshape(*q.shape[:-1], 4, 2)
        return np.where(runs_clockwise(pixels)[..., np.newaxis, np.newaxis], pixels, np.nan)

    def gaze(self, q: ArrayLike) -> FloatArray:
        """Unit vectors of the principal ray behind M2 in the body frame, shape (n, 3), for joint values (n, 2)."""
        return self.perturbed_train.gaze(q, self.perturbations)

    def gaze_deviation(self, q: ArrayLike) -> FloatArray:
        """Standard deviation of the gaze, radians, shape (n,): root of the mean squared angle to the true one."""
        names = self.covariance.names
        jacobian = gaze_jacobian(self.perturbed_train, q, self.perturbations, parameters=names)
        return np.asarray(np.linalg.norm(self.covariance.standard_deviations_of(jacobian.values), axis=1))

    def with_joint_offsets(self) -> Rig:
        """Rig file with the signs found and the joint offsets under which it looks most nearly as the built one.

        For who can use only a rig file: leaning axes and mirrors turned aside cannot be said there.
        """
        q = self.perturbed_train.layout.joint_grid(GRID)
        wanted, offsets = self.gaze(q), np.zeros(2)
        for _ in range(ITERATIONS):
            perturbations = dict(zip(JOINT_OFFSETS, offsets.tolist(), strict=True))
            found = gaze_jacobian(self.perturbed_train, q, perturbations, parameters=JOINT_OFFSETS)
            missing = (wanted - found.outputs).ravel()
            offsets = offsets + np.linalg.lstsq(found.values.reshape(-1, 2), missing)[0]
        gaze = self.rig.require_gaze()
        # A fold up stands on its head: its optical angles are the negatives of the file's.
        sense = -1.0 if gaze.fold_mirror.direction == "up" else 1.0
        pan, tilt = (
            joint.model_copy(update={"offset_deg": joint.offset_deg + sense * float(np.degrees(offset))})
            for joint, offset in zip((gaze.joints.pan, gaze.joints.tilt), offsets, strict=True)
        )
        return with_joints(self.rig, pan, tilt)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a calibration file (TOML) beside a rig file; it appears whole or not at all."""
        path, covariance = Path(path), self.covariance
        gaze = self.rig.require_gaze()
        document = tomlkit.document()
        about = "Perturbations of a built rig, estimated by mirrorgaze calibrate: docs/explanation/calibration.md."
        document.add(tomlkit.comment(about))
        document.add("version", tomlkit.item(VERSION))
        document.add("rig", tomlkit.item(self.rig.name))
        document.add("pan_sign", tomlkit.item(gaze.joints.pan.sign))
        document.add("tilt_sign", tomlkit.item(gaze.joints.tilt.sign))
        document.add("has_prior", tomlkit.item(covariance.has_prior))
        tables = {
            "perturbations": [self.perturbations.get(name, 0.0) for name in covariance.names],
            "standard_deviations": covariance.standard_deviations().tolist(),
            "data_standard_deviations": covariance.data_deviations.tolist(),
            "tolerances": covariance.scales.tolist(),
        }
        for title, values in tables.items():
            table = tomlkit.table()
            for name, value in zip(covariance.names, values, strict=True):
                table.add(_key(name), value * shown_per_si(name))
            document.add(title, table)
        scales = np.outer(covariance.scales, covariance.scales)
        document.add("covariance", _rows(covariance.matrix / scales))
        document.add("unobservable", _rows(covariance.unobservable))
        write_text(path, tomlkit.dumps(document))

    @classmethod
    def load(cls, path: str | os.PathLike[str], rig: Rig) -> Self:
        """Read the calibration file of a rig.

        Raises
        ------
        ValueError
            For a file that is none, or that is another rig's.
        """
        path = Path(path)
        try:
            document = parsed(path.read_text(encoding="utf-8"))
        except (TomlError, UnicodeDecodeError) as error:
            raise ValueError(f"{path}: expected a calibration file (TOML), got {error}") from None
        if document.get("version") != VERSION:
            raise ValueError(f"{path}: expected a calibration file of version {VERSION}, got {document.get('version')}")
        if document.get("rig") != rig.name:
            raise ValueError(
                f"{path}: expected the calibration of rig {rig.name!r}, got that of {document.get('rig')!r}"
            )
        try:
            return cls._parsed(document, rig)
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f"{path}: expected a calibration as mirrorgaze calibrate writes it, got {error}") from None

    @classmethod
    def _parsed(cls, document: dict[str, Any], rig: Rig) -> Self:
        keys = list(document["perturbations"])
        names = tuple(key.removesuffix("_mm").removesuffix("_deg") for key in keys)
        factors = np.array([shown_per_si(name) for name in names])

        def values(title: str) -> FloatArray:
            return np.asarray(np.array([document[title][key] for key in keys], dtype=np.float64) / factors)

        scales = values("tolerances")
        return cls(
            rig=with_signs(rig, document["pan_sign"], document["tilt_sign"]),
            perturbations=dict(zip(names, values("perturbations").tolist(), strict=True)),
            covariance=PerturbationCovariance(
                names=names,
                scales=scales,
                matrix=np.array(document["covariance"]) * np.outer(scales, scales),
                unobservable=np.array(document["unobservable"]).reshape(-1, len(names)),
                data_deviations=values("data_standard_deviations"),
                has_prior=bool(document["has_prior"]),
            ),
        )


def with_signs(rig: Rig, pan_sign: int, tilt_sign: int) -> Rig:
    """The rig with other signs of its joints."""
    gaze = rig.require_gaze()
    pan, tilt = (
        joint.model_copy(update={"sign": sign})
        for joint, sign in ((gaze.joints.pan, pan_sign), (gaze.joints.tilt, tilt_sign))
    )
    return with_joints(rig, pan, tilt)


def with_joints(rig: Rig, pan: Joint, tilt: Joint) -> Rig:
    """The rig with other joints."""
    return rig.with_gaze(joints={"pan": pan, "tilt": tilt})


def _key(name: str) -> str:
    return f"{name}_{shown_unit(name)}".rstrip("_")


def _rows(matrix: FloatArray) -> Any:
    rows = tomlkit.array()
    for row in matrix.tolist():
        rows.add_line(row)
    if len(matrix):
        rows.add_line(indent="")
    return rows
