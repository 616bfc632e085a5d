"""Clusters: eq. 7 on the paper's figure 10, the filters by closed form, and images of the tank."""

import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform

from dives.calibration.corner_collection import collect_samples
from rigs import Rig
from scenes.baking.light_quality import LightQuality
from scenes.baking.lit_scene import prepare
from scenes.renderer import FastRenderer
from scenes.sensor import ImageSensor, capture, frame_key, settled_settings
from scenes.stage.frame import Label
from scenes.stage.scene import make_scene, on_gaze
from tracking.perception import (
    RED_BALL,
    Crop,
    DetectorSettings,
    ExactCorners,
    detect,
    find_blobs,
    taken,
    weighted_centroid,
)
from tracking.records import Blob

ROUNDING_PX = 1e-9
ALL = DetectorSettings(area_min_px=1, circularity_min=0, aspect_max=99)
PLAIN = DetectorSettings(smoothing_px=1, opening_px=1, closing_px=1)

RED, BLUE = (80, 50, 55), (40, 60, 90)


def mask_of(*boxes, shape=(240, 320)):
    """Boxes (x, y, width, height) in a mask."""
    mask = np.zeros(shape, dtype=np.uint8)
    for x, y, width, height in boxes:
        mask[y : y + height, x : x + width] = 255
    return mask


def blob(area, centre):
    return Blob(area_px=area, centroid_px=centre, box_px=(0, 0, 1, 1), circularity=1.0)


def test_figure_10():
    """Blobs of 156 and 256 px: the centroid is on the line between theirs, 256 / 412 of the way to the larger."""
    small, large = (100, 20, 12, 13), (200, 100, 16, 16)
    blobs = find_blobs(mask_of(small, large), PLAIN)
    assert [each.area_px for each in blobs] == [256, 156]
    first, second = np.array([105.5, 26.0]), np.array([207.5, 107.5])
    np.testing.assert_allclose(weighted_centroid(blobs), first + 256 / (156 + 256) * (second - first), atol=ROUNDING_PX)
    crop = np.full((240, 320, 3), BLUE, dtype=np.uint8)
    crop[mask_of(small, large) > 0] = RED
    found = detect(crop, PLAIN)
    assert found.blobs == blobs
    assert found.centroid_px == weighted_centroid(blobs)


@given(
    areas=st.lists(st.floats(1, 1e4), min_size=1, max_size=6), shift=st.tuples(st.floats(-50, 50), st.floats(-50, 50))
)
def test_weighted_centroid_moves_with_its_blobs(areas, shift):
    places = np.random.default_rng(len(areas)).uniform(0, 200, (len(areas), 2))
    here = weighted_centroid([blob(a, tuple(p)) for a, p in zip(areas, places, strict=True)])
    there = weighted_centroid([blob(a, tuple(p + shift)) for a, p in zip(areas, places, strict=True)])
    np.testing.assert_allclose(np.array(there) - here, shift, atol=ROUNDING_PX)
    np.testing.assert_allclose(here, np.average(places, axis=0, weights=areas), atol=ROUNDING_PX)


def test_nothing_has_no_centroid():
    assert weighted_centroid([]) is None
    assert find_blobs(np.zeros((240, 320), dtype=np.uint8), ALL) == ()
    found = detect(np.zeros((240, 320, 3), dtype=np.uint8))
    assert found.blobs == () and found.centroid_px is None and not found.mask.any()
    assert detect(np.zeros((1, 1, 3), dtype=np.uint8)).blobs == ()


def test_what_is_taken_of_a_detection_is_blobs_with_their_part_of_the_mask():
    boxes = (100, 20, 12, 13), (200, 100, 16, 16)
    crop = np.full((240, 320, 3), BLUE, dtype=np.uint8)
    crop[mask_of(*boxes) > 0] = RED
    found = detect(crop, PLAIN)
    one = taken(found, found.blobs[1:])
    assert one.blobs == found.blobs[1:] and one.centroid_px == found.blobs[1].centroid_px
    np.testing.assert_array_equal(one.mask, mask_of(boxes[0]))
    assert taken(found, found.blobs) is found


def test_pixels_that_touch_at_a_corner_are_one_cluster():
    found = find_blobs(mask_of((10, 10, 2, 2), (12, 12, 2, 2)), ALL)
    assert [(each.area_px, each.box_px, each.centroid_px) for each in found] == [(8, (10, 10, 4, 4), (11.5, 11.5))]


def test_holes_belong_to_the_outline_but_not_to_the_area():
    mask = mask_of((10, 10, 30, 30))
    mask[20:25, 20:25] = 0
    (found,) = find_blobs(mask, ALL)
    assert found.area_px == 900 - 25
    # The hole's middle is (22, 22), the square's (24.5, 24.5).
    np.testing.assert_allclose(found.centroid_px, [(900 * 24.5 - 25 * 22) / 875] * 2, atol=ROUNDING_PX)
    assert found.circularity == find_blobs(mask_of((10, 10, 30, 30)), ALL)[0].circularity


@pytest.mark.parametrize(("width", "height"), [(1, 1), (16, 16), (30, 10), (7, 1)])
def test_circularity_of_rectangles(width, height):
    """Closed form: the contour through the pixels' middles, as long as Kulpa has it, half a pixel out (Steiner)."""
    a, b = width - 1, height - 1
    perimeter = math.pi / 8 * (1 + math.sqrt(2)) * 2 * (a + b)
    area = a * b + perimeter / 2 + math.pi / 4
    expected = 4 * math.pi * area / (perimeter + math.pi) ** 2
    (found,) = find_blobs(mask_of((50, 60, width, height)), ALL)
    assert found.circularity == pytest.approx(expected, rel=1e-6)  # OpenCV's lengths are single precision


