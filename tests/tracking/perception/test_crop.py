"""The crop: pixel centres by closed form, and its handedness through the whole exact train."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optics.gaze.kinematics import forward_gaze
from optics.layout import Layout
from optics.mirror_outline import Ellipse, Octagon
from optics.train import OpticalTrain
from rigs import Rig
from tracking.perception import Crop, ExactCorners

HOMOGRAPHY_PX = 2e-4
"""OpenCV solves for a homography from single-precision corners: some 3e-5 px, magnified by the inverse."""

GREY_LEVELS = 1
"""OpenCV's bilinear weights and rounding."""

SMALL_DEG = 3.0
SIDEWAYS = 0.2
"""What is level in the world is level in the crop up to perspective and the turn within a few degrees of azimuth."""

corner = st.floats(-30, 30)


@given(shifts=st.lists(corner, min_size=8, max_size=8), width=st.integers(40, 500), height=st.integers(40, 400))
def test_outline_is_the_border_of_the_crop(shifts, width, height):
    """The border of the outermost pixels, half a pixel beyond their centres."""
    corners = np.array([[150.0, 80], [500, 90], [480, 400], [140, 390]]) + np.reshape(shifts, (4, 2))
    crop = Crop.of(corners, width, height)
    border = [[-0.5, -0.5], [width - 0.5, -0.5], [width - 0.5, height - 0.5], [-0.5, height - 0.5]]
    np.testing.assert_allclose(crop.to_image(border), corners, atol=HOMOGRAPHY_PX)
    points = np.random.default_rng(0).uniform(-0.5, [width, height], (20, 2))
    np.testing.assert_allclose(crop.from_image(crop.to_image(points)), points, atol=HOMOGRAPHY_PX)


def test_crop_of_the_same_size_is_a_copy():
    """Closed form: a rectangle of pixels taken pixel by pixel, not half a pixel beside."""
    image = np.random.default_rng(1).integers(0, 256, (60, 80, 3), dtype=np.uint8)
    left, top, width, height = 20, 10, 40, 30
    right, bottom = left + width - 0.5, top + height - 0.5
    crop = Crop.of([[left - 0.5, top - 0.5], [right, top - 0.5], [right, bottom], [left - 0.5, bottom]], width, height)
    assert (crop.take(image) == image[top : top + height, left : left + width]).all()


def test_ramp_is_sampled_where_the_map_says():
    """Bilinear sampling of a linear image is exact."""
    v, u = np.indices((240, 320))
    image = np.stack([u * 0.7, v, (u + v) * 0.4], axis=-1)
    crop = Crop.of([[40, 30], [250, 50], [240, 200], [60, 190]], 100, 80)
    y, x = np.indices((80, 100))
    u, v = crop.to_image(np.column_stack([x.ravel(), y.ravel()])).T
    expected = np.stack([u * 0.7, v, (u + v) * 0.4], axis=-1).reshape(80, 100, 3)
    found = crop.take(np.rint(image).astype(np.uint8))
    assert np.abs(found - expected).max() <= GREY_LEVELS + 0.5


@pytest.mark.parametrize("kind", [Octagon, Ellipse])
def test_beside_the_mirror_is_black_and_its_rim_is_where_the_crop_maps_it(kind):
    """Its area in closed form, in pixels of the crop; its rim in the image beside the crop's border."""
    outline = kind(half_width=4.0, half_height=3.0)
    corners = np.array([[50.5, 20.5], [370.5, 20.5], [370.5, 260.5], [50.5, 260.5]])
    crop = Crop.of(corners, 320, 240, outline)
    shown = crop.take(np.full((300, 400, 3), 200, dtype=np.uint8))[..., 0] == 200
    # Pixels of the rim, some 1000, are in or out by their centres.
    assert shown.sum() == pytest.approx(40 * 40 * outline.area_m2, abs=100)
    x, y = (crop.rim_px() - [210.5, 140.5]).T / 40
    np.testing.assert_allclose(np.max(outline.beyond(x, y), axis=0), 0, atol=HOMOGRAPHY_PX)


def test_outside_the_image_is_black():
    image = np.full((100, 100, 3), 200, dtype=np.uint8)
    crop = Crop.of([[-50.5, -0.5], [99.5, -0.5], [99.5, 99.5], [-50.5, 99.5]], 150, 100).take(image)
    assert (crop[:, :50] == 0).all() and (crop[:, 51:] == 200).all()


@pytest.mark.parametrize("shift", [(-500.0, 0.0), (500.0, 0.0), (0.0, -500.0), (0.0, 500.0), (500.0, 500.0)])
def test_a_crop_beside_the_image_is_black(shift):
    corners = np.array([[9.5, 9.5], [89.5, 9.5], [89.5, 89.5], [9.5, 89.5]]) + shift
    assert not Crop.of(corners, 32, 24).take(np.full((100, 100, 3), 200, dtype=np.uint8)).any()


