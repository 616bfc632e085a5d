"""EXR files written and read back."""

import numpy as np
import pytest

from optics.kernels.backend import dr
from optics.status import Region
from scenes.truth import ground_truth
from scenes.truth.layers import layers, write_layers
from tests.exr_files import bitmap_of

SHAPE = (24, 32)

NAMES = {
    *("R", "G", "B", "Z", "distance.Z", "label.Y", "instance.Y", "region.Y", "further_reflection.Y", "target.Y"),
    *(f"{layer}.{axis}" for layer in ("position", "normal", "normal_virtual") for axis in "XYZ"),
    *(f"{layer}.{each}" for layer in ("forward", "backward") for each in ("u", "v")),
    *("forward_status.Y", "backward_status.Y"),
}


@pytest.fixture
def truth(aqua2, plain, make_state):
    state, after = make_state(30.0, -10.0, ball=(1.5, 0.9, -4.6)), make_state(31.0, -10.0, time_s=0.5)
    frame = plain(aqua2, state, SHAPE)
    # A corner of open water, which has no place and lies at no distance.
    frame.distance_m[:3, :3], frame.point_m[:3, :3] = np.inf, np.nan
    return ground_truth(frame, aqua2, state, next_state=after, previous_state=after)


def test_every_layer_comes_back_bit_for_bit(truth, tmp_path):
    """Single precision in, single precision out, nan and inf included."""
    write_layers(truth, tmp_path / "view.exr")
    bitmap = bitmap_of(tmp_path / "view.exr")
    read = {field.name: np.array(bitmap)[..., position] for position, field in enumerate(bitmap.struct_())}
    assert set(read) == NAMES
    for name, values in layers(truth).items():
        np.testing.assert_array_equal(read[name], values, err_msg=name)
    assert np.isnan(read["position.X"]).any()
    np.testing.assert_array_equal(read["Z"], truth.view.z_depth_m)
    np.testing.assert_array_equal(read["forward.u"], truth.forward.du_px)


def test_colour_is_found_by_a_reader_that_wants_a_image(truth, tmp_path):
    """Converted to RGB, as viewers do, the file is the radiance."""
    write_layers(truth, tmp_path / "view.exr")
    bitmap = bitmap_of(tmp_path / "view.exr")
    split = dict(bitmap.split())
    assert split["<root>"].channel_count() >= 3
    assert {"distance", "position", "normal", "forward", "backward", "label", "region"} <= set(split)


def test_header_says_what_the_layers_belong_to(truth, tmp_path):
    write_layers(truth, tmp_path / "view.exr")
    header = bitmap_of(tmp_path / "view.exr").metadata()
    assert header["rig"] == "aqua2"
    assert header["q1_deg"] == pytest.approx(30.0)
    assert "4 target" in header["labels"]
    assert "m" in header["units"]
    # A frame of 32 columns for a camera of 640: a twentieth of fx; the middle stays the middle.
    assert header["fx_px"] == pytest.approx(truth.rig.camera.fx_px / 20)
    assert header["cx_px"] == pytest.approx((truth.rig.camera.cx_px + 0.5) / 20 - 0.5)
    pose = truth.world_from_virtual()[Region.GAZE]
    # Matrices in an EXR header are single precision.
    np.testing.assert_allclose(np.array(header["world_from_virtual_gaze"].matrix), pose, atol=1e-6)


def test_equal_frames_give_equal_bytes(truth, tmp_path):
    for name in ("a.exr", "b.exr"):
        write_layers(truth, tmp_path / name)
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.exr", "b.exr"]


@pytest.mark.timeout(60)
def test_a_single_thread_writes_them_too(truth, tmp_path):
    """As on a machine with one core: without another thread Mitsuba's writer waits for ever."""
    threads = dr.thread_count()
    dr.set_thread_count(1)
    try:
        write_layers(truth, tmp_path / "one.exr")
        assert dr.thread_count() == 1
    finally:
        dr.set_thread_count(threads)
    write_layers(truth, tmp_path / "more.exr")
    assert (tmp_path / "one.exr").read_bytes() == (tmp_path / "more.exr").read_bytes()


def test_without_other_states_there_is_no_motion(truth, aqua2):
    still = ground_truth(truth.frame, aqua2, truth.state)
    assert set(layers(still)) == {name for name in NAMES if not name.startswith(("forward", "backward"))}


def test_another_ending_is_refused(truth, tmp_path):
    with pytest.raises(ValueError, match=r"ends in .exr, got 'view.png'"):
        write_layers(truth, tmp_path / "view.png")
