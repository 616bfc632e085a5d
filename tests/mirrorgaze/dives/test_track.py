"""`mirrorgaze track`: what it prints and writes, how it ends, and what it refuses."""

from __future__ import annotations

import itertools
import json
import os
import signal
from fractions import Fraction

import av
import cv2
import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app
from optics.layout import camera_pose
from rigs import Rig
from tracking.calibration.calibrated_rig import CalibratedRig
from tracking.calibration.covariance import PerturbationCovariance
from tracking.cameras import VideoCamera
from tracking.perception import Crop, ExactCorners

IMAGES = 12


def mirrorgaze(*arguments: object):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A video of aqua2's camera at q = (10, -5) degrees with a red disc in the middle of the gaze; its joints."""
    return recorded(ExactCorners(Rig.load("aqua2")), tmp_path_factory.mktemp("recording"))


def recorded(corners, folder):
    crop = Crop.of(corners.corners(np.radians([10.0, -5.0])))
    centre = crop.to_image(np.array([[159.5, 119.5]]))[0]
    with av.open(str(folder / "dive.mkv"), "w") as video:
        stream = video.add_stream("ffv1", rate=30)
        stream.width, stream.height, stream.pix_fmt = 640, 480, "bgr0"
        for number in range(IMAGES):
            image = np.full((480, 640, 3), 70, dtype=np.uint8)
            cv2.circle(image, [round(16 * x) for x in centre.tolist()], 9 * 16, (200, 30, 25), -1, cv2.LINE_AA, 4)
            frame = av.VideoFrame.from_ndarray(image, format="rgb24")
            frame.pts, frame.time_base = number, Fraction(1, 30)
            video.mux(stream.encode(frame))
        video.mux(stream.encode(None))
    (folder / "joints.csv").write_text("time_s,q1_deg,q2_deg\n0,10,-5\n1,10,-5\n")
    return folder


def test_help_has_an_example():
    result = mirrorgaze("track", "--help")
    assert result.exit_code == 0
    assert "mirrorgaze track dive.mkv --rig aqua2" in result.stdout


def test_words_json_and_files_say_the_same(recording, tmp_path):
    video, joints = recording / "dive.mkv", recording / "joints.csv"
    common = ("track", video, "--rig", "aqua2", "--joints", joints, "--detector", "narrow-hue")
    words = mirrorgaze(*common, "-o", tmp_path / "a")
    assert words.exit_code == 0, words.output
    assert "overlay.mp4, log.parquet, track.json" in words.stdout
    assert f"detected  in {IMAGES} (100.0%)" in words.stdout
    assert "images/s, overlay and log included" in words.stdout
    assert f"track: {IMAGES} of {IMAGES}" in words.stderr
    machine = mirrorgaze(*common, "-o", tmp_path / "b", "--variant", "paper", "--json")
    assert machine.exit_code == 0, machine.output
    data = json.loads(machine.stdout)
    summary = json.loads((tmp_path / "b" / "track.json").read_text())
    assert data["frames_per_s"] > 0
    assert summary | {"images": IMAGES, "detected": IMAGES, "rig": "aqua2", "variant": "paper"} == summary
    assert {name: data[name] for name in ("images", "detected", "modes")} == {
        name: summary[name] for name in ("images", "detected", "modes")
    }
    assert pq.read_table(tmp_path / "b" / "log.parquet").num_rows == IMAGES


def test_a_log_serves_as_joints(recording, tmp_path):
    """What was tracked can be tracked again from what was written: the same joints, to a rounding in degrees."""
    first, again = tmp_path / "first", tmp_path / "again"
    video = ("track", recording / "dive.mkv", "--rig", "aqua2", "--detector", "narrow-hue", "--joints")
    assert mirrorgaze(*video, recording / "joints.csv", "-o", first).exit_code == 0
    assert mirrorgaze(*video, first / "log.parquet", "-o", again).exit_code == 0
    logs = [pq.read_table(folder / "log.parquet") for folder in (first, again)]
    assert logs[0]["detected"].to_pylist() == [True] * IMAGES
    np.testing.assert_allclose(*(np.array(log["centroid_x_px"]) for log in logs), atol=1e-9)


