"""Eq. 6: inverse-distance weighting of the gaze mirror's corners, by hand, by its invariants, and its order."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigs import Rig
from tracking.perception import CornerSamples, InverseDistanceCorners, corner_error, exact_samples, pose_grid

ROUNDING_PX = 1e-9
"""Sums of a few hundred float64 products of weights below one and pixels below a thousand leave 1e-11."""

QUADRILATERAL = np.array([[100.0, 50.0], [400.0, 60.0], [390.0, 300.0], [110.0, 280.0]])
POSES = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 2.0], [1.5, 2.5]])
SHIFTS = np.array([[0.0, 0.0], [30.0, 5.0], [-20.0, 40.0], [7.0, 80.0]])
SAMPLES = CornerSamples(q=POSES, corners_px=QUADRILATERAL + SHIFTS[:, np.newaxis])

joints = st.tuples(st.floats(-3, 3), st.floats(-3, 3))
powers = st.floats(0.1, 12)


def as_the_paper_writes_it(q: tuple[float, float], power: float) -> np.ndarray:
    """Eq. 6, one of the eight functions at a time, in plain Python."""
    result = np.empty((4, 2))
    for corner in range(4):
        for axis in range(2):
            above = below = 0.0
            for (x, y), corners in zip(SAMPLES.q.tolist(), SAMPLES.corners_px.tolist(), strict=True):
                if (x, y) == tuple(q):
                    above, below = corners[corner][axis], 1.0
                    break
                distance = ((x - q[0]) ** 2 + (y - q[1]) ** 2) ** (power / 2)
                above += corners[corner][axis] / distance
                below += 1 / distance
            result[corner, axis] = above / below
    return result


@given(q=joints.filter(lambda q: min(math.dist(q, pose) for pose in POSES.tolist()) > 1e-6), power=powers)
def test_eight_functions_are_those_of_equation_six(q, power):
    found = InverseDistanceCorners(samples=SAMPLES, power=power).corners(q)
    np.testing.assert_allclose(found, as_the_paper_writes_it(q, power), atol=ROUNDING_PX)


@pytest.mark.parametrize("power", [0.5, 2.0, 3.0, 50.0])
def test_samples_are_hit_exactly(power):
    assert (InverseDistanceCorners(samples=SAMPLES, power=power).corners(POSES) == SAMPLES.corners_px).all()


@given(power=powers)
def test_midway_between_all_samples_is_their_mean(power):
    """Four samples on a circle: every weight is the same, whatever the power."""
    square = CornerSamples(q=np.array([[1, 0], [0, 1], [-1, 0], [0, -1.0]]), corners_px=SAMPLES.corners_px)
    found = InverseDistanceCorners(samples=square, power=power).corners([0.0, 0.0])
    np.testing.assert_allclose(found, SAMPLES.corners_px.mean(axis=0), atol=ROUNDING_PX)


@given(q=joints, power=powers)
def test_result_lies_between_the_samples(q, power):
    """Weights are positive and sum to one."""
    found = InverseDistanceCorners(samples=SAMPLES, power=power).corners(q)
    assert (found >= SAMPLES.corners_px.min(axis=0) - ROUNDING_PX).all()
    assert (found <= SAMPLES.corners_px.max(axis=0) + ROUNDING_PX).all()


@given(q=joints, power=powers, scale=st.floats(0.01, 100))
def test_unit_of_the_joints_does_not_matter(q, power, scale):
    in_degrees = CornerSamples(q=SAMPLES.q * scale, corners_px=SAMPLES.corners_px)
    found = InverseDistanceCorners(samples=in_degrees, power=power).corners(np.array(q) * scale)
    expected = InverseDistanceCorners(samples=SAMPLES, power=power).corners(q)
    # Rounding of the scaled joints moves the pose by 1e-15; near a sample, with p < 1, corners change infinitely fast.
    near = min(math.dist(q, pose) for pose in POSES.tolist()) < 1e-3
    if not near:
        np.testing.assert_allclose(found, expected, atol=1e-6)


def test_high_powers_are_the_nearest_neighbour_and_do_not_overflow():
    """The paper's name of the method; 1 / d^50 of a distance of 1e-30 would be infinite."""
    model = InverseDistanceCorners(samples=SAMPLES, power=50.0)
    np.testing.assert_allclose(model.corners([0.4, 0.1]), SAMPLES.corners_px[0], atol=ROUNDING_PX)
    np.testing.assert_allclose(model.corners([1e-30, 0.0]), SAMPLES.corners_px[0], atol=ROUNDING_PX)
    np.testing.assert_allclose(model.corners([1e-200, 0.0]), SAMPLES.corners_px[0], atol=ROUNDING_PX)


def test_poses_come_in_any_shape():
    q = np.random.default_rng(0).uniform(-1, 1, (3, 5, 2))
    model = InverseDistanceCorners(samples=SAMPLES)
    found = model.corners(q)
    assert found.shape == (3, 5, 4, 2)
    np.testing.assert_allclose(found[2, 3], model.corners(q[2, 3]), atol=ROUNDING_PX)


@pytest.mark.parametrize("power", [0.0, -1.0, np.nan, np.inf])
def test_power_must_be_positive(power):
    with pytest.raises(ValueError, match=r"expected a power above 0, got"):
        InverseDistanceCorners(samples=SAMPLES, power=power)


@pytest.mark.parametrize("q", [[np.nan, 0.0], [0.0], 1.0, [[1.0, 2.0, 3.0]]])
def test_joint_values_must_be_finite_pairs(q):
    with pytest.raises(ValueError, match=r"expected finite joint values of shape \(\.\.\., 2\)"):
        InverseDistanceCorners(samples=SAMPLES).corners(q)


def test_error_vanishes_at_the_samples():
    """A grid of 13 x 13 poses meets all of 7 x 7 samples at every other pose."""
    found = corner_error(Rig.load("aqua2"), 49, 3.0, 13)
    assert found.error_px[::2, ::2].max() < 1e-6
    assert found.error_px[1::2, 1::2].min() > 1


def test_error_falls_with_the_distance_of_the_samples():
    """Eq. 6 is of first order, no better: it is flat at its samples.

    Gordon & Wixom 1978 (Mathematics of Computation 32, 253-264): for p > 1 its gradient is zero at every sample, so no
    line is reproduced. From 100 to 400 samples the grid's step falls by 9/19 = 0.47. With p up to the number of joints,
    2, distant samples keep a weight that does not vanish with their number, and the error does not fall like that.
    """
    rig = Rig.load("aqua2")
    coarse, fine = (corner_error(rig, count, 4.0, 60).rms_px for count in (100, 400))
    assert fine / coarse == pytest.approx(9 / 19, abs=0.02)  # the edges' share of the range falls too
    slow = [corner_error(rig, count, 1.0, 60).rms_px for count in (100, 400)]
    assert slow[1] / slow[0] > 0.9


def test_samples_of_a_rig_stand_on_its_joints_range():
    rig = Rig.load("aqua2")
    samples = exact_samples(rig, 3, 5)
    assert (samples.q == pose_grid(rig, 3, 5)).all()
    np.testing.assert_allclose(np.degrees(samples.q[[0, -1]]), [[-77.5, -32.5], [77.5, 122.5]], atol=1e-12)


@pytest.mark.parametrize("count", [1, 26, 0])
def test_sample_count_is_a_square(count):
    with pytest.raises(ValueError, match=f"expected a square number of samples from 4, got {count}"):
        corner_error(Rig.load("aqua2"), count, 2.0)
