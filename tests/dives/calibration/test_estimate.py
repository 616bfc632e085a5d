"""Calibration brings the error of a printed rig down, with an honest covariance, and names what is unobservable."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from dives.calibration.simulation import remaining, simulated_edges, simulated_target, useful_poses
from optics.layout import Layout
from optics.perturbation.train import PerturbedTrain
from optics.tolerance.sources import NO_TOLERANCES, Tolerances
from rigs import Rig
from scenes.worlds.tank import tank_boards
from tracking.calibration.board_start import board_poses
from tracking.calibration.calibrated_rig import CalibratedRig, with_signs
from tracking.calibration.covariance import (
    PerturbationCovariance,
    covariance_of,
    spread_factor,
    unobservable_directions,
)
from tracking.calibration.estimate import calibrate
from tracking.calibration.fit import TURNING_POINT, Evidence, Residuals, fit, softened
from tracking.calibration.observations import TargetObservations
from tracking.calibration.prior import PRINT_TOLERANCES, draw_perturbations, standard_deviations
from tracking.perception.corners.exact import crop_outline_m

NOISE_PX = 0.3

DOUBT = 1e-3
"""Chance with which an honest covariance fails these tests; the seeds are fixed."""

WELL_ENOUGH_DEG, WELL_ENOUGH_PX = 0.1, 1.0
"""Acceptance: what a print error of 1 degree and 1 mm must come down to."""


@pytest.fixture(scope="module")
def rig():
    return Rig.load("aqua2")


@pytest.fixture(scope="module")
def poses(rig):
    return useful_poses(rig, 12)


def observed(rig, perturbations, q, *, seed, known=True, direct=False, edges=True):
    target = simulated_target(rig, perturbations, q, known=known, direct=direct, noise_px=NOISE_PX, seed=seed)
    corners = simulated_edges(
        rig, perturbations, Layout.from_rig(rig).joint_grid(4), noise_px=NOISE_PX, seed=seed + 1000
    )
    return {"target": target, "edges": corners if edges else None}


@pytest.fixture(scope="module")
def found(rig, poses):
    """A printed rig, and what is found of it with boards in known places and its mirror's corners."""
    perturbations = draw_perturbations(rig, PRINT_TOLERANCES, seed=1)
    return perturbations, calibrate(rig, **observed(rig, perturbations, poses, seed=1))


def test_printed_rig_comes_down_to_a_tenth_of_a_degree_and_a_pixel(rig, found):
    perturbations, estimate = found
    before, after = remaining(rig, perturbations, rig), remaining(rig, perturbations, estimate.calibrated)
    assert before.gaze_deg > 1
    assert before.image_px > 10
    assert after.gaze_deg <= WELL_ENOUGH_DEG
    assert after.gaze_worst_deg <= WELL_ENOUGH_DEG
    assert after.image_px <= WELL_ENOUGH_PX
    assert after.corners_px <= WELL_ENOUGH_PX
    assert estimate.converged
    assert estimate.missing_count == 0
    # What is left is the noise, but for the two dozen numbers that were fitted to some 1200.
    assert estimate.residual_px == pytest.approx(NOISE_PX, rel=0.1)


@pytest.mark.parametrize("preset", ["bluerov2", "torpedo"])
def test_other_rigs_come_down_alike(preset):
    """A dome, and another flat port."""
    rig = Rig.load(preset)
    perturbations = draw_perturbations(rig, PRINT_TOLERANCES, seed=2)
    estimate = calibrate(rig, **observed(rig, perturbations, useful_poses(rig, 12), seed=3))
    assert remaining(rig, perturbations, rig).gaze_deg > 1
    after = remaining(rig, perturbations, estimate.calibrated)
    assert after.gaze_deg <= WELL_ENOUGH_DEG
    assert after.image_px <= WELL_ENOUGH_PX
    assert after.corners_px <= WELL_ENOUGH_PX


def test_gaze_is_as_well_known_as_it_is_said_to_be(rig, found):
    """Root mean square over the joints' range: the perturbations of all poses come from the same two dozen numbers."""
    perturbations, estimate = found
    q = Layout.from_rig(rig).joint_grid(5)
    off = np.linalg.norm(estimate.calibrated.gaze(q) - PerturbedTrain(rig).gaze(q, perturbations), axis=1)
    said = estimate.calibrated.gaze_deviation(q)
    assert np.sqrt((off**2).mean()) < 3 * np.sqrt((said**2).mean())
    assert np.degrees(said).max() < WELL_ENOUGH_DEG


