"""Video in segments: lossless where it says so, and the same bytes however often it is written."""

import av
import numpy as np
import pytest

from tracking.video import VideoWriter, concatenate

RATE_HZ = 29.97


@pytest.fixture(scope="module")
def images():
    """Noise, which no codec can guess, on odd sides, which 4:2:0 does not know."""
    rng = np.random.default_rng(0)
    return [rng.integers(0, 256, (47, 63, 3)).astype(np.uint8) for _ in range(10)]


def written(folder, images, codec, container):
    folder.mkdir(parents=True)
    segments = []
    for first in range(0, len(images), 4):
        segments.append(folder / f"{first}.mkv")
        writer = VideoWriter(segments[-1], codec, RATE_HZ)
        for image in images[first : first + 4]:
            writer.write(image)
        writer.close()
    whole = folder / "whole"
    concatenate(segments, whole, container=container, frame_rate_hz=RATE_HZ)
    return whole


def decoded(path):
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        frames = list(container.decode(stream))
        times = [float(frame.pts * stream.time_base) for frame in frames]
        return [frame.to_ndarray(format="rgb24") for frame in frames], np.array(times)


def test_ffv1_gives_back_every_pixel_and_every_time(tmp_path, images):
    back, times = decoded(written(tmp_path / "a", images, "ffv1", "matroska"))
    assert all(np.array_equal(one, two) for one, two in zip(back, images, strict=True))
    # Matroska keeps times in whole milliseconds.
    assert times == pytest.approx(np.arange(10) / RATE_HZ, abs=0.6e-3)


def test_h264_keeps_order_and_times_and_evens_the_sides(tmp_path):
    """Ten grey images, each lighter than the last, in three segments."""
    grey = [np.full((47, 63, 3), 20 + 20 * k, dtype=np.uint8) for k in range(10)]
    back, times = decoded(written(tmp_path / "a", grey, "h264", "mp4"))
    assert back[0].shape == (48, 64, 3)
    means = [image.mean() for image in back]
    # The codec's limited range rounds a grey to steps of 255 / 219.
    assert means == pytest.approx([20 + 20 * k for k in range(10)], abs=2)
    assert times == pytest.approx(np.arange(10) / RATE_HZ, abs=1e-4)


@pytest.mark.parametrize(("codec", "container"), [("ffv1", "matroska"), ("h264", "matroska"), ("h264", "mp4")])
def test_equal_images_give_equal_bytes(tmp_path, images, codec, container):
    one, two = (written(tmp_path / name, images, codec, container).read_bytes() for name in "ab")
    assert one == two
