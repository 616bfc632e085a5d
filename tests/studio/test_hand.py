"""Pointers on the camera's image: what is dragged stays under the pointer, what is clicked comes to the middle."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from optics import OpticalTrain
from optics.gaze.sights import Sights
from optics.layout import camera_pose
from optics.status import Region
from rigs import Rig
from studio.controller import Crew, Studio
from studio.panels.hand import Hand
from studio.results import View, ViewRequest
from studio.session import Session
from studio.surroundings import Surroundings

AQUA2 = Rig.load("aqua2")
Q_DEG = (10.0, -5.0)
REGION_ROWS = {Region.HOUSING: slice(0, 2), Region.DIRECT: slice(2, 4), Region.FOLD: slice(4, 6)}
"""Of an image ten rows high; below is what M2 shows."""
ANGLE_DEG = 0.03
"""What the table of sights loses, and what it does to the joints."""


class Idle:
    def ask(self, *asked):
        pass

    def stop_work(self, topic):
        pass

    def close(self):
        pass


@pytest.fixture
def hand(tmp_path):
    studio = Studio(
        Session("aqua2", folder=tmp_path), crew=lambda answered: Crew(images=Idle(), analyses=Idle(), slow=Idle())
    )
    studio.turn(*Q_DEG)
    region = np.full((10, 16), Region.GAZE, dtype=np.uint8)
    for kind, rows in REGION_ROWS.items():
        region[rows] = kind
    hand = Hand(studio)
    hand.studio = studio
    hand.view = View(
        request=ViewRequest(rig=AQUA2, surroundings=Surroundings(), q1_deg=Q_DEG[0], q2_deg=Q_DEG[1]),
        image=np.zeros((10, 16, 3), dtype=np.uint8), light="draft", target_px=None, target_m=np.zeros(3),
        target_radius_m=0.1, axis_m=np.zeros((2, 3)), cone_m=np.zeros((2, 0, 3)), gaze_deg=(0.0, 0.0, 0.0),
        region=region, sights=Sights.of(AQUA2), render_ms=0.0,
    )  # fmt: skip
    yield hand
    studio.close()


def tell(hand, phase, x, y, page="1"):
    return hand.take({"page": page, "phase": phase, "x": str(x), "y": str(y)})


def joints_deg(hand):
    return hand.studio.pose.q1_deg, hand.studio.pose.q2_deg


def seen(x, y, q_deg, mirrors=2):
    """Direction at a place of the image behind some mirrors, traced, all without edges."""
    q1, q2 = np.radians(q_deg)
    train = OpticalTrain.from_rig(AQUA2, q1=float(q1), q2=float(q2)).unbounded()
    pixel = np.array([x * AQUA2.camera.width_px, y * AQUA2.camera.height_px]) - 0.5
    rays = OpticalTrain(camera=train.camera, port=train.port, mirrors=train.mirrors[:mirrors]).trace([pixel])
    return rays.moved(camera_pose(AQUA2.camera)).direction[0]


def test_what_m2_shows_stays_under_the_pointer(hand):
    grabbed = seen(0.5, 0.7, Q_DEG)
    assert not tell(hand, "down", 0.5, 0.7)
    assert tell(hand, "move", 0.55, 0.75)
    assert tell(hand, "move", 0.6, 0.8)
    expected = least_squares(lambda q: seen(0.6, 0.8, q) - grabbed, Q_DEG).x
    assert joints_deg(hand) == pytest.approx(expected, abs=ANGLE_DEG)
    assert not tell(hand, "up", 0.6, 0.8)
    assert not tell(hand, "move", 0.7, 0.8)


def test_what_is_clicked_comes_to_the_middle(hand):
    clicked = seen(0.4, 0.7, Q_DEG)
    tell(hand, "down", 0.4, 0.7)
    assert not tell(hand, "move", 0.402, 0.7)
    assert tell(hand, "up", 0.4, 0.7)
    camera = AQUA2.camera
    middle = (camera.cx_px + 0.5) / camera.width_px, (camera.cy_px + 0.5) / camera.height_px
    expected = least_squares(lambda q: seen(*middle, q) - clicked, Q_DEG).x
    assert joints_deg(hand) == pytest.approx(expected, abs=ANGLE_DEG)


def test_past_the_mirrors_the_gaze_goes_to_where_the_pointer_points(hand):
    tell(hand, "down", 0.3, 0.3)
    assert tell(hand, "up", 0.3, 0.3)
    pointed = seen(0.3, 0.3, Q_DEG, mirrors=0)
    azimuth, elevation = np.degrees([np.arctan2(pointed[1], pointed[0]), np.arcsin(pointed[2])])
    assert joints_deg(hand) == pytest.approx((azimuth, elevation / 2), abs=ANGLE_DEG)


def test_the_housing_and_another_pages_pointer_move_nothing(hand):
    tell(hand, "down", 0.5, 0.05)
    assert not tell(hand, "up", 0.5, 0.05)
    tell(hand, "down", 0.5, 0.7)
    assert not tell(hand, "move", 0.6, 0.8, page="2")
    tell(hand, "cancel", 0.5, 0.7)
    assert not tell(hand, "move", 0.6, 0.8)
    assert joints_deg(hand) == Q_DEG


def test_what_no_page_sends_is_refused(hand):
    with pytest.raises(KeyError):
        hand.take({"phase": "down", "x": "0.5", "y": "0.5"})
    with pytest.raises(ValueError, match="could not convert"):
        tell(hand, "down", "here", 0.5)