@pytest.mark.parametrize(("pan", "tilt"), [(-1, 1), (1, -1), (-1, -1)])
def test_signs_are_found(rig, poses, pan, tilt):
    """A servo that turns the other way than the rig file says."""
    built = with_signs(rig, pan, tilt)
    perturbations = draw_perturbations(rig, PRINT_TOLERANCES, seed=4)
    told = poses * [pan, tilt]
    limits = np.radians([[j.min_deg, j.max_deg] for j in (rig.gaze.joints.pan, rig.gaze.joints.tilt)])
    told = told[((told >= limits[:, 0]) & (told <= limits[:, 1])).all(axis=1)]
    estimate = calibrate(rig, **observed(built, perturbations, told, seed=4))
    assert estimate.signs_decided
    assert estimate.calibrated.rig.gaze.joints == built.gaze.joints
    assert estimate.trials[1].cost > 100 * estimate.trials[0].cost


REALISATIONS = 16


@pytest.mark.parametrize("prior", [True, False])
def test_covariance_is_honest(rig, prior):
    """Normalised errors squared (NEES) of 16 calibrations are chi-square distributed.

    Rationale: with a prior, both perturbations and noise are drawn again, and the maximum a posteriori must miss by
    what its covariance says. Without one the rig stays the same, and of several that would look alike it is the one
    that images without noise give.
    Expected: the sum of (found - true)' C^-1 (found - true) has as many degrees of freedom as numbers were found.
    """
    q, corner_poses = useful_poses(rig, 8), Layout.from_rig(rig).joint_grid(3)
    scales = standard_deviations(rig, PRINT_TOLERANCES)
    train = PerturbedTrain(rig)

    def fitted(perturbations, *, noise_px, seed):
        target = simulated_target(rig, perturbations, q, known=True, direct=False, noise_px=noise_px, seed=seed)
        evidence = Evidence(
            target=target.rows(np.arange(len(target.q)) % 3 == 0),
            edges=simulated_edges(rig, perturbations, corner_poses, noise_px=noise_px, seed=1000 + seed),
            noise_px=NOISE_PX,
            edge_noise_px=NOISE_PX,
            backlash=0.0,
        )
        residuals = Residuals(train, evidence, scales, [])
        found = fit(residuals, largest_evaluations=100)
        if prior:
            return found
        return fit(residuals, largest_evaluations=100, regularised=unobservable_directions(found), start=found.unknowns)

    perturbations = draw_perturbations(rig, PRINT_TOLERANCES, seed=0)
    if not prior:
        perturbations = fitted(perturbations, noise_px=0.0, seed=0).perturbations
    total, freedoms = 0.0, 0
    for seed in range(REALISATIONS):
        if prior:
            perturbations = draw_perturbations(rig, PRINT_TOLERANCES, seed=seed)
        found = fitted(perturbations, noise_px=NOISE_PX, seed=2000 + seed)
        known = covariance_of(found, scales, prior=prior)
        off = np.array([found.perturbations[name] - perturbations[name] for name in known.names]) / known.scales
        variance, axes = np.linalg.eigh(known.matrix / np.outer(known.scales, known.scales))
        observable = variance > 1e-12 * variance.max()
        total += float(((axes[:, observable].T @ off) ** 2 / variance[observable]).sum())
        freedoms += int(observable.sum())
    assert freedoms >= REALISATIONS * 20
    assert DOUBT < chi2.cdf(total, freedoms) < 1 - DOUBT


