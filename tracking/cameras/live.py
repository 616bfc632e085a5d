"""A live camera through OpenCV."""

from __future__ import annotations

import re
import time
from pathlib import Path

import cv2
import numpy as np

from tracking.protocols import CameraFrame

MOST_FAILURES = 10
"""Images in a row that may fail before the camera counts as gone."""


def is_live(source: str) -> bool:
    """Whether a name is that of a live camera: its number, or /dev/video and a number."""
    return re.fullmatch(r"\d+|/dev/video\d+", source) is not None


class LiveCamera:
    """Images as they come, on the machine's steady clock with the camera's opening at 0.

    An image's time is that of its arrival less half a frame: the driver says neither how long it exposed nor how long
    the image was on its way.

    Parameters
    ----------
    source : str
        Number of the camera, or its device.

    Attributes
    ----------
    skipped, missing : int
        Images that failed so far.
    frame_rate_hz : float, optional
        As the driver states it.
    expected_images : None
        There is no end.

    Raises
    ------
    FileNotFoundError
        When there is no such camera, or it does not open.
    """

    expected_images = None

    def __init__(self, source: str):
        device = f"/dev/video{source}" if source.isdecimal() else source
        # Looked for first, because OpenCV says more on stderr than a user wants to know.
        opened = cv2.VideoCapture(device) if Path(device).exists() else None
        if opened is None or not opened.isOpened():
            raise FileNotFoundError(f"{device}: expected a camera, found none that opens")
        self._capture = opened
        rate = self._capture.get(cv2.CAP_PROP_FPS)
        self.frame_rate_hz = rate if rate > 0 else None
        self._half_frame_s = 0.5 / self.frame_rate_hz if self.frame_rate_hz else 0.0
        # So that no image can be from before time 0.
        self._start_s = time.monotonic() - self._half_frame_s
        self.skipped = 0

    @property
    def missing(self) -> int:
        """Nothing else reports a missing image."""
        return self.skipped

    def now_s(self) -> float:
        """The camera's clock: what commands to the mirrors are timed with."""
        return time.monotonic() - self._start_s

    def read(self) -> CameraFrame | None:
        """Wait for the next image; None when the camera is gone."""
        for _ in range(MOST_FAILURES):
            good, image = self._capture.read()
            if good:
                time_s = self.now_s() - self._half_frame_s
                return CameraFrame(
                    image=np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), dtype=np.uint8), time_s=time_s
                )
            self.skipped += 1
        return None

    def close(self) -> None:
        """Give the camera back."""
        self._capture.release()
