"""Which way the joints move the crop, and how far: against the exact train, on both branches of tilt."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optics.gaze.jacobian import direction_jacobian
from optics.layout import Layout
from rigs import Rig
from tracking.control.crop_scale import centroid_motion, crop_scale, level_pose
from tracking.estimation.lines_of_sight import LinesOfSight
from tracking.perception import Crop, ExactCorners

AQUA2 = Rig.load("aqua2")
UP = AQUA2.with_gaze(
    fold_mirror={"direction": "up"},
    joints={
        name: joint.model_copy(update={"min_deg": -joint.max_deg, "max_deg": -joint.min_deg})
        for name, joint in (("pan", AQUA2.gaze.joints.pan), ("tilt", AQUA2.gaze.joints.tilt))
    },
)
REVERSED = AQUA2.with_gaze(
    joints={
        "pan": AQUA2.gaze.joints.pan.model_copy(update={"sign": -1}),
        "tilt": AQUA2.gaze.joints.tilt.model_copy(update={"sign": -1, "min_deg": -122.5, "max_deg": 32.5}),
    }
)
RIGS = {"down": AQUA2, "up": UP, "reversed": REVERSED}
FAR_M = 1e4
"""A distance at which the parallax of the mirror's own motion is nothing."""

STEP = 1e-4


class View:
    def __init__(self, rig: Rig):
        self.lines, self.corners = LinesOfSight(rig, FAR_M), ExactCorners(rig)

    def crop_at(self, q: np.ndarray) -> Crop:
        return Crop.of(self.corners.corners(q))

    def in_crop(self, direction: np.ndarray, q: np.ndarray) -> np.ndarray:
        return self.crop_at(q).from_image([self.lines.pixel(direction, q)])[0]


@pytest.mark.parametrize("name", RIGS)
@pytest.mark.parametrize("tilt_deg", [-10.0, 0.0, 30.0, 60.0, 90.0, 110.0])
def test_a_still_target_moves_through_the_crop_as_b_says(name, tilt_deg):
    """Central differences of the crop position of a far point on the axis, beyond the zenith (45 degrees) as well.

    The scale is that of the pose itself; what is left is that it is a mean over the crop's middle half, and that the
    crop stretches with tilt: 4 % at -10 degrees, the most foreshortened.
    """
    view = View(RIGS[name])
    q = view.lines.gimbal.joint_values(0.3, math.radians(tilt_deg))
    direction = view.lines.gimbal.gaze(q)
    found = np.column_stack(
        [
            (view.in_crop(direction, q + step) - view.in_crop(direction, q - step)) / (2 * STEP)
            for step in STEP * np.eye(2)
        ]
    )
    expected = centroid_motion(view.lines.gimbal, crop_scale(view.lines, view.crop_at, q), q)
    np.testing.assert_allclose(found, expected, rtol=0.04, atol=0.02 * np.abs(expected).max())
    assert np.sign(found[0, 0]) == view.lines.gimbal.signs[0] * np.sign(math.cos(2 * math.radians(tilt_deg)))
    assert np.sign(found[1, 1]) == view.lines.gimbal.signs[1]


@pytest.mark.parametrize("tilt_deg", [0.0, 30.0, 60.0, 90.0])
def test_the_crops_axes_are_the_jacobians_columns(tilt_deg):
    """The gaze turns to crop-right by -cos 2t a radian of pan and to crop-up by 2 a radian of tilt, on both branches.

    Crop-right and crop-up as directions in the world: those that the rays of the crop's middle run to.
    """
    view, layout = View(AQUA2), Layout.from_rig(AQUA2)
    tilt = math.radians(tilt_deg)
    q = view.lines.gimbal.joint_values(0.3, tilt)
    centre = np.array(view.crop_at(q).centre_px)
    at = lambda offset: view.lines.direction(view.crop_at(q).to_image([centre + offset])[0], q)  # noqa: E731
    right, up = (at(np.array(axis)) - at(-np.array(axis)) for axis in ([2.0, 0.0], [0.0, -2.0]))
    jacobian = direction_jacobian(layout, *q)
    # Along the axes to a few thousandths: the crop's homography meets M2's edges, not its middle lines.
    assert jacobian[:, 0] @ right / np.linalg.norm(right) == pytest.approx(-math.cos(2 * tilt), abs=0.01)
    assert jacobian[:, 1] @ up / np.linalg.norm(up) == pytest.approx(2.0, abs=0.01)


def test_over_the_zenith_the_crop_stands_upside_down_in_the_world():
    view = View(AQUA2)
    for tilt_deg, upright in ((0.0, True), (90.0, False)):
        q = view.lines.gimbal.joint_values(0.0, math.radians(tilt_deg))
        crop = view.crop_at(q)
        top, bottom, left, right = (
            view.lines.direction(crop.to_image([point])[0], q)
            for point in ([159.5, 60.0], [159.5, 180.0], [80.0, 119.5], [240.0, 119.5])
        )
        assert (top[2] > bottom[2]) == upright
        # To the right of who looks along the gaze, upright: its azimuth falls. A half turn of the image keeps that
        # true for the image, so in the world right and left change places.
        gaze = view.lines.gimbal.gaze(q)
        world_right = np.cross(gaze, [0.0, 0.0, 1.0])
        assert ((right - left) @ world_right > 0) == upright


def test_the_scale_is_the_view_of_the_mirrors_middle_half():
    """M2 is 80 mm wide, the virtual camera d1 + d2 = 220 mm and the port's 6 mm behind its middle.

    `docs/explanation/gaze.md` has both.

    The middle half is 2 atan(20 / 226) wide, over 160 pixels. The crop hangs on the corners, which the flat port draws
    apart by (n^2 - 1) / 2 sin^2 of their angle, 13 degrees: 2 %.
    """
    view = View(AQUA2)
    q = level_pose(view.lines.gimbal)
    np.testing.assert_allclose(q, 0, atol=1e-15)
    scale = crop_scale(view.lines, view.crop_at, q)
    assert scale[0] == pytest.approx(2 * math.atan(20 / 226) / 160, rel=0.025)


def test_a_level_pose_keeps_to_the_limits():
    joints = AQUA2.gaze.joints.model_copy(update={"tilt": AQUA2.gaze.joints.tilt.model_copy(update={"min_deg": 10.0})})
    lines = LinesOfSight(AQUA2.with_gaze(joints=joints))
    np.testing.assert_allclose(np.degrees(level_pose(lines.gimbal)), [0, 10])


def test_a_mirror_that_is_not_seen_has_no_scale():
    view = View(AQUA2)
    assert np.isnan(crop_scale(view.lines, lambda q: Crop.of(np.full((4, 2), np.nan)), np.zeros(2))).all()