@pytest.mark.parametrize(
    "corners",
    [
        np.full((4, 2), np.nan),
        [[0, 0], [10, 0], [10, np.nan], [0, 10]],
        [[0, 0], [0, 10], [10, 10], [10, 0]],  # the other way round: a mirror image
        [[0, 0], [10, 10], [10, 0], [0, 10]],  # crossed
        [[0, 0], [5, 0], [10, 0], [0, 10]],  # three in a line
        np.zeros((4, 2)),
    ],
)
def test_no_mirror_gives_an_empty_crop(corners):
    crop = Crop.of(corners, 32, 24)
    assert crop.empty
    taken = crop.take(np.full((50, 50, 3), 99, dtype=np.uint8))
    assert taken.shape == (24, 32, 3) and not taken.any()
    assert np.isnan(crop.to_image([[1, 1]])).all() and np.isnan(crop.from_image([[1, 1]])).all()


@pytest.mark.parametrize(
    "image",
    [
        np.zeros((10, 10), dtype=np.uint8),
        np.zeros((10, 10, 4), dtype=np.uint8),
        np.zeros((10, 10, 3)),
        np.zeros((0, 10, 3), dtype=np.uint8),
        None,
    ],
)
def test_anything_but_a_image_is_refused(image):
    with pytest.raises(ValueError, match="expected image of uint8, shape"):
        Crop.of([[0, 0], [9, 0], [9, 9], [0, 9]]).take(image)


def test_bad_arguments_are_refused():
    with pytest.raises(ValueError, match=r"expected corners_px of shape \(4, 2\), got \(3, 2\)"):
        Crop.of(np.zeros((3, 2)))
    with pytest.raises(ValueError, match="at least 1 x 1 px, got 0 x 240"):
        Crop.of([[0, 0], [9, 0], [9, 9], [0, 9]], 0)
    with pytest.raises(ValueError, match=r"expected points of shape \(n, 2\), got \(2,\)"):
        Crop.of([[0, 0], [9, 0], [9, 9], [0, 9]]).to_image([1, 1])


def folding_up(rig):
    """The same rig, folding up, its joints' limits reversed."""
    limits = {
        name: joint.model_copy(update={"min_deg": -joint.max_deg, "max_deg": -joint.min_deg})
        for name, joint in (("pan", rig.gaze.joints.pan), ("tilt", rig.gaze.joints.tilt))
    }
    fold = rig.gaze.fold_mirror.model_copy(update={"direction": "up"})
    return rig.with_gaze(fold_mirror=fold, joints=limits)


RIGS = {"aqua2": Rig.load("aqua2"), "bluerov2": Rig.load("bluerov2"), "folding up": folding_up(Rig.load("aqua2"))}
FORWARD = [(0.0, 0.0), (30.0, -10.0), (-60.0, 5.0), (70.0, 30.0), (-20.0, -25.0)]
BACKWARD = [(0.0, 100.0), (40.0, 70.0), (-60.0, 110.0)]


def seen_in_crop(rig, q_deg, azimuth_deg, elevation_deg):
    """Where something 3 m away, so far to the left and above the gaze, is in the crop, from its centre."""
    q = np.radians(q_deg)
    layout = Layout.from_rig(rig)
    gaze = forward_gaze(layout, *q)
    azimuth, elevation = gaze.azimuth + np.radians(azimuth_deg), gaze.elevation + np.radians(elevation_deg)
    direction = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    # From where the virtual camera's axis passes: all of it is behind the mirror's centre.
    place = layout.body_from_camera.inv().apply(layout.body_from_gimbal.translation + 3 * np.array(direction))
    pixel = OpticalTrain.from_rig(rig, q1=q[0], q2=q[1]).project([place]).pixels
    crop = Crop.of(ExactCorners(rig).corners(q))
    return crop.from_image(pixel)[0] - crop.centre_px


@pytest.mark.parametrize("name", RIGS)
@pytest.mark.parametrize("branch", [*((pose, 1) for pose in FORWARD), *((pose, -1) for pose in BACKWARD)])
def test_right_is_right_and_down_is_down(name, branch):
    """To the right of the gaze (azimuth falls) is right in the crop, below it is lower; over the zenith both turn over.

    A gaze that has gone over the zenith looks back upside down, as a neck bent backwards would: the crop is the virtual
    camera's image, turned, and no mirror image of it.
    """
    (q1, q2), sense = branch
    q_deg = (-q1, -q2) if name == "folding up" else (q1, q2)
    x, y = seen_in_crop(RIGS[name], q_deg, -SMALL_DEG, 0.0)
    assert sense * x > 5
    assert abs(y) < SIDEWAYS * abs(x)
    x, y = seen_in_crop(RIGS[name], q_deg, 0.0, -SMALL_DEG)
    assert sense * y > 5
    assert abs(x) < SIDEWAYS * abs(y)