def test_with_a_calibration_the_target_is_where_the_built_rig_sees_it(tmp_path):
    """A pan horn that sits two degrees aside: the loop's direction is the traced ray's only when it knows that.

    The ray leaves M2 beside its middle, from which the loop counts: 0.1 degrees at the distance it expects.
    """
    covariance = PerturbationCovariance(
        names=("pan_offset",),
        scales=np.ones(1),
        matrix=np.eye(1),
        unobservable=np.empty((0, 1)),
        data_deviations=np.ones(1),
        has_prior=True,
    )
    built = CalibratedRig(rig=Rig.load("aqua2"), perturbations={"pan_offset": np.radians(2.0)}, covariance=covariance)
    built.save(tmp_path / "calibration.toml")
    folder = recorded(built, tmp_path)
    q = np.radians([10.0, -5.0])
    middle = Crop.of(built.corners(q)).to_image(np.array([[159.5, 119.5]]))
    seen = built.train(*q).trace(middle)
    x, y, z = camera_pose(built.rig.camera).rotation.apply(seen.direction[0])
    true_deg = np.degrees([np.arctan2(y, x), np.arcsin(z)])
    options = ("track", folder / "dive.mkv", "--rig", "aqua2", "--detector", "narrow-hue", "--joints")
    off_deg = {}
    for name, more in {"drawn": (), "built": ("--calibration", tmp_path / "calibration.toml")}.items():
        result = mirrorgaze(*options, folder / "joints.csv", *more, "-o", tmp_path / name)
        assert result.exit_code == 0, result.output
        log = pq.read_table(tmp_path / name / "log.parquet")
        estimated = [log[f"estimated_{angle}_deg"].to_pylist()[-1] for angle in ("azimuth", "elevation")]
        off_deg[name] = np.subtract(estimated, true_deg)
    np.testing.assert_allclose(off_deg["built"], 0, atol=0.1)
    assert abs(off_deg["drawn"][0]) == pytest.approx(2.0, abs=0.1)


def test_a_folder_of_images_without_joints(recording, tmp_path):
    """Read as if the mirror stood at q = 0, the disc is elsewhere; it still runs."""
    pictures = tmp_path / "images"
    pictures.mkdir()
    with av.open(str(recording / "dive.mkv")) as video:
        for number, frame in enumerate(itertools.islice(video.decode(video=0), 3)):
            cv2.imwrite(str(pictures / f"{number:04}.png"), frame.to_ndarray(format="bgr24"))
    result = mirrorgaze("track", pictures, "--rig", "aqua2", "-o", tmp_path / "out", "--json")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["images"] == 3
    estimated = pq.read_table(tmp_path / "out" / "log.parquet")["q1_estimated_deg"].to_pylist()
    assert estimated == [0.0] * 3


def test_ctrl_c_ends_with_finished_files(recording, tmp_path, monkeypatch):
    read = VideoCamera.read
    count = itertools.count()

    def interrupted(camera):
        if next(count) == 4:
            os.kill(os.getpid(), signal.SIGINT)
        return read(camera)

    monkeypatch.setattr(VideoCamera, "read", interrupted)
    result = mirrorgaze("track", recording / "dive.mkv", "--rig", "aqua2", "-o", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "track.json, interrupted" in result.stdout
    # The fifth image came with the interrupt and is not taken.
    assert pq.read_table(tmp_path / "out" / "log.parquet").num_rows == 4
    with av.open(str(tmp_path / "out" / "overlay.mp4")) as video:
        assert sum(1 for _ in video.decode(video=0)) == 4


def test_bad_input_ends_with_2_and_a_sentence(recording, tmp_path):
    video, out = recording / "dive.mkv", tmp_path / "out"
    (tmp_path / "text.mp4").write_text("no video")
    (tmp_path / "nan.csv").write_text("time_s,q1_deg,q2_deg\n0,nan,0\n")
    for arguments, message in [
        ((tmp_path / "none.mp4", "--rig", "aqua2"), "none.mp4: expected a video, a folder of images or a camera"),
        ((tmp_path / "text.mp4", "--rig", "aqua2"), "text.mp4: expected a video, got something else"),
        (("/dev/video97", "--rig", "aqua2"), "/dev/video97: expected a camera, found none that opens"),
        ((video, "--rig", "bluerov2"), "expected images of 1920 x 1080 px as rig 'bluerov2' has them, got 640 x 480"),
        ((video, "--rig", "nobody"), "nobody"),
        ((video, "--rig", "bench"), "expected a rig with mirrors, got 'bench'"),
        (
            (video, "--rig", "aqua2", "--variant", "best"),
            "variant 'best': expected one of paper-literal, paper, default",
        ),
        ((video, "--rig", "aqua2", "--detector", "blue"), "detector 'blue': expected one of red-ball, narrow-hue"),
        ((video, "--rig", "aqua2", "--joints", tmp_path / "no.csv"), "no.csv: No such file"),
        ((video, "--rig", "aqua2", "--joints", tmp_path / "nan.csv"), "row 1, q1_deg: expected a finite number, got"),
        (
            (video, "--rig", "aqua2", "--mirrors", "servo"),
            "mirrors 'servo': expected none or maestro: and a serial port",
        ),
        ((video, "--rig", "aqua2", "--mirrors", "maestro:/dev/ttyACM97"), "expected a live camera"),
    ]:
        result = mirrorgaze("track", *arguments, "-o", out)
        assert result.exit_code == 2, result.output
        assert message in result.stderr
        assert not out.exists()


def test_a_folder_with_something_else_is_left_alone(recording, tmp_path):
    (tmp_path / "thesis.tex").write_text("precious")
    result = mirrorgaze("track", recording / "dive.mkv", "--rig", "aqua2", "-o", tmp_path)
    assert result.exit_code == 2
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
