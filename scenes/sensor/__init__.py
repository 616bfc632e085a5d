"""The image sensor: from radiance in front of the lens to the image a robot gets, in the terms of EMVA 1288."""

from scenes.sensor.automatic import next_settings, settled_settings, start_settings
from scenes.sensor.capture import Capture, capture
from scenes.sensor.colour import develop, grey_card_gains
from scenes.sensor.model import ImageSensor, checked_sensor
from scenes.sensor.noise import frame_key
from scenes.sensor.readout import CameraSettings, RawImage, expose, read_out
from scenes.sensor.shutter import sweep_count, sweep_times

__all__ = [
    "CameraSettings",
    "Capture",
    "ImageSensor",
    "RawImage",
    "capture",
    "checked_sensor",
    "develop",
    "expose",
    "frame_key",
    "grey_card_gains",
    "next_settings",
    "read_out",
    "settled_settings",
    "start_settings",
    "sweep_count",
    "sweep_times",
]
