"""Pixels to directions and back: the exact train, in a form that is fast enough for one ray an image."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optics import OpticalTrain, Status
from optics.gaze.kinematics import forward_gaze, gaze_mirror_normal
from optics.layout import Layout
from rigs import Rig
from tracking.estimation.gimbal import Gimbal
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.perception import Crop, ExactCorners

ROUNDING_M = 1e-12
"""Of points within half a metre, after a few dozen operations."""

PROMISE_PX = 1e-9
"""Of a projected pixel: the project's own bound (`docs/explanation/optics.md`)."""


def folding_up(rig: Rig) -> Rig:
    limits = {
        name: joint.model_copy(update={"min_deg": -joint.max_deg, "max_deg": -joint.min_deg})
        for name, joint in (("pan", rig.gaze.joints.pan), ("tilt", rig.gaze.joints.tilt))
    }
    return rig.with_gaze(fold_mirror={"direction": "up"}, joints=limits)


AQUA2 = Rig.load("aqua2")
RIGS = {"aqua2": AQUA2, "bluerov2": Rig.load("bluerov2"), "torpedo": Rig.load("torpedo"), "up": folding_up(AQUA2)}
LINES = {name: LinesOfSight(rig) for name, rig in RIGS.items()}
CORNERS = {name: ExactCorners(rig) for name, rig in RIGS.items()}
POSES = st.tuples(st.floats(0.05, 0.95), st.floats(0.05, 0.95))
CROP_POINTS = st.tuples(st.floats(60.0, 260.0), st.floats(50.0, 190.0))


def pose(name: str, shares: tuple[float, float]) -> np.ndarray:
    gimbal = LINES[name].gimbal
    return gimbal.lowest + shares * (gimbal.highest - gimbal.lowest)


@pytest.mark.parametrize("name", RIGS)
@given(shares=POSES)
def test_the_plain_kinematics_are_those_of_optics(name, shares):
    layout, gimbal = Layout.from_rig(RIGS[name]), LINES[name].gimbal
    q = pose(name, shares)
    np.testing.assert_allclose(gimbal.gaze(q), forward_gaze(layout, *q).direction, atol=1e-14)
    np.testing.assert_allclose(gimbal.normal(q), gaze_mirror_normal(layout, *q), atol=1e-14)
    np.testing.assert_allclose(gimbal.joint_values(*gimbal.angles(q)), q, atol=1e-15)
    np.testing.assert_allclose(
        gimbal.in_gimbal(gimbal.gaze(q)), layout.body_from_gimbal.rotation.inv().apply(gimbal.gaze(q)), atol=1e-15
    )


@pytest.mark.parametrize("name", RIGS)
@given(shares=POSES, point=CROP_POINTS)
def test_a_ray_is_the_trains(name, shares, point):
    q = pose(name, shares)
    crop = Crop.of(CORNERS[name].corners(q))
    if crop.empty:
        return
    pixel = crop.to_image([point])[0]
    body_from_camera = Layout.from_rig(RIGS[name]).body_from_camera
    traced = OpticalTrain.from_rig(RIGS[name], q1=q[0], q2=q[1]).trace([pixel])
    ray = LINES[name].ray(pixel, q)
    assert (ray is not None) == (traced.status[0] == Status.OK)
    if ray is not None:
        np.testing.assert_allclose(ray.origin_m, body_from_camera.apply(traced.origin_m[0]), atol=ROUNDING_M)
        turned = body_from_camera.rotation.apply(traced.direction[0])
        np.testing.assert_allclose(ray.direction, turned, atol=ROUNDING_M)


