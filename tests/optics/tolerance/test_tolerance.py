"""Tolerances: closed forms of single errors, the train itself, shares by two ways, calibration, and seeds."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from optics.layout import Layout
from optics.perturbation.parameters import MIRRORS, PORT, rig_parameters
from optics.perturbation.train import PerturbedTrain
from optics.tolerance import tolerance as tolerance_module
from optics.tolerance.after_calibration import calibrated_offsets
from optics.tolerance.sources import NO_TOLERANCES, Tolerances, combined, draw_all, error_sources, pulse_angle
from optics.tolerance.tolerance import representative_poses, tolerance_study
from optics.train import OpticalTrain
from optics.water.water import water_index
from rigs import Rig

ROUNDING = 1e-12
"""Unit vectors after two reflections and two refractions; a few hundred roundings of 1e-16."""

ROUNDING_PX = 1e-8
"""What `optics.train` promises for projections."""

QUOTIENT = 1e-6
"""Relative, of extrapolated difference quotients with steps of 1e-4: rounding of 1e-11 px or 1e-15 over the step."""

PRODUCTS = 1e-5
"""Share of what acts on the gaze only together with something else, as the water's index does behind a tilted port:
its first order is zero, the Monte Carlo sees the product of two small errors."""

Q = np.radians([[0.0, 0.0], [33.0, -20.0], [-70.0, 50.0], [10.0, 100.0]])


def only(**values: float) -> Tolerances:
    return Tolerances(**{**NO_TOLERANCES, **values})


def angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return 2 * np.arcsin(np.linalg.norm(a - b, axis=-1) / 2)


@pytest.fixture(scope="module", params=["aqua2", "bluerov2"])
def rig(request: pytest.FixtureRequest) -> Rig:
    return Rig.load(request.param)


@pytest.fixture(scope="module")
def train(rig: Rig) -> PerturbedTrain:
    return PerturbedTrain(rig)


def test_without_perturbations_it_is_the_train(rig: Rig, train: PerturbedTrain) -> None:
    pixel = (rig.camera.cx_px + 31.0, rig.camera.cy_px - 17.0)
    origin, direction = train.trace(Q, pixels=pixel)
    targets = origin + 2.5 * direction
    for position, (q1, q2) in enumerate(Q):
        exact = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
        rays = exact.trace([pixel])
        np.testing.assert_allclose(origin[position], rays.origin_m[0], atol=ROUNDING)
        np.testing.assert_allclose(direction[position], rays.direction[0], atol=ROUNDING)
        expected = exact.project(targets[position : position + 1]).pixels[0]
        np.testing.assert_allclose(train.project(targets, Q)[position], expected, atol=ROUNDING_PX)


@pytest.mark.parametrize("error", [1e-4, 0.02, -0.1])
def test_a_tilted_gaze_mirror_turns_the_gaze_twice_as_far(train: PerturbedTrain, error: float) -> None:
    # About the tilt axis the mirror turns in the plane of incidence, which holds the axis and the gaze.
    straight = train.trace(Q)[1]
    for name in ("m2_turn_x", "tilt_offset"):
        turned = train.trace(Q, {name: error})[1]
        np.testing.assert_allclose(angle(turned, straight), 2 * abs(error), atol=ROUNDING)
    # The mirror's x axis is the tilt axis: the same turn, counted the other way.
    both = train.trace(Q, {"m2_turn_x": error, "tilt_offset": error})[1]
    np.testing.assert_allclose(both, straight, atol=ROUNDING)


@pytest.mark.parametrize("error", [1e-4, 0.05])
def test_a_panned_mirror_turns_the_gaze_by_the_cosine_of_its_elevation(train: PerturbedTrain, error: float) -> None:
    # The folded axis is the pan axis: the gaze goes round it on a cone, whose chord is 2 cos(2 t) sin(e / 2).
    straight, turned = train.trace(Q)[1], train.trace(Q, {"pan_offset": error})[1]
    chord = 2 * np.abs(np.cos(2 * Q[:, 1])) * np.sin(error / 2)
    np.testing.assert_allclose(np.linalg.norm(turned - straight, axis=-1), chord, atol=ROUNDING)


def test_a_mirror_turned_about_its_own_upward_axis_by_geometry(train: PerturbedTrain) -> None:
    # The normal moves by e sideways; the gaze d = i - 2 (i . n) n by 2 |i . n| e to first order (i . x = 0), and
    # i . n = -cos(incidence) = -sin(45 degrees + t).
    error = 1e-5
    straight, turned = train.trace(Q)[1], train.trace(Q, {"m2_turn_y": error})[1]
    expected = 2 * np.sin(np.pi / 4 + Q[:, 1]) * error
    np.testing.assert_allclose(angle(turned, straight), expected, rtol=1e-4)


def test_a_shifted_gaze_mirror_moves_the_view_by_twice_its_shift(rig: Rig, train: PerturbedTrain) -> None:
    shift = 0.004
    off = {"m2_shift_z": shift}
    np.testing.assert_allclose(train.trace(Q, off)[1], train.trace(Q)[1], atol=ROUNDING)
    # What is 2 x further along the mirror's normal appears where the target appeared before.
    origin, direction = train.trace(Q, pixels=(rig.camera.cx_px + 40.0, rig.camera.cy_px + 25.0))
    targets = origin + 3.0 * direction
    layout = Layout.from_rig(rig)
    normals = np.array([layout.camera_from_m2(q1, q2).rotation.as_matrix()[:, 2] for q1, q2 in Q])
    seen = train.project(targets + 2 * shift * normals, Q, off)
    np.testing.assert_allclose(seen, train.project(targets, Q), atol=ROUNDING_PX)


def test_parts_can_be_moved_in_the_rig_file_instead(rig: Rig) -> None:
    """A second way: the same rig with other numbers, where the rig file has a number for it."""
    document = rig.model_dump()
    document["joints"]["pan"]["offset_deg"] = 0.7
    document["joints"]["tilt"]["offset_deg"] = -0.4
    document["fold_mirror"]["distance_mm"] += 1.5
    document["port"]["thickness_mm"] += 0.6
    if rig.port.shape == "flat":
        document["port"]["distance_mm"] += 0.9
    else:
        document["port"]["centre_mm"] = (0.3, -0.2, 0.9)
    moved = Rig.model_validate(document)
    off = {
        "pan_offset": np.radians(0.7),
        "tilt_offset": np.radians(-0.4),
        # Along the axis by 1.5 mm is along the normal, at 45 degrees to it and towards the camera, by -1.5 / sqrt(2).
        "m1_shift_z": -1.5e-3 / np.sqrt(2),
        "gimbal_shift_x": 1.5e-3,
        "port_thickness": 0.6e-3,
    }
    if rig.port.shape == "flat":
        off["port_distance"] = 0.9e-3
    else:
        off |= {"port_centre_x": 0.3e-3, "port_centre_y": -0.2e-3, "port_centre_z": 0.9e-3}
    train, expected = PerturbedTrain(rig), PerturbedTrain(moved)
    np.testing.assert_allclose(train.trace(Q, off)[1], expected.trace(Q)[1], atol=ROUNDING)
    origin, direction = expected.trace(Q, pixels=(rig.camera.cx_px + 40.0, rig.camera.cy_px + 25.0))
    targets = origin + 3.0 * direction
    np.testing.assert_allclose(train.project(targets, Q, off), expected.project(targets, Q), atol=ROUNDING_PX)


def test_sensitivities_are_the_limit_of_difference_quotients(rig: Rig) -> None:
    """Automatic derivatives by each parameter, and the Monte Carlo's own observations of a slightly perturbed train.

    Central differences at two steps, extrapolated (Richardson), leave an error of the fourth order in the step and the
    rounding of pixels, 1e-11, over the step.
    """
    names = [*PORT[rig.port.shape], *MIRRORS]
    bench = tolerance_module._Bench.of(rig, Q, 3.0, names)
    jacobians = bench.jacobians()
    for position, name in enumerate(names):
        wide, narrow = (
            [
                (up - down)[0] / (2 * step)
                for up, down in zip(*(bench.observe({name: way * step}, 1) for way in (1, -1)), strict=True)
            ]
            for step in (2e-4, 1e-4)
        )
        for found, coarse, fine in zip(jacobians, wide, narrow, strict=True):
            expected = (4 * fine - coarse) / 3
            scale = max(1.0, np.abs(expected).max())
            np.testing.assert_allclose(found[..., position], expected, atol=QUOTIENT * scale, err_msg=name)


def test_small_errors_add_up_linearly(rig: Rig) -> None:
    """Half the tolerances, half the errors: to second order, which is the size of the errors in radians."""
    whole = tolerance_study(rig, samples=200)
    values = {name: getattr(Tolerances(), name) for name in NO_TOLERANCES}
    small = {name: 0.01 * (2.0 if value is None else value) for name, value in values.items()}
    hundredth = tolerance_study(rig, Tolerances(**small), samples=200)
    relative = 100 * hundredth.built.gaze_deg / whole.built.gaze_deg
    assert np.abs(np.log(np.median(relative))) < np.radians(whole.built.gaze_deg.max())
    halved = tolerance_study(rig, Tolerances(**{name: value / 2 for name, value in small.items()}), samples=200)
    largest = np.radians(hundredth.built.gaze_deg.max())
    np.testing.assert_allclose(halved.built.gaze_deg * 2, hundredth.built.gaze_deg, atol=np.degrees(largest**2))


def test_a_deadband_is_an_angle_of_the_servo(rig: Rig) -> None:
    # Travel over pulse range: 155 degrees over 1500 us, so 2 us are 0.2067 degrees; the tilt moves the gaze twice. Both
    # servos of both presets have that travel and range.
    servo = rig.gaze.servos.tilt
    assert np.degrees(pulse_angle(servo, 2.0)) == pytest.approx(155 / 1500 * 2)
    study = tolerance_study(rig, Tolerances(**{**NO_TOLERANCES, "deadband_us": None}), samples=4000, poses=[[0.0, 0.0]])
    half = 155 / 1500 * servo.deadband_us
    # At a level gaze pan and tilt move it at right angles: the corner of the box is the largest error there is.
    assert study.built.gaze_deg.max() <= np.hypot(half, 2 * half) * (1 + 1e-3)
    assert study.built.gaze_deg.max() > 0.97 * np.hypot(half, 2 * half)
    # Variance of a uniform error of half-width h: h^2 / 3.
    assert study.ranking[0].gaze_rms_deg == pytest.approx(np.sqrt((half**2 + (2 * half) ** 2) / 3), rel=1e-6)


def test_both_ways_rank_the_tolerances_alike(rig: Rig) -> None:
    samples = 10_000
    study = tolerance_study(rig, samples=samples)
    assert sum(item.gaze_share for item in study.ranking) == pytest.approx(1)
    assert sum(item.image_share for item in study.ranking) == pytest.approx(1)
    second_order = np.radians(study.built.gaze_deg).max()
    for item in study.ranking:
        for share, frozen in (
            (item.gaze_share, item.gaze_share_frozen),
            (item.image_share, item.image_share_frozen),
        ):
            # Taking one out also takes its chance products with the others: 2 sqrt(s (1 - s) / n), three times that;
            # the rest is curvature, and the chance of the share's own mean square, sqrt(2 / n).
            chance = 3 * (2 * np.sqrt(share * (1 - share) / samples) + share * np.sqrt(2 / samples))
            assert abs(share - frozen) <= chance + second_order * share + PRODUCTS, item.source.name


def test_first_order_is_the_mean_square_of_the_monte_carlo(rig: Rig) -> None:
    # Of one source alone, where there are no chance products: the mean square of n normal draws is good to sqrt(2 / n).
    for name in ("m1_angle_deg", "tilt_axis_skew_deg", "pan_axis_tilt_deg", "m2_position_mm", "backlash_deg"):
        study = tolerance_study(rig, only(**{name: getattr(Tolerances(), name)}), samples=4000)
        (item,) = study.ranking
        chance = 4 * np.sqrt(2 / 4000)
        assert np.mean(study.built.image_px**2) == pytest.approx(item.image_rms_px**2, rel=chance)
        gaze = np.mean(study.built.gaze_deg**2)
        assert gaze == pytest.approx(item.gaze_rms_deg**2, rel=chance, abs=ROUNDING)


def test_calibration_takes_away_pure_joint_offsets(rig: Rig) -> None:
    study = tolerance_study(rig, only(joint_offset_deg=1.0), samples=300)
    assert study.built.gaze_deg.max() > 2
    # Four Gauss-Newton steps from errors of up to some 4 degrees: 0.07^4 of that.
    assert study.calibrated.gaze_deg.max() < 1e-3
    assert study.calibrated.image_px.max() < 0.05
    assert study.offsets_deg.std(axis=0) == pytest.approx([1, 1], rel=0.2)


def test_calibration_finds_known_offsets(rig: Rig, train: PerturbedTrain) -> None:
    offsets = np.radians([[0.5, -0.3], [-1.2, 0.8]])
    off = {name: offsets[:, column, np.newaxis] for column, name in enumerate(("pan_offset", "tilt_offset"))}
    found = calibrated_offsets(train, Q, train.gaze(np.stack([Q, Q]), off))
    np.testing.assert_allclose(found, offsets, atol=1e-7)


def test_calibration_cannot_know_what_changes_in_each_pose(rig: Rig) -> None:
    # Nine poses average backlash away, and the two offsets fitted to it add 2 / 9 of its variance at most.
    study = tolerance_study(rig, only(backlash_deg=0.25), samples=2000)
    before, after = (np.mean(errors.gaze_deg**2) for errors in (study.built, study.calibrated))
    assert before * 0.95 < after < before * (1 + 2 / 9)


def test_a_single_pose_at_the_zenith_says_nothing_about_pan(rig: Rig) -> None:
    train, zenith = PerturbedTrain(rig), np.radians([[0.0, 45.0]])
    with pytest.raises(ValueError, match=r"poses that determine both joint offsets, got q = \[\[0\.0, 45\.0\]\]"):
        calibrated_offsets(train, zenith, train.gaze(zenith[np.newaxis]))


def test_the_same_seed_gives_the_same_bytes(rig: Rig) -> None:
    first, again, other = (tolerance_study(rig, samples=50, seed=seed) for seed in (3, 3, 4))
    assert first.built.gaze_deg.tobytes() == again.built.gaze_deg.tobytes()
    assert first.calibrated.image_px.tobytes() == again.calibrated.image_px.tobytes()
    assert not np.array_equal(first.built.gaze_deg, other.built.gaze_deg)


def test_leaving_one_source_out_changes_no_other(rig: Rig) -> None:
    sources = error_sources(rig, Tolerances())
    whole = draw_all(sources, seed=1, samples=5, poses=3)
    rest = draw_all(sources[3:], seed=1, samples=5, poses=3)
    moved_again = draw_all(sources, seed=1, samples=5, poses=3, repetition=1)
    for source in sources:
        for name in source.sizes:
            same = np.array_equal(whole[source.name][name], moved_again[source.name][name])
            assert same is not source.each_pose
            if source.name in rest:
                np.testing.assert_array_equal(whole[source.name][name], rest[source.name][name])
    assert set(combined(whole.values())) <= set(rig_parameters(rig))


def test_water_acts_through_the_slope_of_its_index() -> None:
    rig = Rig.load("aqua2")  # 25 degrees Celsius, 35 ppt: salinity stands at the end of the formula's range
    sources = {source.name: source for source in error_sources(rig, Tolerances())}
    change = water_index(550, 35.0, 26.0) - water_index(550, 35.0, 24.0)
    assert sources["temperature_celsius"].sizes["n_water"] == pytest.approx(3 * change / 2, rel=1e-6)
    change = water_index(550, 35.0, 25.0) - water_index(550, 34.0, 25.0)
    assert sources["salinity_ppt"].sizes["n_water"] == pytest.approx(change, rel=1e-6)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"samples": 0}, "samples > 0"),
        ({"seed": -1}, "seed >= 0"),
        ({"target_m": 0.0}, "target_m > 0, got 0"),
        ({"poses": [[0.0, 9.0]]}, r"q2 \(tilt\) between"),
        ({"poses": [0.0, 1.0]}, r"poses of shape \(k, 2\), got \(2,\)"),
    ],
)
def test_wrong_arguments_are_sentences(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        tolerance_study(Rig.load("aqua2"), **options)


def test_wrong_tolerances_are_sentences() -> None:
    with pytest.raises(ValueError, match="m1_angle_deg >= 0, got -1"):
        Tolerances(m1_angle_deg=-1)
    with pytest.raises(ValueError, match="backlash_deg >= 0, got nan"):
        replace(Tolerances(), backlash_deg=float("nan"))
    with pytest.raises(ValueError, match=r"every built rig has an image of its target, got .* make them smaller"):
        tolerance_study(Rig.load("aqua2"), only(m2_angle_deg=60.0), samples=50)
    with pytest.raises(ValueError, match="expected a rig with mirrors, got 'bench'"):
        tolerance_study(Rig.load("bench"))


def test_nothing_wrong_means_no_error_and_no_ranking() -> None:
    study = tolerance_study(Rig.load("aqua2"), only(), samples=2)
    assert study.ranking == ()
    assert study.built.gaze_deg.max() == 0
    assert study.q_deg.shape == (9, 2)
    np.testing.assert_allclose(np.radians(study.q_deg), representative_poses(Rig.load("aqua2")))
