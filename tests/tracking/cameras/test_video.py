"""Recorded and live images: colours and time stamps arrive, what is broken is left out and counted, or named."""

from __future__ import annotations

import itertools
from fractions import Fraction

import av
import cv2
import numpy as np
import pytest

from rigs import Rig
from tracking.cameras import ImageFolderCamera, LiveCamera, VideoCamera, open_camera
from tracking.cameras import live as live_module
from tracking.cameras.live import is_live
from tracking.protocols import CameraFrame

HEIGHT, WIDTH = 48, 64
RATE = 30
H264 = {"codec": "libx264", "pixel_format": "yuv420p"}


def picture(number: int) -> np.ndarray:
    """Noise, so that damaged bytes are damaged images, with a red corner."""
    image = np.random.default_rng(number).integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8)
    image[:16, :16] = (220, 20, 10)
    return image


def write_video(path, times, *, codec="ffv1", pixel_format="bgr0", container="matroska", scale=RATE):
    with av.open(str(path), "w", format=container) as video:
        stream = video.add_stream(codec, rate=RATE)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, pixel_format
        for number, time in enumerate(times):
            frame = av.VideoFrame.from_ndarray(picture(number), format="rgb24")
            frame.pts, frame.time_base = time, Fraction(1, scale)
            video.mux(stream.encode(frame))
        video.mux(stream.encode(None))
    return path


def shots_of(camera) -> list[CameraFrame]:
    return list(itertools.takewhile(lambda camera_frame: camera_frame is not None, iter(camera.read, object())))


def test_lossless_video_gives_the_very_images_and_times(tmp_path):
    camera = VideoCamera(write_video(tmp_path / "a.mkv", range(10)))
    camera_frames = shots_of(camera)
    assert camera.read() is None
    for number, camera_frame in enumerate(camera_frames):
        assert (camera_frame.image == picture(number)).all()
        assert camera_frame.time_s == pytest.approx(number / RATE, abs=5e-4)  # Matroska counts milliseconds
    assert (len(camera_frames), camera.skipped, camera.missing) == (10, 0, 0)
    assert (camera.frame_rate_hz, camera.expected_images) == (RATE, 10)


def test_time_stamps_are_the_containers_and_gaps_are_counted(tmp_path):
    times = [0, 1, 2, 5, 6, 8, 9]
    camera = VideoCamera(write_video(tmp_path / "a.mp4", times, **H264, container="mp4"))
    assert [camera_frame.time_s for camera_frame in shots_of(camera)] == pytest.approx([k / RATE for k in times])
    assert (camera.skipped, camera.missing) == (0, 3)


def test_a_video_that_starts_late_starts_at_0(tmp_path):
    """A transport stream begins at 1.4 s of its own clock."""
    path = write_video(tmp_path / "a.ts", range(10), **H264, container="mpegts")
    assert shots_of(VideoCamera(path))[0].time_s == 0.0


def test_a_bare_stream_without_times_runs_at_its_rate(tmp_path):
    path = write_video(tmp_path / "a.h264", range(10), **H264, container="h264")
    times = [camera_frame.time_s for camera_frame in shots_of(VideoCamera(path))]
    assert len(times) == 10
    assert np.diff(times) == pytest.approx(1 / RATE, rel=0.5)
    assert (np.diff(times) > 0).all()


def test_compressed_colours_keep_their_order(tmp_path):
    path = write_video(tmp_path / "a.mp4", range(3), **H264, container="mp4")
    corner = VideoCamera(path).read().image[4:12, 4:12].reshape(-1, 3).mean(axis=0)
    # Chroma at half resolution and the encoder's default quality cost a few levels in a flat patch.
    np.testing.assert_allclose(corner, (220, 20, 10), atol=12)


