"""Boxes, fractions of the ball, run lengths and masks."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from optics.status import Region
from optics.train import OpticalTrain, pixel_grid
from scenes.stage.frame import Label
from scenes.truth import ground_truth, write_truth
from scenes.truth.boxes import things
from scenes.truth.coco import coco_document, mask_of_runs, run_lengths
from scenes.truth.masks import mask_images, masks

SHAPE = (120, 160)
RADIUS = 0.15
BALL = (1.9, 0.0, -4.1)


@pytest.fixture(scope="module")
def ball_in_gaze(plain, make_state, aqua2):
    """A ball that the gaze mirror holds as a whole."""
    state = make_state(0.0, 0.0, ball=BALL)
    return ground_truth(
        plain(aqua2, state, SHAPE), aqua2, state, target_radius_m=RADIUS, instance_names=list("abcdefg")
    )


def test_box_is_as_tight_as_can_be(ball_in_gaze):
    """By hand: first and last row and column of each label, instance and region."""
    found, number = things(ball_in_gaze)
    frame = ball_in_gaze.frame
    assert {(thing.label, thing.region) for thing in found} >= {(Label.TARGET, Region.GAZE), (Label.WORLD, Region.FOLD)}
    for position, thing in enumerate(found):
        here = (frame.label == thing.label) & (frame.instance == thing.instance) & (frame.region == thing.region)
        v, u = np.nonzero(here)
        assert thing.box_px == (u.min(), v.min(), u.max(), v.max())
        assert thing.pixel_count == here.sum()
        assert ((number == position) == here).all()
        assert thing.name == "abcdefg"[thing.instance]


def test_box_holds_the_projected_ball(ball_in_gaze, aqua2):
    """Points all over the ball, projected by the exact train, fill the box to within a pixel of 160 columns."""
    (ball,) = [thing for thing in things(ball_in_gaze)[0] if (thing.label, thing.region) == (Label.TARGET, Region.GAZE)]
    rng = np.random.default_rng(1)
    on_ball = rng.normal(size=(20000, 3))
    on_ball = np.array(BALL) + RADIUS * on_ball / np.linalg.norm(on_ball, axis=1, keepdims=True)
    pose = np.linalg.inv(ball_in_gaze.world_from_virtual()[Region.DIRECT])
    train = OpticalTrain.from_rig(aqua2)
    pixels = train.project(on_ball @ pose[:3, :3].T + pose[:3, 3]).pixels
    small = (pixels + 0.5) / 4 - 0.5  # 640 columns in 160
    u_min, v_min, u_max, v_max = ball.box_px
    lowest, highest = small.min(axis=0), small.max(axis=0)
    # A pixel belongs to the ball when its centre does.
    assert (np.array([u_min, v_min]) >= lowest).all()
    assert (np.array([u_max, v_max]) <= highest).all()
    assert (np.array([u_min, v_min]) - lowest < 1.5).all()
    assert (highest - [u_max, v_max] < 1.5).all()


def test_a_free_ball_is_wholly_visible_and_half_of_one_half(ball_in_gaze):
    """Closed form: nothing hides it: 1. A plate over the left half of its pixels: what is left, of all."""
    free, _ = things(ball_in_gaze)
    (ball,) = [thing for thing in free if (thing.label, thing.region) == (Label.TARGET, Region.GAZE)]
    assert ball.visible_fraction == 1
    frame = ball_in_gaze.frame
    middle = (ball.box_px[0] + ball.box_px[2]) // 2
    label = frame.label.copy()
    left = np.indices(SHAPE)[1] <= middle
    label[left & (frame.label == Label.TARGET)] = Label.HULL
    half = replace(ball_in_gaze, frame=replace(frame, label=label))
    (rest,) = [thing for thing in things(half)[0] if (thing.label, thing.region) == (Label.TARGET, Region.GAZE)]
    assert rest.visible_fraction == pytest.approx(rest.pixel_count / ball.pixel_count, rel=1e-12)
    assert rest.box_px[0] == middle + 1


def test_inside_fraction_is_what_the_mirror_holds(plain, make_state, aqua2):
    """A ball across the gaze mirror's edge: its pixels, of those that an unbounded mirror would show."""
    state = make_state(0.0, 0.0, ball=(1.6, 0.35, -4.2))
    truth = ground_truth(plain(aqua2, state, SHAPE), aqua2, state, target_radius_m=RADIUS)
    (ball,) = [thing for thing in things(truth)[0] if (thing.label, thing.region) == (Label.TARGET, Region.GAZE)]
    train = OpticalTrain.from_rig(aqua2)
    unbounded = replace(train, mirrors=[replace(mirror, outline=None) for mirror in train.mirrors])
    rays = unbounded.trace(pixel_grid(train.camera, SHAPE[1], SHAPE[0]))
    pose = np.linalg.inv(truth.world_from_virtual()[Region.DIRECT])
    centre = pose[:3, :3] @ state.world_from_target.translation + pose[:3, 3]
    offset = centre - rays.origin_m
    apart = np.linalg.norm(np.cross(offset, rays.direction), axis=1)
    whole = ((rays.status == 0) & (apart < RADIUS) & (np.sum(offset * rays.direction, axis=1) > 0)).sum()
    assert 0.1 < ball.inside_fraction < 0.95
    assert ball.inside_fraction == pytest.approx(ball.pixel_count / whole, abs=2 / whole)  # rim pixels in float32
    assert ball.visible_fraction == 1


