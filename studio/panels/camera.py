"""The camera's image and the joints, beside the rig in 3-D."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np
import viser

from optics.kernels.arrays import FloatArray
from rigs import Rig
from studio.controller import Studio
from studio.panels.hand import Hand, pointing_html
from studio.panels.markup import put_value
from studio.results import View
from studio.rig_scene import RigScene

WIDTH_PX = 420


class CameraPanel:
    """The camera's image and the joints.

    Parameters
    ----------
    gui : GuiApi
    studio : Studio
    scene : RigScene
        Turns with the joints.
    """

    def __init__(self, gui: viser.GuiApi, studio: Studio, scene: RigScene) -> None:
        self._gui, self._studio, self._scene = gui, studio, scene
        self._hand = Hand(studio)
        rig, pose = studio.session.rig, studio.pose
        panel = gui.add_panel(order=-1)
        panel.dock_left()
        panel.set_width(WIDTH_PX)
        # On a phone it is shut otherwise.
        panel.expand()
        height = round(pose.width_px * rig.camera.height_px / rig.camera.width_px)
        with panel.add_tab("Camera"):
            self._image = gui.add_image(
                np.full((height, pose.width_px, 3), 40, dtype=np.uint8), format="jpeg", jpeg_quality=85
            )
            gui.add_html(pointing_html())
            self._seen = gui.add_markdown("the mount is being built ...")
            joints = rig.require_gaze().joints
            self._q1 = self._joint("q1, pan (deg)", joints.pan.min_deg, joints.pan.max_deg, pose.q1_deg)
            self._q2 = self._joint("q2, tilt (deg)", joints.tilt.min_deg, joints.tilt.max_deg, pose.q2_deg)

    def _joint(self, label: str, low: float, high: float, value: float) -> viser.GuiSliderHandle[float]:
        slider = self._gui.add_slider(label, low, high, 0.1, value)

        @slider.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                self._turn()

        return slider

    def _turn(self) -> None:
        self._studio.turn(self._q1.value, self._q2.value)
        self._turn_scene()

    def _turn_scene(self) -> None:
        self._scene.turn(self._studio.pose.q1_deg, self._studio.pose.q2_deg)

    def pull(self, direction: FloatArray) -> None:
        """Turn the gaze to where it is dragged, a direction of the body frame."""
        if self._studio.look_towards(direction):
            self._joints_follow()

    def pointed(self, told: Mapping[str, str]) -> None:
        """Take what the page's script tells of a pointer on the image."""
        if self._hand.take(told):
            self._joints_follow()

    def _joints_follow(self) -> None:
        pose = self._studio.pose
        put_value(self._q1, pose.q1_deg)
        put_value(self._q2, pose.q2_deg)
        self._turn_scene()

    def follow(self, rig: Rig) -> None:
        """Take over limits and joint values of a rig that has changed."""
        joints, pose = rig.require_gaze().joints, self._studio.pose
        for slider, joint, value in ((self._q1, joints.pan, pose.q1_deg), (self._q2, joints.tilt, pose.q2_deg)):
            slider.min, slider.max = joint.min_deg, joint.max_deg
            put_value(slider, value)
        self._turn_scene()

    def show(self, view: View) -> None:
        """Show an image and what it shows of the gaze."""
        request = view.request
        self._hand.view = view
        self._image.image = view.image
        self._scene.show_light(view)
        azimuth, elevation, roll = (angle + 0.0 for angle in np.round(view.gaze_deg, 1))
        target = "out of view" if view.target_px is None else "at {:.1f}, {:.1f} px".format(*view.target_px)
        delay_ms = 1000 * (time.monotonic() - request.asked_s)
        self._seen.content = (
            f"gaze azimuth **{azimuth:.1f}°**, elevation **{elevation:.1f}°**, image roll {roll:.1f}°; "
            f"target {target}  \n"
            f"{view.light} light, {view.render_ms:.0f} ms to render, {delay_ms:.0f} ms from input to image"
        )
