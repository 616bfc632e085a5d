"""Figures of a dive: which colour stands for what, where the boxes are, and that the same log gives the same bytes."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pytest
from matplotlib.colors import to_hex
from matplotlib.patches import Rectangle

from reports.figures import dive as dive_figures
from reports.figures.dive import (
    DETECTED,
    LOST,
    PREDICTED,
    TRUTH,
    detector_losses,
    draw_commands,
    draw_errors,
    draw_gaze_error,
    write_dive_figures,
)

DRAWINGS = (draw_errors, draw_commands, draw_gaze_error)


@pytest.fixture
def drawn(monkeypatch, tmp_path):
    """`drawn(draw, log)`: the figure instead of its file."""

    def figure_of(draw, log):
        caught = []
        monkeypatch.setattr(dive_figures, "save_figure", lambda figure, path: caught.append(figure))
        draw(log, tmp_path / "unused.png")
        return caught[0]

    return figure_of


def line(axes, colour):
    return next(line for line in axes.lines if line.get_color() == colour and len(line.get_xdata()) > 2)


def changed(log, **columns):
    for name, values in columns.items():
        log = log.set_column(log.column_names.index(name), name, pa.array(values))
    return log


def test_black_is_the_error_with_a_detection_and_red_without(drawn, dive_log):
    axes = drawn(draw_errors, dive_log).axes[0]
    detected = np.array(dive_log["detected"])
    error = dive_log["error_x_px"].to_numpy()
    black, red = (np.asarray(line(axes, colour).get_ydata()) for colour in (DETECTED, PREDICTED))
    np.testing.assert_array_equal(black, np.where(detected, error, np.nan))
    time_s = dive_log["time_s"].to_numpy()
    bridged = (time_s > 30) & (time_s < 33)
    np.testing.assert_array_equal(red[bridged], error[bridged])
    assert np.isnan(red[(time_s > 16) & (time_s < 29.5)]).all()


def test_the_true_error_counts_from_the_crops_centre(drawn, dive_log):
    # The log's detections lie at the crop's centre (159.5, 119.5) plus the error; the truth at (160.5, 116.5) plus it.
    axes = drawn(draw_errors, dive_log).axes
    wave = 12 * np.sin(dive_log["time_s"].to_numpy())
    for row, expected in ((0, wave + 1), (1, wave / 2 - 3)):
        true = np.asarray(line(axes[2 * row + 1], TRUTH).get_ydata())
        np.testing.assert_allclose(true[150:], expected[150:], atol=1e-12)  # rounding of sums


def test_what_is_far_outside_the_crop_does_not_flatten_the_rest(drawn, dive_log):
    far, predicted = (dive_log[f"{name}_x_px"].to_numpy().copy() for name in ("true", "error"))
    far[200], predicted[310] = -1e7, 1e7
    axes = drawn(draw_errors, changed(dive_log, true_x_px=far, error_x_px=predicted)).axes
    # The crop reaches 160 px to each side of its centre; in y all errors are below 10 px.
    assert axes[0].get_ylim() == axes[1].get_ylim() == (-160.0, 160.0)
    assert axes[2].get_ylim()[1] < 10
    # What is beside the crop in x has no place in it in y either.
    for right in (axes[1], axes[3]):
        assert np.isnan(line(right, TRUTH).get_ydata()[200])


def test_joints_are_drawn_less_their_commands(drawn, dive_log):
    axes = drawn(draw_commands, dive_log).axes
    for row, expected in ((0, -0.6), (1, 0.1)):
        np.testing.assert_allclose(line(axes[2 * row + 1], TRUTH).get_ydata(), expected, atol=1e-12)


@pytest.mark.parametrize("draw", [draw_errors, draw_commands])
def test_one_purple_box_spans_the_loss_on_every_axis(drawn, dive_log, draw):
    for axes in drawn(draw, dive_log).axes:
        boxes = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
        assert [to_hex(box.get_edgecolor()) for box in boxes] == [LOST]
        assert (boxes[0].get_x(), boxes[0].get_x() + boxes[0].get_width()) == pytest.approx((30.0, 36.0))


def test_short_gaps_and_the_time_before_the_first_detection_are_no_losses():
    assert detector_losses(np.array([False] * 9 + [True] + [False] * 5 + [True] + [False] * 6)) == [(16, 22)]
    assert detector_losses(np.zeros(20, dtype=bool)) == []


def test_every_cause_and_mode_has_a_bar_as_long_as_it_lasted(drawn, dive_log):
    _, causes, modes = drawn(draw_gaze_error, dive_log).axes
    for axes, expected in (
        (causes, {"not in view": (0, 15), "saturated": (30, 33), "colour": (33, 36)}),
        (modes, {"check": (0, 5), "scan": (5, 15), "predict": (30, 33)}),
    ):
        names = [text.get_text() for text in axes.get_legend().get_texts()]
        spans = {
            name: tuple(bars.get_paths()[0].get_extents().intervalx)
            for name, bars in zip(names, axes.collections, strict=True)
        }
        for name, span in expected.items():
            assert spans[name] == pytest.approx(span)


@pytest.mark.parametrize("draw", DRAWINGS)
def test_the_same_log_gives_the_same_bytes(draw, dive_log, tmp_path):
    files = [tmp_path / name for name in ("first.png", "second.png")]
    for file in files:
        draw(dive_log, file)
    assert files[0].read_bytes() == files[1].read_bytes()
    assert sorted(tmp_path.iterdir()) == files


def test_a_dive_in_the_dark_can_be_drawn(dive_log, tmp_path):
    nan = np.full(600, np.nan)
    dark = changed(
        dive_log,
        detected=np.zeros(600, dtype=bool),
        mode=["scan"] * 600,
        cause_of_loss=["too dark"] * 600,
        **{f"{name}_{axis}_px": nan for name in ("error", "centroid", "predicted", "true") for axis in "xy"},
    )
    assert all(file.stat().st_size > 5000 for file in write_dive_figures(dark, tmp_path))


def test_a_single_frame_can_be_drawn(dive_log, tmp_path):
    assert len(write_dive_figures(dive_log.slice(200, 1), tmp_path)) == 3


def test_a_log_without_its_columns_is_named(dive_log, tmp_path):
    with pytest.raises(ValueError, match=r"error_x_px.*gaze_error_deg"):
        draw_errors(dive_log.drop_columns(["gaze_error_deg", "error_x_px"]), tmp_path / "errors.png")
