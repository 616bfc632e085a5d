"""The image of a step: its size, what is drawn where, and that what is not known is not drawn."""

from __future__ import annotations

from dataclasses import replace

import av
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracking.overlay import BLOB, ESTIMATE, MODE_COLOURS, OUTLINE, PREDICTION, STRIP_ROWS, overlay, overlay_size
from tracking.protocols import CameraFrame
from tracking.records import Blob, Detection, Mode, Step

GREY = 90

NEARLY = 30
"""Levels by which a smooth line's own pixels may be mixed with what is behind them."""


def a_shot(width=640, height=480):
    return CameraFrame(image=np.full((height, width, 3), GREY, dtype=np.uint8), time_s=12.0)


def a_step(mode=Mode.TRACK, width=320, height=240):
    mask = np.zeros((height, width), dtype=np.uint8)
    mask[60:80, 100:120] = 255
    blob = Blob(area_px=400.0, centroid_px=(109.5, 69.5), box_px=(100, 60, 20, 20), circularity=0.8)
    other = Blob(area_px=100.0, centroid_px=(209.5, 169.5), box_px=(205, 165, 10, 10), circularity=0.8)
    return Step(
        time_s=12.0,
        mode=mode,
        q_estimated=np.radians([10.0, -5.0]),
        q_command=np.radians([11.0, -4.0]),
        corners_px=np.array([[200.0, 300.0], [440.0, 300.0], [420.0, 460.0], [220.0, 460.0]]),
        crop=np.full((height, width, 3), 2 * GREY, dtype=np.uint8),
        detection=Detection(mask=mask, blobs=(blob, other), centroid_px=(129.5, 89.5)),
        predicted_px=(250.0, 40.0),
        error_px=(-30.0, -30.0),
        beyond_reach=False,
        target_direction=None,
    )


def has(image, colour):
    return bool((image == colour).all(axis=-1).any())


@given(
    width=st.integers(1, 3000),
    height=st.integers(1, 2000),
    crop=st.tuples(st.integers(8, 800), st.integers(8, 800)),
)
def test_sizes_are_even_and_hold_everything(width, height, crop):
    whole = overlay_size(width, height, crop)
    assert whole[0] % 2 == whole[1] % 2 == 0
    assert whole[0] >= width + crop[0]
    assert whole[1] >= max(height, 2 * crop[1]) + STRIP_ROWS


@pytest.mark.parametrize("size", [(640, 480), (321, 241), (1280, 960)])
def test_the_image_has_the_size_that_was_announced(size):
    drawn = overlay(a_shot(*size), a_step())
    assert drawn.shape[1::-1] == overlay_size(*size, (320, 240))
    assert drawn.dtype == np.uint8


def test_camera_crop_and_mask_are_where_figure_8_has_them():
    drawn = overlay(a_shot(), a_step())
    assert (drawn[100, 100] == GREY).all()  # A: the camera's image
    assert (drawn[200, 640 + 40] == 2 * GREY).all()  # B, above
    assert (drawn[240 + 65, 640 + 103] == 255).all()  # C, below: in the mask
    assert (drawn[240 + 20, 640 + 200] == 0).all()  # C: outside of it


def test_the_mirrors_outline_goes_through_its_corners_with_the_upper_edge_thick():
    drawn = overlay(a_shot(), a_step())
    coloured = np.abs(drawn[:480, :640].astype(int) - OUTLINE).max(axis=-1) < NEARLY
    assert coloured[300, 320]
    assert coloured[460, 320]
    assert coloured[290:311, 320].sum() > coloured[450:471, 320].sum() == 1


def test_blobs_estimate_and_prediction_are_drawn_on_the_crop():
    crop = overlay(a_shot(), a_step())[:240, 640:960]
    assert (crop[60, 105] == BLOB).all()  # upper edge of the larger blob's box
    assert (crop[165, 207] == BLOB).all()
    assert has(crop[85:95, 125:135], ESTIMATE)
    assert (crop[40, 250] == PREDICTION).all()


def test_the_line_joins_the_blobs_to_the_estimate_as_in_figure_10():
    crop = overlay(a_shot(), a_step())[:240, 640:960]
    # Half way between the estimate (129.5, 89.5) and the smaller blob (209.5, 169.5).
    assert has(crop[127:133, 167:173], ESTIMATE)


def test_what_is_not_known_is_not_drawn():
    step = a_step(Mode.SCAN)
    empty = Detection(mask=np.zeros((240, 320), dtype=np.uint8), blobs=(), centroid_px=None)
    unknown = replace(step, detection=empty, predicted_px=None, error_px=None, corners_px=np.full((4, 2), np.nan))
    drawn = overlay(a_shot(), unknown)[:480]
    assert not any(has(drawn, colour) for colour in (OUTLINE, BLOB, ESTIMATE, PREDICTION))


@pytest.mark.parametrize("mode", list(Mode))
def test_each_mode_has_its_colour_in_the_line_of_numbers(mode):
    strip = overlay(a_shot(), a_step(mode))[-STRIP_ROWS:]
    assert has(strip, MODE_COLOURS[mode])
    assert strip.max(axis=2).max() > 200  # there is writing


def test_predictions_and_corners_far_away_are_no_error():
    step = replace(
        a_step(), predicted_px=(1e9, -1e9), corners_px=np.array([[-1e8, 0.0], [1e8, 0], [1e8, 9], [-1e8, 9]])
    )
    assert overlay(a_shot(), step).shape == (512, 960, 3)


def test_the_arguments_stay_as_they_are():
    camera_frame, step = a_shot(), a_step()
    overlay(camera_frame, step)
    assert (camera_frame.image == GREY).all()
    assert (step.crop == 2 * GREY).all()


def test_h264_takes_the_images(tmp_path):
    image = overlay(a_shot(321, 241), a_step())
    path = tmp_path / "overlay.mp4"
    with av.open(path, "w") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt = image.shape[1], image.shape[0], "yuv420p"
        for packet in [*stream.encode(av.VideoFrame.from_ndarray(image)), *stream.encode(None)]:
            container.mux(packet)
    with av.open(path) as container:
        back = next(container.decode(video=0)).to_ndarray(format="rgb24")
    assert back.shape == image.shape
