"""A rig with a small image and a dive in open water: what a rendered dive is made of, but for the minutes."""

from pathlib import Path

import pytest

from dives.dive import Dive, parse_dive
from rigs import load_document, preset_path, save_document

SMALL = 4
"""Pixels of the preset's camera in one of the small rig's, along each axis."""

SMALL_DIVE = """
name = "small"
rig = "small.toml"
world = "blue"
depth_m = 5.0
duration_s = 0.2667
frame_rate_hz = 30.0
seed = 3

[robot]
motion = "hover"

[robot.sway]
amplitude_m = [0.05, 0.05, 0.05]
turn_deg = [2.0, 2.0, 2.0]

[target.path]
shape = "straight"
start_m = [2.0, 0.3, 0.1]
velocity_m_per_s = [0.0, 0.1, 0.0]
"""


def write_small_rig(folder: Path) -> None:
    """aqua2 with a fourth of the pixels along each axis, and the same field of view."""
    document = load_document(preset_path("aqua2"))
    camera = document["camera"]
    for size, centre, focal in (("width_px", "cx_px", "fx_px"), ("height_px", "cy_px", "fy_px")):
        camera[size] = camera[size] // SMALL
        camera[centre] = (camera[size] - 1) / 2
        camera[focal] = camera[focal] / SMALL
    save_document(document, folder / "small.toml")


@pytest.fixture(scope="session")
def small_folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("small")
    write_small_rig(folder)
    return folder


@pytest.fixture(scope="session")
def small_dive(small_folder) -> Dive:
    """Eight images of 160 x 120."""
    return parse_dive(SMALL_DIVE, source="small", folder=small_folder)
