"""Cameras that the loop can see through: video files, folders of images, live cameras."""

from __future__ import annotations

from pathlib import Path

from rigs import ImageSensorSpec, Rig
from tracking.cameras.live import LiveCamera, is_live
from tracking.cameras.video import ImageFolderCamera, VideoCamera

__all__ = ["ImageFolderCamera", "LiveCamera", "VideoCamera", "open_camera"]


def open_camera(source: str, rig: Rig) -> VideoCamera | ImageFolderCamera | LiveCamera:
    """The camera that a name means: a number or /dev/video* is live, a folder holds images, the rest is a video.

    Images in a folder are taken at the frame rate of the rig's image sensor.

    Raises
    ------
    OSError, ValueError
        When there is no such file or device, or it is something else.
    """
    if is_live(source):
        return LiveCamera(source)
    path = Path(source)
    if path.is_dir():
        return ImageFolderCamera(path, frame_rate_hz=(rig.image_sensor or ImageSensorSpec()).frame_rate_hz)
    return VideoCamera(path)
