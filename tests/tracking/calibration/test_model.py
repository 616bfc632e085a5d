"""What a rig with errors shows: against the tolerance study's kernels, the exact train, and central differences."""

from __future__ import annotations

import numpy as np
import pytest

from dives.calibration.simulation import simulated_target, useful_poses
from optics.layout import Layout
from optics.tolerance.train import DeviantTrain
from rigs import NoPortSpec, Rig
from tracking.calibration.board_start import board_poses
from tracking.calibration.errors import (
    M2_IN_PLANE,
    PRINT_TOLERANCES,
    check_errors,
    draw_errors,
    error_names,
    standard_deviations,
)
from tracking.calibration.model import ErrorModel
from tracking.perception.exact_corners import ExactCorners

ROUNDING = 1e-11
"""Relative, of some dozen float64 operations at lengths of a metre."""

PROJECTION_PX = 1e-8
"""Ten times what the projection's root is converged to (1e-9 px)."""

TILT_PX = 5e-5
"""The tolerance study turns a tilted port's normal by the sine, the derivatives by the tangent: the third order of the
tilts, (0.02 rad)^3 / 2 x 500 px, and the displacement that a port makes of it is a tenth of that."""

STEP = 1e-6
"""Of central differences: their own error is 1e-12 relative, the projection's 1e-9 px / 1e-6 against slopes of 1e3."""

SLOPE = 1e-5

BUILT_SEED = 1


def with_fold_up(rig: Rig) -> Rig:
    return rig.with_gaze(fold_mirror={"direction": "up"})


RIGS = {
    "flat": Rig.load("aqua2"),
    "dome": Rig.load("bluerov2"),
    "none": Rig.load("aqua2").model_copy(update={"port": NoPortSpec(shape="none")}),
    "up": with_fold_up(Rig.load("aqua2")),
}


@pytest.fixture(params=RIGS)
def rig(request):
    return RIGS[request.param]


def poses(rig: Rig, count: int = 12) -> np.ndarray:
    low, high = np.radians([[j.min_deg, j.max_deg] for j in (rig.gaze.joints.pan, rig.gaze.joints.tilt)]).T
    return np.random.default_rng(0).uniform(low, high, (count, 2))


def far_points(rig: Rig, errors, q: np.ndarray) -> np.ndarray:
    """Points 3 m along the built rig's gaze, and 0.2 m beside it."""
    origin, direction = DeviantTrain(rig, q).view(deviations(errors))
    return origin[0] + 3 * direction[0] + 0.2 * np.random.default_rng(1).standard_normal((len(q), 3))


def deviations(errors) -> dict[str, np.ndarray]:
    return {name: np.array([[value]]) for name, value in errors.items() if name not in M2_IN_PLANE}


def test_without_errors_mirrors_stand_where_the_layout_has_them(rig):
    q, model, layout = poses(rig), ErrorModel(rig), Layout.from_rig(rig)
    found = model.gaze_mirror({}, q)
    for (q1, q2), origin, axes in zip(q, found.origin_m, found.axes, strict=True):
        expected = layout.camera_from_m2(q1, q2)
        np.testing.assert_allclose(origin, expected.translation, atol=ROUNDING)
        np.testing.assert_allclose(axes, expected.rotation.as_matrix(), atol=ROUNDING)
    np.testing.assert_allclose(model.fold_mirror({}).origin_m[0], layout.camera_from_m1.translation, atol=ROUNDING)


@pytest.mark.parametrize("tilted", [False, True])
def test_errors_mean_what_the_tolerance_study_means_by_them(rig, tilted):
    """An independent kernel, written with matrices and no chain, at errors of a degree and a millimetre."""
    errors = {
        name: value
        for name, value in draw_errors(rig, PRINT_TOLERANCES, seed=BUILT_SEED).items()
        if tilted or not name.startswith("port_tilt")
    }
    q, model, other = poses(rig), ErrorModel(rig), DeviantTrain(rig, poses(rig))
    points = far_points(rig, errors, q)
    tolerance = TILT_PX if tilted else PROJECTION_PX
    pixels = model.points(errors, q, points, ())[0]
    np.testing.assert_allclose(pixels, other.image(points, deviations(errors))[0], atol=tolerance)
    gaze = other.view(deviations(errors))[1][0] @ model.layout.body_from_camera.rotation.as_matrix().T
    np.testing.assert_allclose(model.gaze(errors, q)[0], gaze, atol=tolerance / rig.camera.fx_px)


def test_the_train_made_from_errors_shows_the_same(rig):
    errors, q = draw_errors(rig, PRINT_TOLERANCES, seed=BUILT_SEED), poses(rig)
    model = ErrorModel(rig)
    points = far_points(rig, errors, q)
    for pose, point, pixel in zip(q, points, model.points(errors, q, points, ())[0], strict=True):
        image = model.train(errors, *pose).project([point])
        np.testing.assert_allclose(image.pixels[0], pixel, atol=PROJECTION_PX)