def test_corrupt_images_are_left_out_and_counted(tmp_path):
    path = write_video(tmp_path / "a.avi", range(30), codec="mpeg4", pixel_format="yuv420p", container="avi")
    good = shots_of(VideoCamera(path))
    data = bytearray(path.read_bytes())
    for place in (len(data) // 3, len(data) // 2):
        data[place : place + 40] = b"\x55" * 40
    path.write_bytes(data)
    camera = VideoCamera(path)
    camera_frames = shots_of(camera)
    assert 0 < camera.skipped <= 4
    assert len(camera_frames) == 30 - camera.skipped
    assert camera.missing == camera.skipped
    assert {camera_frame.time_s for camera_frame in camera_frames} < {camera_frame.time_s for camera_frame in good}


def test_a_file_that_breaks_off_ends_there(tmp_path):
    path = write_video(tmp_path / "a.mkv", range(30))
    data = path.read_bytes()
    path.write_bytes(data[: len(data) * 2 // 3])
    camera = VideoCamera(path)
    camera_frames = shots_of(camera)
    assert 15 <= len(camera_frames) <= 20
    assert all((camera_frame.image == picture(number)).all() for number, camera_frame in enumerate(camera_frames[:-1]))


def test_times_that_do_not_grow_are_left_out(tmp_path):
    """Two images in the same millisecond: the loop takes only images that come later."""
    camera = VideoCamera(write_video(tmp_path / "a.mkv", [0, 100, 100, 200], scale=1000))
    assert [camera_frame.time_s for camera_frame in shots_of(camera)] == pytest.approx([0.0, 0.1, 0.2])
    assert camera.skipped == 1


def test_what_is_no_video_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none\.mp4: expected a video, a folder of images or a camera"):
        VideoCamera(tmp_path / "none.mp4")
    (tmp_path / "text.mp4").write_text("no video\n" * 100)
    with pytest.raises(ValueError, match=r"text\.mp4: expected a video, got something else"):
        VideoCamera(tmp_path / "text.mp4")
    (tmp_path / "empty.mp4").touch()
    with pytest.raises(ValueError, match=r"empty\.mp4: expected a video, got something else"):
        VideoCamera(tmp_path / "empty.mp4")
    with av.open(str(tmp_path / "sound.wav"), "w") as sound:
        stream = sound.add_stream("pcm_s16le", rate=8000, layout="mono")
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 800), dtype=np.int16), format="s16", layout="mono")
        frame.sample_rate = 8000
        sound.mux(stream.encode(frame))
    with pytest.raises(ValueError, match=r"sound\.wav: expected a video, got a file without images"):
        VideoCamera(tmp_path / "sound.wav")


def test_a_folder_of_images_is_a_camera(tmp_path):
    for number in range(5):
        cv2.imwrite(str(tmp_path / f"{number:03}.png"), picture(number)[..., ::-1])
    (tmp_path / "notes.txt").write_text("not an image")
    (tmp_path / "002.png").write_bytes(b"broken")
    camera = ImageFolderCamera(tmp_path, frame_rate_hz=10)
    camera_frames = shots_of(camera)
    assert [camera_frame.time_s for camera_frame in camera_frames] == [0.0, 0.1, 0.3, 0.4]
    assert all(
        (camera_frame.image == picture(number)).all()
        for number, camera_frame in zip((0, 1, 3, 4), camera_frames, strict=True)
    )
    assert (camera.skipped, camera.missing, camera.expected_images) == (1, 1, 5)


def test_a_name_says_what_kind_of_camera_it_is(tmp_path):
    rig = Rig.load("aqua2")
    assert [is_live(name) for name in ("0", "12", "/dev/video3", "video0", "0.mp4", "/dev/video")] == [True] * 3 + [
        False
    ] * 3
    with pytest.raises(FileNotFoundError, match="expected a folder of PNG files, found none"):
        open_camera(str(tmp_path), rig)
    cv2.imwrite(str(tmp_path / "a.png"), picture(0))
    folder = open_camera(str(tmp_path), rig)
    assert isinstance(folder, ImageFolderCamera)
    assert folder.frame_rate_hz == 30  # of the image sensor's default, which aqua2 has
    assert isinstance(open_camera(str(write_video(tmp_path / "a.mkv", range(2))), rig), VideoCamera)


@pytest.mark.parametrize("source", ["97", "/dev/video97"])
def test_a_camera_that_is_not_there_is_named(source, capfd):
    with pytest.raises(FileNotFoundError, match="/dev/video97: expected a camera, found none that opens"):
        LiveCamera(source)
    assert capfd.readouterr().err == ""


class FakeCapture:
    """OpenCV's camera: fails now and then, then for good."""

    def __init__(self, _device: str):
        self.reads = iter([True, False, False, True, *[False] * 20])
        self.released = False

    def isOpened(self) -> bool:  # noqa: N802  (OpenCV's name)
        return True

    def get(self, _property: int) -> float:
        return 30.0

    def read(self):
        return (True, picture(0)[..., ::-1]) if next(self.reads) else (False, None)

    def release(self) -> None:
        self.released = True


def test_a_live_camera_gives_images_on_its_clock(monkeypatch):
    monkeypatch.setattr(live_module.cv2, "VideoCapture", FakeCapture)
    camera = LiveCamera("/dev/null")
    first, second = camera.read(), camera.read()
    assert (first.image == picture(0)).all()
    assert 0.0 <= first.time_s <= second.time_s <= camera.now_s() - 0.5 / 30
    assert camera.skipped == 2
    assert camera.read() is None
    camera.close()