def test_robust_noise_costs_what_is_known_of_it():
    """Variance of the location of n normal numbers by pseudo-Huber: sandwich against Monte Carlo, c = 3.

    The estimate of one number of unit slope minimises the same cost; 4000 medians-like fits of 25 numbers by iterated
    weights, standard error of a variance 2 / sqrt(2 x 4000) = 2.2 %.
    """
    rng = np.random.default_rng(0)
    samples = rng.standard_normal((4000, 25))
    place = np.zeros((4000, 1))
    for _ in range(20):
        weight = 1 / np.sqrt(1 + ((samples - place) / TURNING_POINT) ** 2)
        place = (weight * samples).sum(axis=1, keepdims=True) / weight.sum(axis=1, keepdims=True)
    r = np.linspace(-10, 10, 4001)
    density = np.exp(-(r**2) / 2) / np.sqrt(2 * np.pi)
    slope = float((density * (1 + (r / TURNING_POINT) ** 2) ** -1.5).sum() * (r[1] - r[0]))
    assert 25 * place.var() == pytest.approx(spread_factor(1.0) / slope, rel=3 * 0.022)


def test_softened_residuals_have_pseudo_hubers_cost():
    r = np.array([0.0, 1e-9, 0.5, -3.0, 40.0])
    soft, slope = softened(r)
    cost = TURNING_POINT**2 * (np.sqrt(1 + (r / TURNING_POINT) ** 2) - 1)
    np.testing.assert_allclose(soft**2 / 2, cost, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(soft * slope, r / np.sqrt(1 + (r / TURNING_POINT) ** 2), rtol=1e-12)


def test_a_few_wrong_corners_do_little(rig, poses, found):
    """One corner in a hundred is off by up to 50 px."""
    perturbations, clean = found
    evidence = observed(rig, perturbations, poses, seed=1)
    target = evidence["target"]
    rng = np.random.default_rng(7)
    pixels = target.pixels.copy()
    wrong = rng.random(len(pixels)) < 0.01
    pixels[wrong] = np.clip(pixels[wrong] + rng.uniform(-50, 50, (int(wrong.sum()), 2)), 0, 479)
    estimate = calibrate(rig, target=replace(target, pixels=pixels), edges=evidence["edges"])
    assert wrong.sum() >= 3
    assert estimate.outlier_count >= wrong.sum()
    assert remaining(rig, perturbations, estimate.calibrated).gaze_deg < WELL_ENOUGH_DEG
    assert clean.outlier_count == 0


def test_noise_larger_than_said_widens_the_covariance(rig, poses, found):
    perturbations, clean = found
    estimate = calibrate(rig, **observed(rig, perturbations, poses, seed=1), noise_px=0.1, edge_noise_px=0.1)
    assert estimate.residual_width == pytest.approx(3, rel=0.1)
    wide, narrow = (each.calibrated.covariance.standard_deviations() for each in (estimate, clean))
    # Where the data say much, the same noise gives the same deviation, whichever way it is told.
    seen = clean.calibrated.covariance.data_deviations < 0.1 * clean.calibrated.covariance.scales
    assert seen.sum() >= 5
    # Three times as wide, the cost is nearly L1, which knows less by up to 1 / sqrt(0.64) (Huber 1981, section 1.1).
    np.testing.assert_allclose(wide[seen], narrow[seen], rtol=0.25)
    assert clean.residual_width == 1


def test_backlash_is_part_of_what_is_not_known(rig, poses):
    """0.15 degrees of backlash in each pose: without saying so the covariance would be far too small."""
    perturbations = draw_perturbations(rig, PRINT_TOLERANCES, seed=1)
    moved = poses + np.radians(0.15) * np.random.default_rng(3).standard_normal(poses.shape)
    moved = np.clip(moved, *np.radians([[j.min_deg, j.max_deg] for j in (rig.gaze.joints.pan, rig.gaze.joints.tilt)]).T)
    target = simulated_target(
        rig, perturbations, poses, known=True, direct=False, noise_px=NOISE_PX, seed=1, true_q=moved
    )
    said = calibrate(rig, target=target, backlash_deg=0.15)
    unsaid = calibrate(rig, target=target)
    assert said.residual_width == 1
    assert unsaid.residual_width > 2
    q = Layout.from_rig(rig).joint_grid(5)
    true = PerturbedTrain(rig).gaze(q, perturbations)
    ratio = [
        np.linalg.norm(each.calibrated.gaze(q) - true, axis=1).max() / each.calibrated.gaze_deviation(q).max()
        for each in (said, unsaid)
    ]
    assert ratio[0] < 3


EXACTLY_ALIKE = ({"tilt_offset", "m2_turn_x"}, {"gimbal_shift_z", "tilt_axis_shift_z"})
"""Pairs that do the same: tilt and a mirror turned about the tilt axis; the pan axis' height and the tilt axis' height
on it, whose other effects are shifts of M2 within its plane."""


def alike(covariance) -> list[set[str]]:
    """Errors of each combination that the data say nothing of."""
    return [
        {name for name, part in zip(covariance.names, row, strict=True) if abs(part) > 0.05}
        for row in covariance.unobservable
    ]


def test_what_does_the_same_is_named(found):
    covariance = found[1].calibrated.covariance
    for pair in EXACTLY_ALIKE:
        assert pair in alike(covariance)
        names = [covariance.names.index(name) for name in pair]
        assert np.isinf(covariance.data_deviations[names]).all()
        # Their sum is known, so each is known to what both tolerances leave of the difference.
        scales = covariance.scales[names]
        expected = scales.prod() / np.hypot(*scales)
        np.testing.assert_allclose(covariance.standard_deviations()[names], expected, rtol=0.02)
    combination = next(text for text in covariance.combinations() if "m2_turn_x" in text)
    assert set(combination.split(", ")) == {"tilt_offset +1 deg", "m2_turn_x +1 deg"}


M1 = ("m1_shift_z", "m1_turn_x", "m1_turn_y")


@pytest.mark.parametrize("what", ["board", "edges"])
def test_without_a_place_to_hold_on_to_the_fold_mirror_is_unknown(rig, poses, what):
    """M1 turned or shifted, and all behind it moved along: neither corners nor boards of unknown pose show it.

    Expected: none of M1's three freedoms is known from the data; neither is where the rig looks in the body frame.
    The corners' place in the image is.
    """
    perturbations = draw_perturbations(rig, PRINT_TOLERANCES, seed=1)
    evidence = observed(rig, perturbations, poses, seed=1, known=False, edges=what == "edges")
    if what == "edges":
        evidence["target"] = None
    free, estimated = (calibrate(rig, **evidence, prior=prior) for prior in (False, True))
    covariance = free.calibrated.covariance
    for name in M1:
        index = covariance.names.index(name)
        assert np.isinf(covariance.data_deviations[index])
        assert np.isinf(covariance.standard_deviations()[index])
        # The tolerance of the gimbal, which would have to be moved along, is all that bounds it.
        assert estimated.calibrated.covariance.standard_deviations()[index] > 0.2 * covariance.scales[index]
    # What the data say nothing of keeps the prior's variance, to the 1 % that the threshold of observability allows.
    counted = estimated.calibrated.covariance
    unobservable = np.linalg.qr(counted.unobservable.T)[0]
    kept = unobservable.T @ (counted.matrix / np.outer(counted.scales, counted.scales)) @ unobservable
    np.testing.assert_allclose(kept, np.eye(len(kept)), atol=0.02)
    q = Layout.from_rig(rig).joint_grid(3)
    assert np.isinf(free.calibrated.gaze_deviation(q)).all()
    said = estimated.calibrated.gaze_deviation(q)
    # M1's print tolerance of 1 degree about each axis turns the gaze by up to twice that.
    assert (np.degrees(said) > 0.3).all()
    off = np.linalg.norm(estimated.calibrated.gaze(q) - PerturbedTrain(rig).gaze(q, perturbations), axis=1)
    assert (off < 4 * said).all()
    if what == "edges":
        assert remaining(rig, perturbations, estimated.calibrated).corners_px < WELL_ENOUGH_PX


def test_moving_all_behind_the_fold_mirror_along_changes_no_image(rig, poses):
    """The same by hand: M1 nearer by s along its normal takes its image of the gimbal 2 s along; the gimbal follows.

    Source: a reflection at n . x = d is x - 2 (n . x - d) n.
    """
    train, shift_m, outline_m = PerturbedTrain(rig), 1e-3, crop_outline_m(rig)
    normal = train.layout.camera_from_m1.rotation.as_matrix()[:, 2]
    step = train.layout.camera_from_gimbal.rotation.inv().apply(2 * shift_m * normal)
    # M2's image over M1 moves by +2 s n; moving M2 itself by a has the image a - 2 (n . a) n: a = 2 s n undoes it.
    moved = {
        "m1_shift_z": shift_m,
        **{f"gimbal_shift_{axis}": part for axis, part in zip("xyz", step.tolist(), strict=True)},
    }
    seen, nominal = train.project_face(outline_m, poses, moved), train.project_face(outline_m, poses)
    np.testing.assert_allclose(seen, nominal, atol=1e-8)


def test_boards_seen_directly_give_it_back(rig, poses):
    """Boards in unknown places that are also seen past the mirrors, and the corners: the gaze is known again."""
    perturbations = draw_perturbations(rig, PRINT_TOLERANCES, seed=1)
    held = calibrate(rig, **observed(rig, perturbations, poses, seed=1, known=False, direct=True))
    q = Layout.from_rig(rig).joint_grid(5)
    assert np.degrees(held.calibrated.gaze_deviation(q)).max() < 0.25
    assert remaining(rig, perturbations, held.calibrated).gaze_deg < 0.25


@pytest.mark.parametrize("seed", [5, 8])
def test_boards_start_near_where_they_are(seed):
    """Boards that one or two images show, through mirrors that look degrees beside where they should.

    Rationale: these two rigs once sent a board behind the camera, and the calibration to the wrong signs.
    Expected: within 0.4 m and 10 degrees of the truth, 3 m away. The rays are off by up to 5 degrees, 0.3 m there.
    """
    rig = Rig.load("bluerov2")
    perturbations = draw_perturbations(rig, PRINT_TOLERANCES, seed=seed)
    few = useful_poses(rig, 48)[:6]
    evidence = observed(rig, perturbations, few, seed=seed, known=False, direct=True)
    train, target = PerturbedTrain(rig), evidence["target"]
    truth = {board.name: board.world_from_board for board in tank_boards(0.0)}
    for name, start in zip(target.boards, board_poses(train, target), strict=True):
        off = truth[name].inv() * train.layout.body_from_camera * start
        assert np.linalg.norm(off.translation) < 0.4
        assert np.degrees(off.rotation.magnitude()) < 10
    estimate = calibrate(rig, **evidence)
    assert estimate.signs_decided
    assert estimate.calibrated.rig.gaze.joints == rig.gaze.joints
    assert remaining(rig, perturbations, estimate.calibrated).gaze_deg < 0.3


def test_what_has_no_tolerance_is_not_looked_for(rig, poses):
    """Only joint offsets of 3 degrees: two unknowns."""
    perturbations = {"pan_offset": np.radians(3.0), "tilt_offset": np.radians(-2.0)}
    only = Tolerances(**{**NO_TOLERANCES, "joint_offset_deg": 5.0})
    target = simulated_target(rig, perturbations, poses, known=True, direct=False, noise_px=NOISE_PX, seed=0)
    estimate = calibrate(rig, target=target, tolerances=only)
    assert set(estimate.calibrated.perturbations) == {"pan_offset", "tilt_offset"}
    deviation = dict(
        zip(estimate.calibrated.covariance.names, estimate.calibrated.covariance.standard_deviations(), strict=True)
    )
    for name, value in perturbations.items():
        assert estimate.calibrated.perturbations[name] == pytest.approx(value, abs=4 * deviation[name])
        assert np.degrees(deviation[name]) < 0.01
    # A rig file can carry these: the nearest one is the built rig.
    joints = estimate.calibrated.with_joint_offsets().gaze.joints
    assert joints.pan.offset_deg == pytest.approx(3.0, abs=0.02)
    assert joints.tilt.offset_deg == pytest.approx(-2.0, abs=0.02)


def test_offsets_of_a_fold_up_are_turned_over(rig):
    """Its optical angles are the negatives of the file's (`docs/explanation/fold.md`)."""
    up = rig.with_gaze(fold_mirror={"direction": "up"})
    covariance = covariance_of_nothing()
    calibrated = CalibratedRig(rig=up, perturbations={"pan_offset": 0.02, "tilt_offset": -0.01}, covariance=covariance)
    q = Layout.from_rig(up).joint_grid(3)
    np.testing.assert_allclose(PerturbedTrain(calibrated.with_joint_offsets()).gaze(q), calibrated.gaze(q), atol=1e-9)


def covariance_of_nothing():
    return PerturbationCovariance(
        names=("pan_offset", "tilt_offset"),
        scales=np.ones(2),
        matrix=np.eye(2),
        unobservable=np.empty((0, 2)),
        data_deviations=np.full(2, np.inf),
        has_prior=True,
    )


def test_joint_offsets_alone_take_part_of_the_error_away(rig, found):
    perturbations, estimate = found
    offsets_only = estimate.calibrated.with_joint_offsets()
    before, with_offsets = remaining(rig, perturbations, rig), remaining(rig, perturbations, offsets_only)
    assert WELL_ENOUGH_DEG < with_offsets.gaze_deg < 0.7 * before.gaze_deg


def test_calibration_file_reads_back_the_same(rig, found, tmp_path):
    calibrated = found[1].calibrated
    calibrated.save(tmp_path / "calibration.toml")
    again = CalibratedRig.load(tmp_path / "calibration.toml", rig)
    q = Layout.from_rig(rig).joint_grid(3)
    # Degrees and millimetres in the file: the last digit may go.
    np.testing.assert_allclose(again.gaze(q), calibrated.gaze(q), atol=1e-14)
    np.testing.assert_allclose(again.gaze_deviation(q), calibrated.gaze_deviation(q), rtol=1e-9)
    np.testing.assert_allclose(again.corners(q), calibrated.corners(q), atol=1e-9)
    assert again.covariance.combinations() == calibrated.covariance.combinations()
    assert again.rig.gaze.joints == calibrated.rig.gaze.joints
    again.save(tmp_path / "again.toml")
    assert not list(tmp_path.glob("*.partial"))


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (("version = 2", "version = 99"), "expected a calibration file of version 2, got 99"),
        (('rig = "aqua2"', 'rig = "bluerov2"'), "expected the calibration of rig 'aqua2', got that of 'bluerov2'"),
        (("pan_sign = 1", "pan = 1"), "expected a calibration as mirrorgaze calibrate writes it"),
        (("version = 2", "version ="), r"expected a calibration file \(TOML\)"),
    ],
)
def test_files_that_are_no_calibration_of_the_rig_are_refused(rig, found, tmp_path, change, expected):
    path = tmp_path / "calibration.toml"
    found[1].calibrated.save(path)
    path.write_text(path.read_text().replace(*change))
    with pytest.raises(ValueError, match=expected):
        CalibratedRig.load(path, rig)