def test_a_ball_seen_twice_has_two_boxes(plain, make_state, aqua2):
    """Lower down the ball is seen past the fold mirror as well: each view with its own box, in pixels of its own."""
    state = make_state(0.0, 0.0, ball=(1.9, 0.06, -4.3))
    truth = ground_truth(plain(aqua2, state, SHAPE), aqua2, state, target_radius_m=RADIUS)
    balls = {thing.region: thing for thing in things(truth)[0] if thing.label == Label.TARGET}
    assert set(balls) == {Region.DIRECT, Region.GAZE}
    target = truth.frame.label == Label.TARGET
    assert sum(ball.pixel_count for ball in balls.values()) == target.sum()
    assert balls[Region.DIRECT].box_px[1] > balls[Region.GAZE].box_px[3]


def test_what_the_surface_mirrors_is_a_thing_of_its_own(ball_in_gaze):
    further = np.zeros(SHAPE, dtype=bool)
    v, u = np.nonzero((ball_in_gaze.frame.label == Label.TARGET) & (ball_in_gaze.frame.region == Region.GAZE))
    further[v[:5], u[:5]] = True
    truth = replace(ball_in_gaze, view=replace(ball_in_gaze.view, further_reflection=further))
    balls = [thing for thing in things(truth)[0] if (thing.label, thing.region) == (Label.TARGET, Region.GAZE)]
    assert sorted((thing.further_reflection, thing.pixel_count) for thing in balls) == [(False, len(v) - 5), (True, 5)]
    assert next(thing for thing in balls if thing.further_reflection).visible_fraction is None


def test_run_lengths_are_cocos():
    """The layout of the COCO API's own masks: down the columns, zeros first (pycocotools, maskApi.h)."""
    mask = np.array([[0, 1, 1], [0, 1, 0]], dtype=bool)
    assert run_lengths(mask) == [2, 3, 1]
    assert run_lengths(~mask) == [0, 2, 3, 1]
    assert run_lengths(np.zeros((2, 2), dtype=bool)) == [4]


@given(arrays(bool, st.tuples(st.integers(1, 7), st.integers(1, 7))))
def test_run_lengths_come_back(mask):
    runs = run_lengths(mask)
    assert sum(runs[1::2]) == mask.sum()
    np.testing.assert_array_equal(mask_of_runs(runs, mask.shape), mask)


def test_coco_document_is_whole(ball_in_gaze):
    """What loaders ask for: ids that meet, boxes inside the image, areas that are those of the masks."""
    document = json.loads(json.dumps(coco_document(ball_in_gaze, file_name="layers.exr"), allow_nan=False))
    categories = {each["id"]: each["name"] for each in document["categories"]}
    assert len(document["annotations"]) == len(things(ball_in_gaze)[0])
    for annotation in document["annotations"]:
        mask = mask_of_runs(annotation["segmentation"]["counts"], tuple(annotation["segmentation"]["size"]))
        assert mask.sum() == annotation["area"]
        left, top, width, height = annotation["bbox"]
        v, u = np.nonzero(mask)
        assert (left, top) == (u.min(), v.min())
        assert (left + width, top + height) == (u.max() + 1, v.max() + 1)
        assert categories[annotation["category_id"]] == annotation["label"]
        assert annotation["image_id"] == document["images"][0]["id"]


def test_masks_part_the_robot(ball_in_gaze):
    """Direct and over mirrors make up the robot; labels do not overlap and fill the image."""
    rng = np.random.default_rng(2)
    label = rng.integers(0, len(Label), SHAPE).astype(np.uint8)
    region = rng.integers(0, len(Region), SHAPE).astype(np.uint8)
    found = masks(replace(ball_in_gaze.frame, label=label, region=region))
    assert (sum(found[each.name.lower()].astype(int) for each in Label) == 1).all()
    np.testing.assert_array_equal(found["robot"], found["robot_direct"] ^ found["robot_in_mirrors"])
    robot = found["hull"] | found["mount"] | found["servo"] | found["mirror_back"]
    np.testing.assert_array_equal(found["robot"], robot)
    np.testing.assert_array_equal(found["hull_in_mirrors"], (label == Label.HULL) & (region >= Region.FOLD))


def test_files_say_what_the_frame_says(ball_in_gaze, tmp_path):
    folder = tmp_path / "truth"
    written = write_truth(folder, ball_in_gaze)
    assert sorted(path for path in folder.rglob("*") if path.is_file()) == written
    assert [path.name for path in tmp_path.iterdir()] == ["truth"]
    for name, image in mask_images(ball_in_gaze.frame).items():
        read = cv2.imread(str(folder / "masks" / f"{name}.png"), cv2.IMREAD_UNCHANGED)
        assert read.dtype == image.dtype
        np.testing.assert_array_equal(read, image)
    again = write_truth(tmp_path / "again", ball_in_gaze)
    assert [path.read_bytes() for path in written] == [path.read_bytes() for path in again]


def test_too_many_instances_are_refused_and_nothing_is_left(ball_in_gaze, tmp_path):
    instance = ball_in_gaze.frame.instance.copy()
    instance[0, 0] = 70_000
    truth = replace(ball_in_gaze, frame=replace(ball_in_gaze.frame, instance=instance))
    with pytest.raises(ValueError, match="expected instances up to 65534, got 70000"):
        write_truth(tmp_path / "truth", truth)
    assert list(tmp_path.iterdir()) == []
