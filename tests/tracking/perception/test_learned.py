"""Learned detectors: small models whose output is known in closed form."""

import sys

import numpy as np
import pytest

from tracking.perception import RED_BALL, DetectorSettings, LearnedModel, detect_by_model, detector_of

onnx = pytest.importorskip("onnx", reason="models for the tests are made by the package onnx")
pytest.importorskip("onnxruntime", reason="learned detectors need onnxruntime: pip install 'mirrorgaze[onnx]'")

ALL = DetectorSettings(area_min_px=1, circularity_min=0, aspect_max=99)
CELL_PX = 4


def one_number(file):
    """A model that tells one number of a whole image."""
    values, floats = onnx.helper.make_tensor_value_info, onnx.TensorProto.FLOAT
    graph = onnx.helper.make_graph(
        [onnx.helper.make_node("ReduceMean", ["image"], ["odds"], axes=[2, 3], keepdims=0)],
        "mean",
        [values("image", floats, [1, 3, "height", "width"])],
        [values("odds", floats, [1, 3])],
    )
    onnx.save(onnx.helper.make_model(graph, opset_imports=[onnx.helper.make_opsetid("", 17)], ir_version=10), file)


def red_above_green(file, *, channels=3):
    """A model of cells of 4 pixels: log odds are 8 (red - green) - 2."""
    weights = np.array([8.0, -8.0, 0.0][:channels], dtype=np.float32).reshape(1, channels, 1, 1)
    weights = np.broadcast_to(weights / CELL_PX**2, (1, channels, CELL_PX, CELL_PX))
    values, floats = onnx.helper.make_tensor_value_info, onnx.TensorProto.FLOAT
    graph = onnx.helper.make_graph(
        [onnx.helper.make_node("Conv", ["image", "weights", "bias"], ["odds"], strides=[CELL_PX] * 2)],
        "red",
        [values("image", floats, [1, channels, "height", "width"])],
        [values("odds", floats, [1, 1, "rows", "columns"])],
        [
            onnx.numpy_helper.from_array(np.ascontiguousarray(weights), "weights"),
            onnx.numpy_helper.from_array(np.array([-2.0], dtype=np.float32), "bias"),
        ],
    )
    onnx.save(onnx.helper.make_model(graph, opset_imports=[onnx.helper.make_opsetid("", 17)], ir_version=10), file)
    return file


def crop_with(*boxes, colour=(255, 0, 0)):
    """Boxes (x, y, width, height) of a colour before grey."""
    crop = np.full((240, 320, 3), 90, dtype=np.uint8)
    for x, y, width, height in boxes:
        crop[y : y + height, x : x + width] = colour
    return crop


@pytest.fixture
def model(tmp_path):
    return LearnedModel(red_above_green(tmp_path / "red.onnx"))


def test_log_odds_are_the_models_own_for_every_size_of_crop(model):
    """8 (1 - 0) - 2 on red, -2 on grey; a cell half red has the mean."""
    crop = crop_with((40, 80, 22, 40))
    odds = model.log_odds(crop)
    assert odds.shape == (60, 80)
    assert odds[20:30, 10:15] == pytest.approx(6.0, abs=1e-5)
    assert odds[20:30, 15] == pytest.approx(2.0, abs=1e-5)
    assert odds[:, 16:] == pytest.approx(-2.0, abs=1e-5)
    assert model.log_odds(crop[:120, :160]).shape == (30, 40)


def test_blobs_are_where_the_target_is_likelier_than_not_the_likeliest_first(model):
    crop = crop_with((200, 40, 40, 40))
    crop[160:200, 40:120] = (160, 60, 0)  # less red: 8 * 100 / 255 - 2 = 1.14
    detection = detect_by_model(crop, model, ALL)
    strong, weak = detection.blobs
    assert strong.centroid_px == pytest.approx((219.5, 59.5), abs=0.5)
    assert weak.centroid_px == pytest.approx((79.5, 179.5), abs=0.5)
    assert strong.log_odds > 4 > weak.log_odds > 0
    assert strong.area_px == pytest.approx(1600, rel=0.1)
    assert set(np.unique(detection.mask)) == {0, 255}


def test_the_robot_and_small_things_are_no_target(model):
    crop = crop_with((200, 40, 40, 40), (40, 160, 8, 8))
    robot = np.zeros(crop.shape[:2], dtype=np.uint8)
    robot[:, 160:] = 255
    assert [blob.centroid_px[0] < 160 for blob in detect_by_model(crop, model, ALL, robot).blobs] == [True]
    assert not detect_by_model(crop, model, RED_BALL, robot).blobs
    assert detect_by_model(crop_with(), model, ALL).centroid_px is None


def test_the_settings_choose_the_model(tmp_path):
    """A window of blue would find the blue box; the model finds the red one."""
    file = str(red_above_green(tmp_path / "red.onnx"))
    crop = crop_with((200, 40, 40, 40))
    crop[160:200, 40:80] = (0, 0, 255)
    found = detector_of(DetectorSettings(onnx=file, area_min_px=1), contrast=True)(crop, None, None)
    assert found.centroid_px == pytest.approx((219.5, 59.5), abs=0.5)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (None, "got no file"),
        (b"", "expected a model of ONNX"),
        (b"not a model", "expected a model of ONNX"),
        ("one channel", "that takes images of shape \\(1, 3, 240, 320\\)"),
        ("one number", "expected one input and one output of four axes"),
    ],
)
def test_what_is_no_model_is_a_sentence(tmp_path, content, sentence):
    file = tmp_path / "wrong.onnx"
    if isinstance(content, bytes):
        file.write_bytes(content)
    elif content == "one channel":
        red_above_green(file, channels=1)
    elif content == "one number":
        one_number(file)
    with pytest.raises((ValueError, FileNotFoundError), match=sentence) as caught:
        LearnedModel(file)
    assert "\n" not in str(caught.value)


def test_without_onnxruntime_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(ValueError, match=r"pip install 'mirrorgaze\[onnx\]'"):
        LearnedModel(tmp_path / "ball.onnx")