def test_corners_without_errors_are_those_of_the_exact_extractor(rig):
    q = poses(rig)
    expected = ExactCorners(rig).corners(q)
    seen = np.isfinite(expected).all(axis=(1, 2))
    assert seen.any()
    np.testing.assert_allclose(ErrorModel(rig).corners({}, q)[0][seen], expected[seen], atol=PROJECTION_PX)


def test_corners_with_errors_are_those_of_the_train(rig):
    """The train's own M2 has its corners in M2's axes; over M1 alone they are where the model has them."""
    from dataclasses import replace

    errors, q, model = draw_errors(rig, PRINT_TOLERANCES, seed=BUILT_SEED), poses(rig), ErrorModel(rig)
    for pose, corners in zip(q, model.corners(errors, q)[0], strict=True):
        train = model.train(errors, *pose)
        pixels = replace(train, mirrors=train.mirrors[:1]).project(train.mirrors[1].corners_m).pixels
        # In another order: the mirror's own begins at the other end.
        distance = np.linalg.norm(pixels[:, np.newaxis] - corners, axis=2)
        assert distance.min(axis=0).max() < PROJECTION_PX


@pytest.mark.parametrize("kind", ["points", "corners", "gaze"])
def test_slopes_are_those_of_differences(rig, kind):
    errors, q, model = draw_errors(rig, PRINT_TOLERANCES, seed=BUILT_SEED), poses(rig, 4), ErrorModel(rig)
    points, names = far_points(rig, errors, q), error_names(rig)

    def shown(off, names=()):
        if kind == "points":
            return model.points(off, q, points, names)
        return getattr(model, kind)(off, q, names)

    values = shown(errors, names)[1]
    largest = np.abs(values).max()
    for column, name in enumerate(names):
        moved = [shown(errors | {name: errors[name] + sign * STEP})[0] for sign in (1, -1)]
        difference = (moved[0] - moved[1]) / (2 * STEP)
        np.testing.assert_allclose(values[..., column], difference, atol=SLOPE * largest, err_msg=name)


def test_what_is_seen_past_the_mirrors_does_not_know_of_them():
    rig = RIGS["flat"]
    model, points = ErrorModel(rig), np.array([[0.1, -0.05, 2.0], [0.3, 0.2, 3.0]])
    q = np.full((2, 2), np.nan)
    names = error_names(rig)
    pixels, values = model.points({"pan": 0.1, "m1_shift": 1e-3}, q, points, names)
    from optics import OpticalTrain

    np.testing.assert_allclose(pixels, OpticalTrain.from_rig(rig.without_mirrors()).project(points).pixels, atol=1e-8)
    of_mirrors = [index for index, name in enumerate(names) if not name.startswith(("port", "n_"))]
    assert np.abs(values[:, :, of_mirrors]).max() == 0
    assert np.abs(values[:, :, names.index("port_z")]).max() > 0


@pytest.mark.parametrize(("name", "tolerance_px"), [("none", 1e-3), ("flat", 1.0)])
def test_a_board_is_found_by_a_rig_as_drawn(name, tolerance_px):
    """Without noise and errors the linear start is the answer: of a pinhole exactly, whose rays meet.

    Rays of converged projections (1e-9 px) intersected over metres: a thousandth of a pixel is ample. Behind a port
    they miss each other by millimetres, which turn with the distance into tenths of a pixel: a start, no result.
    """
    rig = RIGS[name]
    model = ErrorModel(rig)
    target = simulated_target(rig, {}, useful_poses(rig, 6), known=False, direct=True, noise_px=0.0, seed=0)
    assert len(target.boards) >= 2
    for index, camera_from_board in enumerate(board_poses(model, target)):
        on = target.board == index
        pixels = model.points({}, target.q[on], camera_from_board.apply(target.points_m[on]), ())[0]
        np.testing.assert_allclose(pixels, target.pixels[on], atol=tolerance_px)


def test_unknown_errors_are_refused():
    with pytest.raises(ValueError, match=r"expected errors among .*, got nonsense"):
        check_errors(RIGS["flat"], {"nonsense": 1.0})
    with pytest.raises(ValueError, match="finite errors, got pan = nan"):
        ErrorModel(RIGS["flat"]).corners({"pan": np.nan}, np.zeros((1, 2)))


def test_tolerances_of_one_thing_add_up_in_squares():
    """m1_x: a degree of the seat and the flatness of the glass; index of water: temperature and salinity."""
    rig = RIGS["flat"]
    found = standard_deviations(rig, PRINT_TOLERANCES)
    assert found["m1_x"] == pytest.approx(np.hypot(np.radians(1.0), 1e-4), rel=1e-12)
    assert found["m2_slide_x"] == pytest.approx(1e-3, rel=1e-12)
    assert set(found) == set(error_names(rig))
    assert all(value > 0 for value in found.values())
