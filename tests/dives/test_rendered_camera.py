"""The rendered camera and the mirrors' clock beside renderer, sensor and closed forms."""

import json

import cv2
import numpy as np
import pytest

from cad.assembly.meshes import rig_meshes
from dives import rendered_camera
from dives.looked_at import pixels_around
from dives.paths import body_pose, target_pose
from dives.rendered_camera import MOST_SWEEPS, RenderedCamera, dive_scene
from dives.timed_mirrors import STEP_S, TimedMirrors
from dives.trajectories.motions import Hover
from scenes.baking.light_quality import LightQuality
from scenes.baking.lit_scene import prepare
from scenes.renderer import FastRenderer
from scenes.sensor import ImageSensor, capture, frame_key, start_settings, sweep_times
from scenes.stage.frame import Label
from tracking.protocols import MirrorReport

COARSE = LightQuality.coarse()

SPEED = 1.0
"""Of the mirrors below, rad/s."""


class EvenMirrors:
    """Mirrors that turn at one speed, both joints, without delay, and know where they are."""

    def __init__(self):
        self.now, self.q, self.goal = 0.0, np.zeros(2), np.zeros(2)

    def command(self, q, time_s):
        self.true_q(time_s)
        self.goal = np.array(q)

    def true_q(self, time_s):
        assert time_s >= self.now
        step = SPEED * (time_s - self.now)
        self.q = self.q + np.clip(self.goal - self.q, -step, step)
        self.now = time_s
        return self.q

    def report(self, time_s):
        return MirrorReport(q=self.true_q(time_s), time_s=time_s, measured=True)

    def snapshot(self):
        return {"now": self.now, "q": self.q.tolist(), "goal": self.goal.tolist()}

    def restore(self, snapshot):
        self.now, self.q, self.goal = snapshot["now"], np.array(snapshot["q"]), np.array(snapshot["goal"])


@pytest.fixture(scope="module")
def rig(small_dive):
    return small_dive.load_rig()


@pytest.fixture(scope="module")
def parts(rig):
    return rig_meshes(rig)


def camera(dive, rig, parts, mirrors=None):
    return RenderedCamera(dive, rig, parts, TimedMirrors(mirrors or EvenMirrors()), COARSE)


def test_commands_act_when_they_arrive():
    """Closed form: sent for 0.1 s, the mirrors turn from there at their speed; one more waits its turn."""
    mirrors = TimedMirrors(EvenMirrors())
    mirrors.command(np.array([0.5, -0.5]), 0.1)
    mirrors.command(np.array([0.0, 0.0]), 0.3)
    # The record reaches back by KEPT_S: it is looked at in two parts.
    for until_s, times, pan in ((0.2, [-1.0, 0.05, 0.1, 0.15], [0.0, 0.0, 0.0, 0.05]), (0.45, [0.3, 0.4], [0.2, 0.1])):
        mirrors.advance(until_s)
        found, expected = mirrors.q(np.array(times)), SPEED * np.array(pan)
        assert found[:, 0] == pytest.approx(expected, abs=1e-12)
        assert found[:, 1] == pytest.approx(-expected, abs=1e-12)


def test_motion_between_steps_is_interpolated():
    """A kink between two looks costs at most the way of a quarter of a step."""
    mirrors = TimedMirrors(EvenMirrors())
    mirrors.command(np.array([0.01, 0.0]), 0.0)
    mirrors.advance(0.1)
    found = mirrors.q(np.array([0.0095, 0.0105, 0.05]))[:, 0]
    assert found == pytest.approx([0.0095, 0.01, 0.01], abs=SPEED * STEP_S / 4)


def test_report_is_of_its_time_although_the_exposure_goes_on():
    mirrors = TimedMirrors(EvenMirrors())
    mirrors.command(np.array([1.0, 0.0]), 0.0)
    assert mirrors.report(0.2).q[0] == pytest.approx(0.2)
    mirrors.advance(0.25)
    assert mirrors.q(np.array([0.2]))[0, 0] == pytest.approx(0.2)


def test_mirrors_go_on_from_a_snapshot_through_json():
    first, second = TimedMirrors(EvenMirrors()), TimedMirrors(EvenMirrors())
    first.command(np.array([0.5, -0.1]), 0.1)
    first.command(np.array([-0.3, 0.2]), 0.7)
    first.advance(0.33)
    second.restore(json.loads(json.dumps(first.snapshot())))
    times = np.linspace(0.2, 1.5, 50)
    for mirrors in (first, second):
        mirrors.advance(1.5)
    assert np.array_equal(first.q(times), second.q(times))


