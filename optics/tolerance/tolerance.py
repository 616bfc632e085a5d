"""Tolerances: how far the gaze and the image of a built rig are off, what matters, and what calibration takes away.

Monte Carlo over built rigs and poses, one lane each, and first-order sensitivities beside it. Perturbations of the
construction stay the same in all poses of a rig; what a servo does differently each time is drawn again in each pose.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from optics.coverage.usable_fov import joint_values
from optics.kernels.arrays import FloatArray
from optics.perturbation.derivatives import gaze_jacobian, projection_jacobian
from optics.perturbation.train import PerturbedTrain
from optics.tolerance.after_calibration import calibrated_offsets, in_all_poses
from optics.tolerance.sources import Source, Tolerances, combined, draw_all, error_sources
from rigs import Rig

POSE_SHARES = (1 / 6, 1 / 2, 5 / 6)
"""Where in each joint's range the representative poses stand: the middles of its thirds."""

TARGET_ASIDE = 1 / 8
"""How far from the principal point the target is seen, as a share of the image's width and height: off the axis, where
the port and the water's index move it, and still within M2."""

PERCENTILES = (50, 90, 95, 99)


@dataclass(frozen=True, kw_only=True)
class Errors:
    """How far each built rig (rows) is off in each pose (columns).

    Attributes
    ----------
    gaze_deg : array, shape (samples, poses)
        Angle between the true and the expected direction of the principal ray behind M2.
    image_px : array, shape (samples, poses)
        Distance between where the target appears and where it is expected.
    """

    gaze_deg: FloatArray
    image_px: FloatArray

    def percentiles(self) -> dict[str, FloatArray]:
        """`PERCENTILES` of both errors over all rigs and poses."""
        return {
            "gaze_deg": np.percentile(self.gaze_deg, PERCENTILES),
            "image_px": np.percentile(self.image_px, PERCENTILES),
        }


@dataclass(frozen=True, kw_only=True)
class Contribution:
    """What one tolerance adds to the mean squared error; shares of the total, in both ways of computing them.

    Attributes
    ----------
    source : Source
    gaze_rms_deg, image_rms_px : float
        First order, over all poses: the error that this tolerance causes alone.
    gaze_share, image_share : float
        Of the first-order mean squared error; all tolerances together make 1.
    gaze_share_frozen, image_share_frozen : float
        By how much less the Monte Carlo's mean squared error is when this tolerance alone is taken out.
    """

    source: Source
    gaze_rms_deg: float
    image_rms_px: float
    gaze_share: float
    image_share: float
    gaze_share_frozen: float
    image_share_frozen: float


@dataclass(frozen=True, kw_only=True)
class ToleranceStudy:
    """Result of `tolerance_study`.

    Attributes
    ----------
    q_deg : array, shape (poses, 2)
        Joint values.
    built : Errors
        Against the nominal rig.
    calibrated : Errors
        Against the nominal rig with its two joint offsets fitted to each built rig.
    offsets_deg : array, shape (samples, 2)
        The fitted offsets of pan and tilt.
    ranking : tuple of Contribution
        By share of the gaze error, the largest first.
    """

    q_deg: FloatArray
    built: Errors
    calibrated: Errors
    offsets_deg: FloatArray
    ranking: tuple[Contribution, ...]


def representative_poses(rig: Rig) -> FloatArray:
    """Nine poses (q1, q2), radians, shape (9, 2): the middles of the thirds of both joint ranges."""
    gaze = rig.require_gaze()
    q1, q2 = (
        np.radians(joint.min_deg + np.array(POSE_SHARES) * (joint.max_deg - joint.min_deg))
        for joint in (gaze.joints.pan, gaze.joints.tilt)
    )
    return np.stack(np.meshgrid(q1, q2), axis=-1).reshape(-1, 2)


def tolerance_study(
    rig: Rig,
    tolerances: Tolerances | None = None,
    *,
    samples: int = 10_000,
    seed: int = 0,
    poses: ArrayLike | None = None,
    target_m: float = 3.0,
) -> ToleranceStudy:
    """Monte Carlo and first-order analysis of a rig's tolerances.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    tolerances : Tolerances, optional
        The nominal ones by default.
    samples : int
        Rigs that are built.
    seed : int
        The same seed gives the same numbers.
    poses : array, shape (k, 2), optional
        Joint values (q1, q2), radians; `representative_poses` by default.
    target_m : float
        Distance of each pose's target from M2, on the ray of a pixel `TARGET_ASIDE` of the principal point.

    Raises
    ------
    ValueError
        For a rig without mirrors, joint values beyond their limits, no samples, or tolerances so large that a built
        rig does not see its target at all.
    """
    if samples < 1 or seed < 0:
        raise ValueError(f"expected samples > 0 and seed >= 0, got {samples} and {seed}")
    if not (np.isfinite(target_m) and target_m > 0):
        raise ValueError(f"expected target_m > 0, got {target_m}")
    q = representative_poses(rig) if poses is None else np.asarray(poses, dtype=np.float64)
    if q.ndim != 2 or q.shape[1] != 2:
        raise ValueError(f"expected poses of shape (k, 2), got {q.shape}")
    joint_values(rig, q1=q[:, 0], q2=q[:, 1])
    sources = error_sources(rig, tolerances or Tolerances())
    bench = _Bench.of(rig, q, target_m, sorted({name for source in sources for name in source.sizes}))
    draws = draw_all(sources, seed=seed, samples=samples, poses=len(q))
    built, nominal = bench.observe(combined(draws.values()), samples), bench.observe({}, 1)
    offsets = calibrated_offsets(bench.train, q, built[0])
    # The calibration saw the poses once; it is judged by moving the same rigs there again.
    again = draw_all(sources, seed=seed, samples=samples, poses=len(q), repetition=1)
    return ToleranceStudy(
        q_deg=np.degrees(q),
        built=_errors(built, nominal),
        calibrated=_errors(
            bench.observe(combined(again.values()), samples), bench.observe(in_all_poses(offsets), samples)
        ),
        offsets_deg=np.degrees(offsets),
        ranking=_ranking(bench, sources, draws, samples),
    )