@pytest.mark.parametrize("radius", [4, 10, 40])
def test_discs_are_round(radius):
    """Kulpa's factor is a mean over directions, exact for large circles; steps at the rim of small ones remain."""
    v, u = np.indices((240, 320))
    mask = np.where((u - 150) ** 2 + (v - 100) ** 2 <= radius**2, 255, 0).astype(np.uint8)
    (found,) = find_blobs(mask, ALL)
    assert found.circularity == pytest.approx(1, abs=0.02 + 0.5 / radius)
    np.testing.assert_allclose(found.centroid_px, [150, 100], atol=ROUNDING_PX)
    assert found.area_px == (mask > 0).sum()


@pytest.mark.parametrize(
    ("settings", "left"),
    [
        (ALL, 3),
        (DetectorSettings(area_min_px=101, circularity_min=0, aspect_max=99), 2),
        (DetectorSettings(area_min_px=1, circularity_min=0.6, aspect_max=99), 1),
        (DetectorSettings(area_min_px=1, circularity_min=0, aspect_max=3), 2),
    ],
)
def test_filters(settings, left):
    """A square of 100 px, a bar ten times as long as wide, and an L whose box is square."""
    mask = mask_of((10, 10, 10, 10), (50, 10, 60, 6), (150, 10, 6, 60), (150, 64, 60, 6))
    assert len(find_blobs(mask, settings)) == left


def test_largest_comes_first_and_ties_are_settled():
    boxes = [(60, 50, 10, 10), (20, 50, 10, 10), (100, 100, 20, 20)]
    assert [each.box_px for each in find_blobs(mask_of(*boxes), ALL)] == [boxes[2], boxes[1], boxes[0]]


def test_detection_turns_with_the_image():
    """Half a turn of the crop is half a turn of what is found: no pixel is preferred."""
    crop = np.full((240, 320, 3), BLUE, dtype=np.uint8)
    cv2.circle(crop, (100, 80), 15, RED, -1)
    cv2.ellipse(crop, (220, 150), (20, 12), 30, 0, 360, RED, -1)
    found, turned = detect(crop), detect(np.ascontiguousarray(crop[::-1, ::-1]))
    np.testing.assert_allclose(np.array(turned.centroid_px), np.array([319, 239]) - found.centroid_px, atol=ROUNDING_PX)


@pytest.mark.parametrize("crop", [np.zeros((10, 10, 3)), np.zeros((10, 10), dtype=np.uint8), None])
def test_anything_but_a_image_is_refused(crop):
    with pytest.raises(ValueError, match="expected crop of uint8, shape"):
        detect(crop)


@pytest.fixture(scope="module")
def tank():
    """Mirrors alone: what is looked at is known exactly."""
    rig = Rig.load("aqua2")
    return FastRenderer(prepare(make_scene(rig), rig, [], quality=LightQuality.coarse()))


@pytest.mark.parametrize(("q_deg", "distance_m"), [((0.0, -10.0), 2.0), ((-60.0, -5.0), 3.0), ((20.0, 100.0), 2.5)])
def test_ball_is_found_in_the_tank(tank, q_deg, distance_m):
    """Within half a radius of where ground truth has it, in the image that the rig's image sensor takes."""
    rig, place = tank.rig, tank.scene.world_from_body
    q1, q2 = np.radians(q_deg)
    target = RigidTransform.from_translation(place.apply(on_gaze(rig, q1=q1, q2=q2, distance_m=distance_m)))
    frame = tank.render(q1=q1, q2=q2, world_from_target=target)
    sensor = ImageSensor.from_rig(rig)
    exposure = settled_settings(frame.radiance, sensor, card_radiance=tank.scene.light.white_radiance(5.0))
    crop = Crop.of(ExactCorners(rig).corners([q1, q2]))
    found = detect(crop.take(capture(frame.radiance, sensor, exposure, frame_key(0, 0)).image), RED_BALL)
    v, u = np.nonzero(frame.label == Label.TARGET)
    ball = crop.from_image(np.column_stack([u, v]))
    radius = math.sqrt(np.ptp(ball[:, 0]) * np.ptp(ball[:, 1])) / 2
    assert len(found.blobs) == 1
    assert math.dist(found.centroid_px, ball.mean(axis=0)) < radius / 2


def test_samples_are_collected_from_images_of_the_tank(tank):
    """Outlines without an edge along the pixels' rows: rounding leaves 0.29 px rms a point, a few hundredths a side."""
    q = np.radians([[25.0, 0.0], [-40.0, -10.0], [10.0, 30.0], [-20.0, 60.0]])
    samples = collect_samples(tank, q)
    assert (samples.q == q).all()
    away = np.linalg.norm(samples.corners_px - ExactCorners(tank.rig).corners(q), axis=-1)
    assert away.max() < 0.2


def test_poses_to_collect_are_checked(tank):
    with pytest.raises(ValueError, match=r"expected q of shape \(n, 2\), got \(3,\)"):
        collect_samples(tank, [1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="expected at least 4 samples, got 1"):
        collect_samples(tank, [[0.4, 0.0]])