@pytest.mark.parametrize("name", RIGS)
@given(shares=POSES, point=CROP_POINTS, distance_m=st.floats(0.5, 20.0))
def test_a_direction_is_that_of_the_point_that_the_train_projects_to_the_pixel(name, shares, point, distance_m):
    """Both ways: to the distance assumed, and back to the pixel."""
    lines = LinesOfSight(RIGS[name], distance_m)
    q = pose(name, shares)
    crop = Crop.of(CORNERS[name].corners(q))
    pixel = None if crop.empty else crop.to_image([point])[0]
    direction = None if pixel is None else lines.direction(pixel, q)
    if direction is None:
        return
    assert np.linalg.norm(direction) == pytest.approx(1, abs=1e-14)
    layout = Layout.from_rig(RIGS[name])
    target = layout.body_from_camera.inv().apply(lines.centre_m + distance_m * direction)
    image = OpticalTrain.from_rig(RIGS[name], q1=q[0], q2=q[1]).project([target])
    np.testing.assert_allclose(image.pixels[0], pixel, atol=PROMISE_PX)
    np.testing.assert_allclose(lines.pixel(direction, q), pixel, atol=PROMISE_PX)


@pytest.mark.parametrize("q", [(0.0, 0.0), (0.5, 0.2), (-0.9, 1.3)])
def test_the_axis_goes_through_the_centre_whatever_the_distance(q):
    """The pixel of the principal point meets the flat port at right angles: its ray is the gaze, without parallax."""
    lines, axis = LINES["aqua2"], [319.5, 239.5]
    np.testing.assert_allclose(lines.direction(axis, q), lines.gimbal.gaze(q), atol=1e-14)
    # An arc tangent of rounding over one.
    assert lines.parallax(axis, q, 0.5) < 1e-13


@pytest.mark.parametrize(("distance_m", "edge_deg"), [(0.5, 3.41), (1.0, 1.14), (2.0, 0.0), (4.0, 0.57), (1e6, 1.14)])
def test_a_wrong_distance_costs_parallax_at_the_edge_of_the_crop_and_none_on_the_axis(distance_m, edge_deg):
    """A ray leaves M2 up to `a` beside its centre: the direction is off by a (1 / distance - 1 / assumed).

    The ray of the crop's edge comes from the edge of M2, 40 mm from its middle: a = 40 mm cos(11 degrees), so that
    2 m assumed for 1 m costs 0.039 (1 / 1 - 1 / 2) rad = 1.13 degrees; the ray is not straight across, hence 1 %.
    """
    lines, q = LINES["aqua2"], (0.3, 0.1)
    edge = Crop.of(CORNERS["aqua2"].corners(q)).to_image([[319.0, 119.5]])[0]
    found = math.degrees(lines.parallax(edge, q, distance_m))
    assert found == pytest.approx(edge_deg, abs=0.01)
    first_order = 0.04 * math.cos(math.radians(11.2)) * abs(1 / distance_m - 1 / 2)
    assert math.radians(found) == pytest.approx(first_order, rel=0.02, abs=1e-9)


def test_what_is_not_over_the_mirror_has_no_ray_and_what_is_behind_it_no_pixel():
    lines = LINES["aqua2"]
    assert lines.ray([-200.0, 239.5], (0.0, 0.0)) is None
    assert lines.direction([float("nan"), 239.5], (0.0, 0.0)) is None
    assert lines.pixel(-lines.gimbal.normal((0.0, 0.0)), (0.0, 0.0)) is None
    assert math.isnan(lines.parallax([-200.0, 239.5], (0.0, 0.0), 1.0))


def test_a_distance_must_be_one():
    with pytest.raises(ValueError, match="expected a distance above 0 m, got 0"):
        LinesOfSight(AQUA2, 0.0)


def test_the_joint_limits_are_the_rigs():
    gimbal = Gimbal(Layout.from_rig(RIGS["up"]))
    np.testing.assert_allclose(np.degrees([gimbal.lowest, gimbal.highest]), [[-77.5, -122.5], [77.5, 32.5]])
    np.testing.assert_allclose(np.degrees(gimbal.limits(1)), [-32.5, 122.5])
    np.testing.assert_array_equal(gimbal.signs, [1, 1])
