"""What a perturbed rig shows: against frames multiplied by hand, the exact train, and central differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import plain_perturbations
import pytest

from optics.layout import Layout
from optics.perturbation.derivatives import face_jacobian, gaze_jacobian, projection_jacobian
from optics.perturbation.parameters import JOINTS, MIRRORS, check_perturbations
from optics.perturbation.train import PerturbedTrain
from optics.status import Status
from optics.train import OpticalTrain
from rigs import NoPortSpec, Rig
from tracking.calibration.prior import PRINT_TOLERANCES, draw_perturbations, estimated_parameters
from tracking.perception.corners.exact import ExactCorners, crop_outline_m

ROUNDING = 1e-11
"""Relative, of some dozen float64 operations at lengths of a metre."""

PROJECTION_PX = 1e-8
"""Ten times what the projection's root is converged to (1e-9 px)."""

STEP = 1e-6
"""Of central differences: their own error is 1e-12 relative, the projection's 1e-9 px / 1e-6 against derivatives
of 1e3."""

DERIVATIVE = 1e-5

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


def far_points(rig: Rig, perturbations, q: np.ndarray) -> np.ndarray:
    """Points 3 m along the built rig's gaze, and 0.2 m beside it."""
    origin, direction = PerturbedTrain(rig).trace(q, perturbations)
    return origin + 3 * direction + 0.2 * np.random.default_rng(1).standard_normal((len(q), 3))


def test_nominal_mirrors_stand_where_the_layout_has_them(rig):
    q, layout = poses(rig), Layout.from_rig(rig)
    m1, m2 = PerturbedTrain(rig).mirror_poses(q)
    for (q1, q2), found in zip(q, m2.as_matrix(), strict=True):
        np.testing.assert_allclose(found, layout.camera_from_m2(q1, q2).as_matrix(), atol=ROUNDING)
    np.testing.assert_allclose(m1.as_matrix()[0], layout.camera_from_m1.as_matrix(), atol=ROUNDING)


def test_perturbations_mean_what_they_mean_by_hand(rig):
    """An independent implementation, frame by frame, at perturbations of a degree and a millimetre."""
    perturbations, q = draw_perturbations(rig, PRINT_TOLERANCES, seed=BUILT_SEED), poses(rig)
    train, points = PerturbedTrain(rig), far_points(rig, perturbations, q)
    pixels, gaze = train.project(points, q, perturbations), train.gaze(q, perturbations)
    turn, gazes = train.layout.body_from_camera.rotation, 0
    for pose, point, pixel, direction in zip(q, points, pixels, gaze, strict=True):
        plain = plain_perturbations.unbounded(rig, perturbations, *pose)
        np.testing.assert_allclose(pixel, plain.project([point]).pixels[0], atol=PROJECTION_PX)
        ray = plain.trace([(rig.camera.cx_px, rig.camera.cy_px)])
        if ray.status[0] != Status.OK:  # the back of a mirror, where the exact train ends
            continue
        gazes += 1
        np.testing.assert_allclose(direction, turn.apply(ray.direction[0]), atol=PROJECTION_PX / rig.camera.fx_px)
    assert gazes > len(q) / 2


def test_exact_trains_show_the_same(rig):
    perturbations, q = draw_perturbations(rig, PRINT_TOLERANCES, seed=BUILT_SEED), poses(rig)
    train, points = PerturbedTrain(rig), far_points(rig, perturbations, q)
    pixels = train.project(points, q, perturbations)
    for exact, point, pixel in zip(train.optical_trains(q, perturbations), points, pixels, strict=True):
        np.testing.assert_allclose(exact.project([point]).pixels[0], pixel, atol=PROJECTION_PX)


def test_nominal_corners_are_those_of_the_exact_extractor(rig):
    q = poses(rig)
    expected = ExactCorners(rig).corners(q)
    seen = np.isfinite(expected).all(axis=(1, 2))
    assert seen.any()
    found = PerturbedTrain(rig).project_face(crop_outline_m(rig), q)
    np.testing.assert_allclose(found[seen], expected[seen], atol=PROJECTION_PX)


