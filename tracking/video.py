"""Images to video, in segments that are put together at the end without encoding anything again.

Encoders run in one thread and write no times, versions or random numbers, so that equal images give equal bytes.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

import av
import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Codec = Literal["ffv1", "h264", "h264_short"]

ENCODERS: dict[Codec, tuple[str, str, dict[str, str]]] = {
    # Version 3 with four slices and check sums, every frame by itself. Golomb-Rice codes take half as long as the range
    # coder, and make a noisy image half a per cent larger.
    "ffv1": ("ffv1", "bgr0", {"level": "3", "slices": "4", "slicecrc": "1", "coder": "0", "context": "0", "g": "1"}),
    # No frame refers to a later one: packets stay in the order of the images. A dive waits for its videos: with
    # "veryfast" and 20 a noisy image is as close to the original (35 dB) and a third smaller, but takes 2.6 times as
    # long.
    "h264": ("libx264", "yuv420p", {"preset": "ultrafast", "crf": "22", "bf": "0"}),
    # For programs that read single frames in any order: every second one by itself.
    "h264_short": ("libx264", "yuv420p", {"preset": "veryfast", "crf": "10", "bf": "0", "g": "2"}),
}
"""Encoder, pixel format and options."""

BITEXACT = {"fflags": "+bitexact"}

RATE_DENOMINATOR = 1_000_000


class VideoWriter:
    """One segment of a video; the file is whole once it has been closed.

    Parameters
    ----------
    path : Path
    codec : {"ffv1", "h264", "h264_short"}
        Lossless, for looking at, or for learning.
    frame_rate_hz : float
    """

    def __init__(self, path: Path, codec: Codec, frame_rate_hz: float):
        self._name, self._format, self._options = ENCODERS[codec]
        self._rate = frame_rate(frame_rate_hz)
        self._container = av.open(str(path), "w", format="matroska", options=BITEXACT)
        self._stream: Any = None
        self._count = 0

    def write(self, image: Image) -> None:
        """Append an image, uint8 sRGB of shape (height, width, 3)."""
        if self._format == "yuv420p":
            image = _even(image)
        if self._stream is None:
            self._stream = self._started(image)
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(image), format="rgb24")
        frame.pts = self._count
        frame.time_base = 1 / self._rate
        self._count += 1
        self._container.mux(self._stream.encode(frame))

    def close(self) -> None:
        """Write what the encoder still holds, and the file's end."""
        try:
            if self._stream is not None:
                self._container.mux(self._stream.encode(None))
        finally:
            self._container.close()

    def _started(self, image: Image) -> Any:
        stream = self._container.add_stream(
            self._name, rate=self._rate, options={**self._options, "flags": "+bitexact"}
        )
        stream.height, stream.width = image.shape[:2]
        stream.pix_fmt = self._format
        stream.codec_context.thread_count = 1
        stream.codec_context.time_base = 1 / self._rate
        return stream


def concatenate(segments: Sequence[Path], path: Path, *, container: str, frame_rate_hz: float) -> None:
    """Put segments one after the other into one file (container: "matroska", "mp4"), packet by packet."""
    rate = frame_rate(frame_rate_hz)
    count = 0
    with av.open(str(path), "w", format=container, options=BITEXACT) as joined:
        stream: Any = None
        for segment in segments:
            with av.open(str(segment)) as part:
                source = part.streams.video[0]
                if stream is None:
                    stream = joined.add_stream_from_template(source)
                    stream.time_base = 1 / rate
                for packet in part.demux(source):
                    if packet.dts is None:
                        continue  # the empty one that flushes a decoder
                    packet.stream = stream
                    packet.time_base = 1 / rate
                    packet.pts = packet.dts = count
                    packet.duration = 1
                    joined.mux(packet)
                    count += 1


def frame_rate(frame_rate_hz: float) -> Fraction:
    """Frame rate as a fraction that a container can hold."""
    return Fraction(frame_rate_hz).limit_denominator(RATE_DENOMINATOR)


def _even(image: Image) -> Image:
    """Image whose sides are even, as 4:2:0 wants them: an odd one repeats its last row or column."""
    rows, columns = image.shape[0] % 2, image.shape[1] % 2
    if not rows and not columns:
        return image
    return np.asarray(cv2.copyMakeBorder(image, 0, rows, 0, columns, cv2.BORDER_REPLICATE), dtype=np.uint8)
