"""The studio without page and processes: what it asks, what it drops, what it says."""

import numpy as np
import pytest

from rigs import Rig
from studio import controller
from studio.controller import (
    CHECKS,
    COARSE,
    FINE,
    JUDGEMENT,
    LIGHT,
    OTHER_COVERAGE,
    OTHER_PARTS,
    PARTS,
    VIEW,
    Crew,
    Heard,
    Studio,
)
from studio.results import Parts
from studio.session import Session
from studio.surroundings import Surroundings
from studio.workers import Failed


class Desk:
    """A worker that writes down what it is asked."""

    def __init__(self):
        self.asked = []

    def ask(self, topic, work, *arguments):
        self.asked.append((topic, *arguments))

    def stop_work(self, topic):
        self.asked.append(("stop", topic))

    def close(self):
        pass

    def topics(self):
        topics = [each[0] for each in self.asked]
        self.asked.clear()
        return topics


@pytest.fixture
def studio(tmp_path, monkeypatch):
    monkeypatch.setattr(controller, "REST_S", 1e6)
    desks = Crew(images=Desk(), analyses=Desk(), slow=Desk())
    studio = Studio(Session("aqua2", folder=tmp_path), crew=lambda answered: desks)
    studio.desks, studio.said, studio.lines = desks, [], []
    studio.heard = Heard(said=lambda *each: studio.said.append(each), did=studio.lines.append)
    yield studio
    studio.close()


def have_parts(studio):
    studio._answered(PARTS, Parts(rig=studio.session.rig, meshes=(), mass_kg={}, elapsed_s=0.0))


def test_asks_for_the_mount_first_and_for_the_image_when_it_is_there(studio):
    studio.start()
    assert studio.desks.analyses.topics() == [JUDGEMENT, PARTS]
    assert studio.desks.images.topics() == []
    have_parts(studio)
    assert studio.desks.analyses.topics() == [COARSE, FINE]
    assert studio.desks.images.topics() == [VIEW]


def test_a_change_is_looked_at_with_the_last_mount_until_the_new_one_is_built(studio):
    studio.start()
    have_parts(studio)
    studio.desks.analyses.asked.clear()
    assert studio.change("gaze_mirror.width_mm", 66.0)
    asked = {topic: arguments for topic, *arguments in studio.desks.analyses.asked}
    assert asked[COARSE][0].gaze.gaze_mirror.width_mm == 66.0
    assert PARTS in asked
    assert studio.lines == ["rig = rig.with_(gaze_mirror__width_mm=66.0)"]
    assert Rig.load("aqua2").with_(gaze_mirror__width_mm=66.0) == studio.session.rig


def test_one_number_of_a_list_can_be_changed(studio):
    studio.start()
    assert studio.change("camera.position_mm[1]", 55.0)
    assert studio.session.rig.camera.position_mm == (302.0, 55.0, 0.0)


def test_what_makes_no_rig_is_said_and_not_done(studio):
    studio.start()
    before = studio.session.text
    assert not studio.change("gaze_mirror.width_mm", -1.0)
    assert studio.session.text == before
    assert "gaze_mirror.width_mm" in studio.said[-1][0]
    assert studio.said[-1][1]


def test_joints_stay_within_limits_also_when_these_come_nearer(studio):
    studio.start()
    have_parts(studio)
    studio.turn(500.0, -500.0)
    assert (studio.pose.q1_deg, studio.pose.q2_deg) == (77.5, -32.5)
    studio.change("joints.pan.max_deg", 40.0)
    assert studio.pose.q1_deg == 40.0


def test_full_light_is_found_once_at_rest_and_what_is_stale_is_stopped(studio):
    studio.start()
    have_parts(studio)
    studio._rested()
    studio._rested()
    assert studio.desks.slow.topics() == ["stop", LIGHT, CHECKS]
    studio.desks.images.asked.clear()
    studio._answered(LIGHT, studio.session.rig)
    assert studio.desks.images.asked[0][1].full
    studio.surround(depth_m=9.0)
    studio._rested()
    assert studio.desks.slow.topics() == ["stop", LIGHT]
    assert "--depth-m 9" in studio.lines[-1]
    studio.change("gaze_mirror.width_mm", 66.0)
    assert studio.desks.slow.asked == [("stop", CHECKS)]


def test_the_gaze_goes_where_it_is_dragged(studio):
    studio.start()
    azimuth, elevation = np.radians([25.0, 14.0])
    level = np.cos(elevation)
    assert studio.look_towards(2 * np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)]))
    assert (studio.pose.q1_deg, studio.pose.q2_deg) == pytest.approx((25.0, 7.0))
    assert not studio.look_towards([0.0, 0.0, -1.0])
    assert (studio.pose.q1_deg, studio.pose.q2_deg) == pytest.approx((25.0, 7.0))


def test_another_rig_is_looked_at_beside(studio):
    studio.start()
    studio.desks.analyses.asked.clear()
    assert studio.set_beside("bluerov2")
    assert studio.desks.analyses.topics() == [OTHER_PARTS, OTHER_COVERAGE]
    assert studio.lines[-1].startswith("mirrorgaze compare-designs .aqua2-")
    assert not studio.set_beside("nothing")
    assert not studio.set_beside("bench")
    assert "expected a rig with mirrors" in studio.said[-1][0]


def test_what_fails_is_said(studio):
    studio._answered(PARTS, Failed("no such mount"))
    studio._answered(CHECKS, Failed("its process ended before it was done", stopped=True))
    assert studio.said == [("mount: no such mount", True)]


def test_surroundings_are_the_options_of_render():
    assert Surroundings().options() == []
    assert Surroundings(world="reef", water="1C", sun_elevation_deg=30.0).options() == [
        "--world", "reef", "--water", "1C", "--sun-elevation-deg", "30",
    ]  # fmt: skip