Views = tuple[FloatArray, FloatArray]
"""Gaze directions, shape (n, k, 3), and images of the targets, shape (n, k, 2), of n built rigs in k poses."""


@dataclass(frozen=True, kw_only=True)
class _Bench:
    """A rig in its poses, and a target for each pose (camera frame)."""

    train: PerturbedTrain
    q: FloatArray
    targets_m: FloatArray
    parameters: Sequence[str]

    @classmethod
    def of(cls, rig: Rig, q: FloatArray, target_m: float, parameters: Sequence[str]) -> _Bench:
        train = PerturbedTrain(rig)
        camera = train.camera
        aside = (camera.cx_px + TARGET_ASIDE * camera.width_px, camera.cy_px + TARGET_ASIDE * camera.height_px)
        origin, direction = train.trace(q, pixels=aside)
        return cls(train=train, q=q, targets_m=origin + target_m * direction, parameters=parameters)

    def observe(self, perturbations: Mapping[str, FloatArray], count: int) -> Views:
        """What `count` built rigs show."""
        q = np.broadcast_to(self.q, (count, *self.q.shape))
        # Zero, not left out: a kernel would be compiled for every set of names.
        whole = {**dict.fromkeys(self.parameters, np.zeros((1, 1))), **perturbations}
        directions = self.train.gaze(q, whole)
        pixels = self.train.project(self.targets_m, q, whole)
        lost = int((~np.isfinite(pixels).all(axis=-1)).sum())
        if lost:
            raise ValueError(
                f"expected tolerances under which every built rig has an image of its target, "
                f"got {lost} of {pixels[..., 0].size} without: make them smaller"
            )
        return directions, pixels

    def jacobians(self) -> tuple[FloatArray, FloatArray]:
        """Derivatives of the gaze, shape (poses, 3, parameters), and the image, px, (poses, 2, parameters)."""
        of_gaze = gaze_jacobian(self.train, self.q, parameters=self.parameters)
        of_image = projection_jacobian(self.train, self.targets_m, self.q, parameters=self.parameters)
        return of_gaze.values, of_image.values


def _errors(seen: Views, expected: Views) -> Errors:
    # The arc sine of half the chord keeps small angles, which the arc cosine of a product would lose.
    chord = np.linalg.norm(seen[0] - expected[0], axis=-1)
    return Errors(
        gaze_deg=np.degrees(2 * np.arcsin(np.minimum(chord / 2, 1))),
        image_px=np.linalg.norm(seen[1] - expected[1], axis=-1),
    )


def _ranking(
    bench: _Bench, sources: Sequence[Source], draws: Mapping[str, dict[str, FloatArray]], samples: int
) -> tuple[Contribution, ...]:
    if not sources:
        return ()
    # By parameter: mean squares of the derivatives of gaze (radians) and image (px) over the poses.
    squares = [(jacobian**2).sum(axis=1).mean(axis=0) for jacobian in bench.jacobians()]
    variances = np.array(
        [
            [source.standard_deviation(name) ** 2 if name in source.sizes else 0.0 for name in bench.parameters]
            for source in sources
        ]
    )
    first_order = variances @ np.transpose(squares)
    expected = bench.observe({}, 1)
    everything = _mean_squares(bench, draws.values(), expected, samples)
    contributions = []
    for source, square in zip(sources, first_order, strict=True):
        others = [draw for name, draw in draws.items() if name != source.name]
        frozen = _share(everything - _mean_squares(bench, others, expected, samples), everything)
        share = _share(square, first_order.sum(axis=0))
        contributions.append(
            Contribution(
                source=source,
                gaze_rms_deg=float(np.degrees(np.sqrt(square[0]))),
                image_rms_px=float(np.sqrt(square[1])),
                gaze_share=float(share[0]),
                image_share=float(share[1]),
                gaze_share_frozen=float(frozen[0]),
                image_share_frozen=float(frozen[1]),
            )
        )
    return tuple(sorted(contributions, key=lambda contribution: (-contribution.gaze_share, contribution.source.name)))


def _share(part: FloatArray, whole: FloatArray) -> FloatArray:
    """Quotient, and nothing of nothing: shifted mirrors alone leave the gaze where it was."""
    return np.divide(part, whole, out=np.zeros_like(part), where=whole > 0)


def _mean_squares(
    bench: _Bench, draws: Iterable[Mapping[str, FloatArray]], expected: Views, samples: int
) -> FloatArray:
    """Mean squared error of gaze (radians) and image (px) over all rigs and poses."""
    seen = bench.observe(combined(draws), samples)
    return np.array([((now - then) ** 2).sum(axis=-1).mean() for now, then in zip(seen, expected, strict=True)])