def test_perturbed_corners_are_those_of_the_train(rig):
    """The train's own M2 has its corners in M2's axes; over M1 alone they are where the kernel has them."""
    perturbations, q, train = (
        draw_perturbations(rig, PRINT_TOLERANCES, seed=BUILT_SEED),
        poses(rig),
        PerturbedTrain(rig),
    )
    found = train.project_face(crop_outline_m(rig), q, perturbations)
    for exact, corners in zip(train.optical_trains(q, perturbations), found, strict=True):
        pixels = replace(exact, mirrors=exact.mirrors[:1]).project(exact.mirrors[1].corners_m).pixels
        # In another order: the mirror's own begins at the other end.
        distance = np.linalg.norm(pixels[:, np.newaxis] - corners, axis=2)
        assert distance.min(axis=0).max() < PROJECTION_PX


@pytest.mark.parametrize("kind", ["points", "corners", "gaze"])
def test_derivatives_are_those_of_differences(rig, kind):
    perturbations, q, train = (
        draw_perturbations(rig, PRINT_TOLERANCES, seed=BUILT_SEED),
        poses(rig, 4),
        PerturbedTrain(rig),
    )
    points, outline, names = far_points(rig, perturbations, q), crop_outline_m(rig), estimated_parameters(rig)

    def shown(off):
        if kind == "points":
            return train.project(points, q, off)
        return train.project_face(outline, q, off) if kind == "corners" else train.gaze(q, off)

    jacobian, seen = {
        "points": (projection_jacobian, (points,)),
        "corners": (face_jacobian, (outline,)),
        "gaze": (gaze_jacobian, ()),
    }[kind]
    values = jacobian(train, *seen, q, perturbations, parameters=names).values
    largest = np.abs(values).max()
    for column, name in enumerate(names):
        moved = [shown(perturbations | {name: perturbations[name] + sign * STEP}) for sign in (1, -1)]
        difference = (moved[0] - moved[1]) / (2 * STEP)
        np.testing.assert_allclose(values[..., column], difference, atol=DERIVATIVE * largest, err_msg=name)


def test_what_is_seen_past_the_mirrors_does_not_know_of_them():
    rig = RIGS["flat"]
    train, points = PerturbedTrain(rig), np.array([[0.1, -0.05, 2.0], [0.3, 0.2, 3.0]])
    perturbations = {"pan_offset": 0.1, "m1_shift_z": 1e-3}
    found = projection_jacobian(train, points, (np.nan, np.nan), perturbations)
    bare = OpticalTrain.from_rig(rig.without_mirrors())
    np.testing.assert_allclose(found.outputs, bare.project(points).pixels, atol=1e-8)
    of_mirrors = [index for index, name in enumerate(found.parameters) if name in (*JOINTS, *MIRRORS)]
    assert np.abs(found.values[:, :, of_mirrors]).max() == 0
    assert np.abs(found.of("port_distance")).max() > 0
    rays = bare.trace([(100.0, 200.0)])
    origin, direction = train.trace([np.nan, np.nan], perturbations, pixels=(100.0, 200.0))
    np.testing.assert_allclose(origin, rays.origin_m[0], atol=ROUNDING)
    np.testing.assert_allclose(direction, rays.direction[0], atol=ROUNDING)


def test_unknown_perturbations_are_refused():
    with pytest.raises(ValueError, match=r"expected parameters among .*, got nonsense"):
        check_perturbations(RIGS["flat"], {"nonsense": 1.0})
    with pytest.raises(ValueError, match="finite perturbations, got pan_offset = nan"):
        PerturbedTrain(RIGS["flat"]).gaze(np.zeros((1, 2)), {"pan_offset": np.nan})