def test_train_and_corners_are_those_of_the_built_rig(rig, found):
    """What the loop uses: the exact train with the perturbations found, at most a pixel and a tenth of a degree off."""
    perturbations, estimate = found
    q = np.radians([[-20.0, -5.0], [10.0, 10.0]])
    for pose in q:
        pixel = [[rig.camera.cx_px, rig.camera.cy_px]]
        directions = [
            train.trace(pixel).direction[0]
            for train in (*PerturbedTrain(rig).optical_trains([pose], perturbations), estimate.calibrated.train(*pose))
        ]
        assert np.degrees(np.linalg.norm(directions[0] - directions[1])) < WELL_ENOUGH_DEG
    assert estimate.calibrated.corners(q[0]).shape == (4, 2)
    off = estimate.calibrated.corners(q) - PerturbedTrain(rig).project_face(crop_outline_m(rig), q, perturbations)
    assert np.linalg.norm(off, axis=-1).max() < WELL_ENOUGH_PX
    with pytest.raises(ValueError, match=r"expected q1 \(pan\) between"):
        estimate.calibrated.train(3.0, 0.0)


def test_observations_that_cannot_be_used_are_told_at_once(rig):
    target = TargetObservations.in_body(np.full((3, 2), 3.0), np.zeros((3, 3)), np.array([[1e6, 0.0]] * 3))
    with pytest.raises(ValueError, match="noise_px > 0") as told:
        calibrate(rig, target=target, noise_px=-1.0, backlash_deg=-1.0)
    for sentence in (
        "expected backlash_deg >= 0",
        "expected at least 12 observations, got 3",
        "expected a pixel inside the 640 x 480 image",
        "expected q1 between -77.5 and 77.5 deg, got 171.887",
        "expected at least 3 pairs of joint values, got 1",
    ):
        assert sentence in str(told.value)
    with pytest.raises(ValueError, match="got neither"):
        calibrate(rig)
    with pytest.raises(ValueError, match="expected a rig with mirrors"):
        calibrate(Rig.load("bench"), target=target)
