"""Where pixels look by the table, and which joint values bring a direction to a pixel: beside the traced train."""

import numpy as np
import pytest

from optics import OpticalTrain
from optics.gaze.kinematics import fold_reflection, forward_gaze, inverse_gaze, inverse_reflection
from optics.gaze.sights import Sights
from optics.layout import Layout, camera_pose
from optics.status import Region
from rigs import Rig

TABLE_DEG = 0.015
"""What the table loses between its pixels, and rounding."""
MIRRORS = {Region.DIRECT: 0, Region.FOLD: 1, Region.GAZE: 2}


@pytest.fixture(scope="module", params=["aqua2", "bluerov2"])
def rig(request):
    return Rig.load(request.param)


def traced(rig, pixel, q_deg, mirrors):
    """Direction of a pixel behind some mirrors of the train, all without edges, body frame."""
    q1, q2 = np.radians(q_deg)
    train = OpticalTrain.from_rig(rig, q1=float(q1), q2=float(q2)).unbounded()
    rays = OpticalTrain(camera=train.camera, port=train.port, mirrors=train.mirrors[:mirrors]).trace([pixel])
    return rays.moved(camera_pose(rig.camera)).direction[0]


def apart_deg(a, b):
    return np.degrees(2 * np.arcsin(np.linalg.norm(a - b) / 2))


@pytest.mark.parametrize("region", MIRRORS)
def test_pixels_look_where_they_are_traced(rig, region):
    q_deg, size = (21.0, -9.0), np.array([rig.camera.width_px, rig.camera.height_px])
    sights, layout = Sights.of(rig), Layout.from_rig(rig)
    for share in ((0.31, 0.43), (0.72, 0.61), (0.0, 0.0)):
        pixel = share * (size - 1)
        seen = sights.seen(layout, pixel, region, *np.radians(q_deg))
        assert apart_deg(seen, traced(rig, pixel, q_deg, MIRRORS[region])) < TABLE_DEG


def test_outside_of_the_image_there_is_no_direction(rig):
    assert np.isnan(Sights.of(rig).at((-2.0, 10.0))).all()


def test_a_direction_is_brought_to_another_pixel(rig):
    layout, size = Layout.from_rig(rig), np.array([rig.camera.width_px, rig.camera.height_px])
    first, second = 0.4 * size, 0.55 * size
    grabbed = traced(rig, first, (12.0, -6.0), 2)
    incoming = fold_reflection(layout, traced(rig, second, (0.0, 0.0), 0))
    found = np.degrees(inverse_reflection(layout, incoming, grabbed))
    assert len(found)
    for q_deg in found:
        assert apart_deg(traced(rig, second, q_deg, 2), grabbed) < 1e-6


def test_of_the_optical_axis_it_is_the_inverse_gaze(rig):
    layout = Layout.from_rig(rig)
    axis = fold_reflection(layout, layout.body_from_camera.rotation.apply([0.0, 0.0, 1.0]))
    q1, q2 = np.radians([17.0, 11.0])
    gaze = forward_gaze(layout, q1, q2)
    found = inverse_reflection(layout, axis, gaze.direction)
    np.testing.assert_allclose(found, inverse_gaze(layout, float(gaze.azimuth), float(gaze.elevation)), atol=1e-9)
