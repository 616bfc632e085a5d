"""Sensors to measure: a small rig's, with one number changed at a time."""

from __future__ import annotations

import numpy as np
import pytest

from rigs import Rig
from rigs.image_sensor import ImageSensorSpec
from scenes.sensor import CameraSettings, ImageSensor

HEIGHT, WIDTH = 120, 160


@pytest.fixture(scope="session")
def make_sensor():
    """Sensor of 160 x 120 pixels; no vignetting and no fixed pattern unless asked for."""

    def make(*, height=HEIGHT, width=WIDTH, **numbers) -> ImageSensor:
        flat = {"vignetting": "none", "prnu": 0.0, "dsnu_e": 0.0, "row_time_us": 0.0}
        rig = Rig.load("aqua2").model_copy(update={"image_sensor": ImageSensorSpec(**{**flat, **numbers})})
        return ImageSensor.from_rig(rig, width_px=width, height_px=height)

    return make


@pytest.fixture(scope="session")
def make_settings():
    def make(*, exposure_s=0.005, gain_db=0.0, white_gains=(1.0, 1.0, 1.0)) -> CameraSettings:
        return CameraSettings(exposure_s=exposure_s, gain_db=gain_db, white_gains=white_gains)

    return make


@pytest.fixture(scope="session")
def flat_field():
    """Radiance under which every pixel collects the same mean charge from light, (height, width, 3)."""

    def field(sensor: ImageSensor, charge_e: float, exposure_s: float = 0.005):
        radiance = charge_e / (sensor.electron_rate * exposure_s)
        return np.broadcast_to(radiance.astype(np.float32), (sensor.height_px, sensor.width_px, 3))

    return field
