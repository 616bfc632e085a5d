"""What is around the rig, and what of it the image shows."""

from __future__ import annotations

from typing import Any

import viser

from studio.controller import Studio
from studio.surroundings import OVERLAYS, RIGS_WATER, TARGETS, WORLDS

WATERS = (RIGS_WATER, "I", "IA", "IB", "II", "III", "1C", "3C", "5C", "7C", "9C")


def add_water(gui: viser.GuiApi, studio: Studio) -> None:
    """Add the inputs of world, water, sun and overlay."""
    around = studio.pose.surroundings
    fields: tuple[tuple[str, Any], ...] = (
        ("world", gui.add_dropdown("world", WORLDS, initial_value=around.world)),
        ("target", gui.add_dropdown("target", TARGETS, initial_value=around.target)),
        ("water", gui.add_dropdown("water (Jerlov type)", WATERS, initial_value=around.water)),
        ("depth_m", gui.add_slider("depth (m)", 1.0, 40.0, 0.5, around.depth_m)),
        ("sun_elevation_deg", gui.add_slider("sun's elevation (deg)", 5.0, 90.0, 1.0, 60.0)),
        ("sun_azimuth_deg", gui.add_slider("sun's azimuth (deg)", -180.0, 180.0, 5.0, 120.0)),
        ("cloud", gui.add_slider("cloud cover", 0.0, 1.0, 0.05, 0.0)),
    )
    for name, handle in fields:
        handle.on_update(lambda event, name=name: studio.surround(**{name: event.target.value}))
    overlay = gui.add_dropdown("overlay", OVERLAYS, initial_value="none")
    overlay.on_update(lambda _: studio.show(overlay=overlay.value))
    sensor = gui.add_checkbox("as the image sensor takes it", False)
    sensor.on_update(lambda _: studio.show(sensor=sensor.value))
