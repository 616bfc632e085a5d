"""Recorded images as a camera: video files, and folders of PNGs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np

from tracking.protocols import CameraFrame

LONG_STEP = 1.5
"""Frame periods from one time stamp to the next, from which on a frame is missing between them."""


class VideoCamera:
    """Images of a video file, with the time stamps of its container, the video's start at 0.

    Images that cannot be decoded, that the decoder calls corrupt, or whose time does not come after the one before
    are left out and counted. What a decoder patches up without a word, it gives as good.

    Parameters
    ----------
    path : Path

    Attributes
    ----------
    skipped : int
        Images that were left out so far.
    missing : int
        Images that, by the time stamps, the file has never had or that were left out, so far.
    frame_rate_hz : float, optional
        As the container states it.
    expected_images : int, optional
        How many there should be, if the container knows.

    Raises
    ------
    FileNotFoundError, ValueError
        When there is no such file, or it is not a video.
    """

    def __init__(self, path: Path):
        if not path.is_file():
            raise FileNotFoundError(f"{path}: expected a video, a folder of images or a camera; there is none")
        try:
            self._container = av.open(str(path))
        except av.error.FFmpegError as error:
            raise ValueError(f"{path}: expected a video, got something else ({error.strerror})") from None
        if not self._container.streams.video:
            self._container.close()
            raise ValueError(f"{path}: expected a video, got a file without images")
        self._stream = self._container.streams.video[0]
        self._stream.thread_type = "AUTO"
        self.skipped = 0
        self.missing = 0
        rate = self._stream.guessed_rate
        self.frame_rate_hz = float(rate) if rate else None
        self.expected_images = self._count()
        self._last_s = -np.inf
        self._camera_frames = self._decoded()

    def read(self) -> CameraFrame | None:
        """Next image; None at the end."""
        return next(self._camera_frames, None)

    def close(self) -> None:
        """Close the file."""
        self._container.close()

    def _decoded(self) -> Iterator[CameraFrame]:
        for number, frame in enumerate(self._frames()):
            time_s = self._time_s(frame, number)
            if frame.is_corrupt or not time_s > self._last_s:
                self.skipped += 1
                continue
            if self.frame_rate_hz and self._last_s >= 0:
                steps = (time_s - self._last_s) * self.frame_rate_hz
                self.missing += round(steps) - 1 if steps > LONG_STEP else 0
            self._last_s = time_s
            yield CameraFrame(image=frame.to_ndarray(format="rgb24"), time_s=time_s)

    def _frames(self) -> Iterator[Any]:
        packets = self._container.demux(self._stream)
        while True:
            try:
                packet = next(packets)
            except (StopIteration, av.error.FFmpegError):
                return  # a file that breaks off ends where it does
            try:
                yield from packet.decode()
            except av.error.FFmpegError:
                self.skipped += 1

    def _time_s(self, frame: Any, number: int) -> float:
        """Time stamp; bare streams have none, but images at a steady rate."""
        if frame.pts is None or frame.time_base is None:
            return number / (self.frame_rate_hz or 1.0)
        start = self._stream.start_time or 0
        return float(frame.pts * frame.time_base - start * self._stream.time_base)

    def _count(self) -> int | None:
        if self._stream.frames:
            return int(self._stream.frames)
        if self._container.duration and self.frame_rate_hz:
            return int(self._container.duration / av.time_base * self.frame_rate_hz + 0.5)
        return None


class ImageFolderCamera:
    """PNGs of a folder in the order of their names, at a steady rate from time 0.

    An image that cannot be read is left out and counted; its time passes.

    Parameters
    ----------
    folder : Path
    frame_rate_hz : float

    Attributes
    ----------
    skipped, missing : int
        Images that were left out so far.
    frame_rate_hz : float
    expected_images : int

    Raises
    ------
    FileNotFoundError
        When there is no PNG.
    """

    def __init__(self, folder: Path, *, frame_rate_hz: float):
        self._paths = sorted(path for path in folder.iterdir() if path.suffix.lower() == ".png")
        if not self._paths:
            raise FileNotFoundError(f"{folder}: expected a folder of PNG files, found none")
        self.frame_rate_hz = frame_rate_hz
        self.expected_images = len(self._paths)
        self.skipped = 0
        self._next = 0

    @property
    def missing(self) -> int:
        """Nothing else reports a missing image."""
        return self.skipped

    def read(self) -> CameraFrame | None:
        """Next image; None at the end."""
        while self._next < len(self._paths):
            number = self._next
            self._next += 1
            image = cv2.imdecode(np.fromfile(self._paths[number], dtype=np.uint8), cv2.IMREAD_COLOR_RGB)
            if image is not None:
                return CameraFrame(image=np.asarray(image, dtype=np.uint8), time_s=number / self.frame_rate_hz)
            self.skipped += 1
        return None

    def close(self) -> None:
        """Nothing is open."""