def test_image_of_a_standing_scene_is_the_sensors_of_the_rendered_frame(small_dive, rig, parts):
    """Two ways to the same image: by hand from renderer and sensor, and from the camera."""
    still = small_dive.model_copy(update={"robot": Hover(motion="hover")})
    taken = camera(still, rig, parts)
    camera_frame = taken.read()
    scene = dive_scene(still, rig)
    sensor = ImageSensor.from_rig(rig)
    settings = start_settings(sensor, scene.light.white_radiance(still.depth_m))
    exposure = taken.exposure
    assert exposure.sweeps == 1
    # The middle row is rendered at the middle of its exposure.
    times = sweep_times(sensor, exposure_s=settings.exposure_s, start_s=exposure.start_s, sweeps=1)
    assert times.mean() == pytest.approx(0.0, abs=1e-12)
    frame = FastRenderer(prepare(scene, rig, parts, quality=COARSE)).render(
        world_from_body=body_pose(still, 0.0), world_from_target=target_pose(still, 0.0), time_s=float(times.mean())
    )
    image = capture(np.maximum(frame.radiance, 0), sensor, settings, frame_key(still.seed, 0)).image
    assert np.array_equal(camera_frame.image, image)
    assert np.array_equal(exposure.label, frame.label)


def test_images_come_at_the_frame_rate_and_then_no_more(small_dive, rig, parts):
    short = small_dive.model_copy(update={"duration_s": 0.1})
    taken = camera(short, rig, parts)
    times = []
    while (camera_frame := taken.read()) is not None:
        times.append(camera_frame.time_s)
        assert (taken.exposure.start_s + taken.exposure.end_s) / 2 == pytest.approx(camera_frame.time_s)
    assert times == pytest.approx(np.arange(3) / 30)
    assert taken.next_time_s is None


def test_a_fast_slew_is_rendered_several_times_and_blurs(small_dive, rig, parts, monkeypatch):
    """Sway alone leaves one frame; at 1 rad/s a joint moves the view by pixels while a row is open.

    By two of them, in this small image: steps are made finer here.
    """
    monkeypatch.setattr(rendered_camera, "STEP_PX", 0.9)
    taken = camera(small_dive, rig, parts)
    taken.read()
    assert taken.exposure.sweeps == 1
    still_px = taken.exposure.smear_px
    taken.mirrors.command(np.array([0.5, 0.5]), 0.01)
    taken.read()
    moved = taken.exposure
    # Pan 1 rad/s and tilt 2 rad/s of gaze: the chord of both, at the index times the focal length.
    expected = np.hypot(1.0, 2.0) * moved.settings.exposure_s * rig.camera.fx_px * 1.34
    assert moved.smear_px - still_px == pytest.approx(expected, rel=0.05)
    assert moved.sweeps == min(MOST_SWEEPS, 1 + int(moved.smear_px / 0.9))
    assert moved.sweeps > 1


def test_camera_goes_on_from_a_snapshot_through_json(small_dive, rig, parts):
    first, second = camera(small_dive, rig, parts), camera(small_dive, rig, parts)
    for _ in range(3):
        first.read()
    second.restore(json.loads(json.dumps(first.snapshot())))
    second.mirrors.restore(json.loads(json.dumps(first.mirrors.snapshot())))
    assert np.array_equal(first.read().image, second.read().image)
    assert first.snapshot() == second.snapshot()


def test_what_is_looked_at_is_as_in_the_whole_image(small_dive, rig, parts):
    """Inside the outline image and labels, and all settings after it, to the bit; elsewhere nothing is rendered."""
    whole, seen = camera(small_dive, rig, parts), camera(small_dive, rig, parts)
    outline = np.array([[40.3, 30.2], [110.7, 33.1], [104.5, 88.6], [37.2, 80.0]])
    inside = cv2.fillConvexPoly(
        np.zeros((rig.camera.height_px, rig.camera.width_px), np.uint8), np.rint(outline).astype(np.int32), 1
    )
    for _ in range(3):
        looked_at = pixels_around([outline, np.full((4, 2), np.nan)], inside.shape[::-1])
        expected, found = whole.read(), seen.read(looked_at)
        assert np.array_equal(found.image[inside > 0], expected.image[inside > 0])
        assert np.array_equal(seen.exposure.label[inside > 0], whole.exposure.label[inside > 0])
        assert seen.snapshot() == whole.snapshot()
    assert (found.image[:20] == 0).all()
    assert (seen.exposure.label[:20] == Label.HOUSING).mean() > 0.7


def test_where_there_is_no_outline_nothing_is_developed(small_dive, rig, parts):
    nothing = pixels_around([np.full((4, 2), np.nan)], (rig.camera.width_px, rig.camera.height_px))
    found = camera(small_dive, rig, parts).read(nothing)
    assert (found.image == 0).all()
