"""The page: what is on it, and which part of the studio each thing speaks to."""

from __future__ import annotations

import threading
import time
from collections import deque
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import viser

from rigs import Rig
from studio.controller import Heard, Studio
from studio.design import Number, choices, numbers, value_at
from studio.results import Covered, Judgement, Parts, View
from studio.rig_scene import RigScene
from studio.surroundings import OVERLAYS, RIGS_WATER, TARGETS, WORLDS

LINES_KEPT = 12
"""Of the actions that are shown as commands or Python."""
WATERS = (RIGS_WATER, "I", "IA", "IB", "II", "III", "1C", "3C", "5C", "7C", "9C")
GREEN, RED = "#1b7f5c", "#c1272d"
CAMERA_WIDTH_PX, CONTROLS_WIDTH_PX = 420, 380


class Page:
    """The page of a studio.

    Parameters
    ----------
    server : ViserServer
    studio : Studio
        Is started by `open`.
    """

    def __init__(self, server: viser.ViserServer, studio: Studio) -> None:
        self._gui, self._studio = server.gui, studio
        self._lines: deque[str] = deque(maxlen=LINES_KEPT)
        self._parts: Parts | None = None
        self._judged: Judgement | None = None
        self._covered: Covered | None = None
        self._inputs: dict[str, Any] = {}
        self._lock = threading.RLock()
        self._scene = RigScene(server, self._pick)
        server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(30, 110, 140))
        server.gui.set_panel_label(f"mirrorgaze studio: {studio.session.rig.name}")
        self._camera_panel(server)
        self._controls(server)
        studio.heard = Heard(
            changed=self._changed,
            view=self._view,
            parts=self._have_parts,
            covered=self._have_coverage,
            judged=self._have_judgement,
            said=self._say,
            did=self._did,
        )

    def open(self) -> None:
        """Begin: everything is asked for."""
        session = self._studio.session
        if session.recovered:
            self._say(
                f"went on with the changes of the last time ({session.autosave.name}); undo takes them back", False
            )
        self._studio.start()

    # The camera's image and the joints.

    def _camera_panel(self, server: viser.ViserServer) -> None:
        rig, pose = self._studio.session.rig, self._studio.pose
        panel = self._gui.add_panel()
        panel.dock_left()
        panel.set_width(CAMERA_WIDTH_PX)
        height = round(pose.width_px * rig.camera.height_px / rig.camera.width_px)
        with panel.add_tab("Camera"):
            self._image = self._gui.add_image(
                np.full((height, pose.width_px, 3), 40, dtype=np.uint8), format="jpeg", jpeg_quality=85
            )
            self._seen = self._gui.add_markdown("the mount is being built ...")
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
        self._scene.turn(self._studio.pose.q1_deg, self._studio.pose.q2_deg)

    def _view(self, view: View) -> None:
        request = view.request
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

    # The controls.

    def _controls(self, server: viser.ViserServer) -> None:
        server.gui.main_panel.dock_right()
        server.gui.main_panel.set_width(CONTROLS_WIDTH_PX)
        self._said = self._gui.add_markdown("")
        tabs = self._gui.add_tab_group()
        with tabs.add_tab("Design"):
            self._design_tab()
        with tabs.add_tab("Verdict"):
            self._verdict_tab()
        with tabs.add_tab("Water"):
            self._water_tab()
        with tabs.add_tab("File"):
            self._file_tab()
        with tabs.add_tab("Lines"):
            self._gui.add_markdown("What was done, newest first, as commands and Python:")
            self._shown_lines = self._gui.add_html("")

    def _design_tab(self) -> None:
        rig = self._studio.session.rig
        undo_redo = self._gui.add_button_group("Steps", ("Undo", "Redo"))
        undo_redo.on_click(lambda event: self._studio.undo() if event.target.value == "Undo" else self._studio.redo())
        for heading, group in numbers(rig).items():
            if not group:
                continue
            with self._gui.add_folder(heading, expand_by_default=heading == "Mirrors"):
                for number in group:
                    self._number(rig, number)
        with self._gui.add_folder("Outlines and material", expand_by_default=False):
            for place, label, values in choices(rig):
                self._choice(rig, place, label, values)

    def _number(self, rig: Rig, number: Number) -> None:
        value = float(value_at(rig, number.place))
        slider = self._gui.add_slider(number.label, number.low, number.high, number.step, value)
        self._bind(slider, number.place)

    def _choice(self, rig: Rig, place: str, label: str, values: tuple[str, ...]) -> None:
        self._bind(self._gui.add_dropdown(label, values, initial_value=value_at(rig, place)), place)

    def _bind(self, handle: Any, place: str) -> None:
        """Let an input change a place of the rig; what makes no rig goes back to where it was."""
        self._inputs[place] = handle

        @handle.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None and not self._studio.change(place, handle.value):
                handle.value = value_at(self._studio.session.rig, place)

    def _verdict_tab(self) -> None:
        self._verdict = self._gui.add_html("<p>the rig is being looked at ...</p>")
        self._shell_shown = self._gui.add_checkbox("show the covered sphere", True)
        self._shell_shown.on_update(lambda _: self._show_shell())
        self._legend = self._gui.add_html("")
        self._picked_part = self._gui.add_markdown("Click a part to read its name and mass.")

    def _water_tab(self) -> None:
        around = self._studio.pose.surroundings
        fields: tuple[tuple[str, Any], ...] = (
            ("world", self._gui.add_dropdown("world", WORLDS, initial_value=around.world)),
            ("target", self._gui.add_dropdown("target", TARGETS, initial_value=around.target)),
            ("water", self._gui.add_dropdown("water (Jerlov type)", WATERS, initial_value=around.water)),
            ("depth_m", self._gui.add_slider("depth (m)", 1.0, 40.0, 0.5, around.depth_m)),
            ("sun_elevation_deg", self._gui.add_slider("sun's elevation (deg)", 5.0, 90.0, 1.0, 60.0)),
            ("sun_azimuth_deg", self._gui.add_slider("sun's azimuth (deg)", -180.0, 180.0, 5.0, 120.0)),
            ("cloud", self._gui.add_slider("cloud cover", 0.0, 1.0, 0.05, 0.0)),
        )
        for name, handle in fields:
            handle.on_update(lambda event, name=name: self._studio.surround(**{name: event.target.value}))
        overlay = self._gui.add_dropdown("overlay", OVERLAYS, initial_value="none")
        overlay.on_update(lambda _: self._studio.show(overlay=overlay.value))
        sensor = self._gui.add_checkbox("as the image sensor takes it", False)
        sensor.on_update(lambda _: self._studio.show(sensor=sensor.value))

    def _file_tab(self) -> None:
        session = self._studio.session
        own = session.own_file
        name = self._gui.add_text("rig file", str(own or Path.cwd() / f"my-{session.rig.name}.toml"))
        save, back = self._gui.add_button("Save"), self._gui.add_button("Back to the file")

        @save.on_click
        def _(_: Any) -> None:
            self._studio.save(Path(name.value))

        @back.on_click
        def _(_: Any) -> None:
            self._studio.back_to_file()

        self._gui.add_markdown(f"Every change is kept in `{session.autosave}`; the next start goes on from there.")

    # What the studio says.

    def _changed(self, rig: Rig) -> None:
        with self._lock:
            self._scene.lay_out(rig)
            joints, pose = rig.require_gaze().joints, self._studio.pose
            for slider, joint, value in ((self._q1, joints.pan, pose.q1_deg), (self._q2, joints.tilt, pose.q2_deg)):
                slider.min, slider.max = joint.min_deg, joint.max_deg
                _set(slider, value)
            for place, handle in self._inputs.items():
                _set(handle, value_at(rig, place))
            self._scene.turn(pose.q1_deg, pose.q2_deg)

    def _have_parts(self, parts: Parts) -> None:
        with self._lock:
            self._parts = parts
            self._scene.put_parts(parts)
            self._show_verdict()

    def _have_coverage(self, covered: Covered) -> None:
        with self._lock:
            self._covered = covered
            self._show_shell()
            self._show_verdict()

    def _have_judgement(self, judged: Judgement) -> None:
        with self._lock:
            self._judged = judged
            self._show_verdict()

    def _show_shell(self) -> None:
        if self._covered is None:
            return
        self._scene.show_shell(self._covered.shell, visible=self._shell_shown.value)
        rows = [("seen, darker by more poses", (42, 157, 143), self._covered.covered), *self._covered.shell.blind]
        self._legend.content = "".join(
            f'<div><span style="display:inline-block;width:0.9em;height:0.9em;background:rgb{colour}"></span> '
            f"{escape(name)}: {share:.1%}</div>"
            for name, colour, share in rows
        )

    def _show_verdict(self) -> None:
        rows = []
        if self._covered is not None:
            covered = self._covered
            rows += [
                ("covered", f"{covered.covered:.1%} of the sphere ({covered.fineness}, {covered.elapsed_s:.2f} s)"),
                ("upper, lower half", f"{covered.upper:.1%}, {covered.lower:.1%}"),
                ("usable field of view", f"{covered.mean_msr:.0f} msr mean, {covered.most_msr:.0f} msr at most"),
                ("resolution", f"{covered.pixels_per_degree:.1f} px per degree"),
            ]
        if self._parts is not None:
            mass = 1000 * sum(self._parts.mass_kg.values())
            rows.append(("mount", f"{mass:.0f} g, {len(self._parts.mass_kg)} parts"))
        table = "".join(f"<tr><td>{escape(name)}&ensp;</td><td><b>{escape(text)}</b></td></tr>" for name, text in rows)
        self._verdict.content = f"{self._checks()}<table>{table}</table>"

    def _checks(self) -> str:
        if self._judged is None:
            return ""
        if not self._judged.sentences:
            return f'<p style="color:{GREEN}">&#10003; good: nothing in the way by its numbers</p>'
        return "".join(f'<p style="color:{RED}">&#10007; {escape(each)}</p>' for each in self._judged.sentences)

    def _pick(self, name: str) -> None:
        if self._parts is None:
            return
        mass = self._parts.mass_kg.get(name)
        weight = "" if mass is None else f", {1000 * mass:.1f} g"
        self._picked_part.content = f"**{name.replace('_', ' ')}**{weight}"

    def _say(self, sentence: str, wrong: bool) -> None:
        mark = "&#10007;" if wrong else "&#10003;"
        self._said.content = f'<span style="color:{RED if wrong else GREEN}">{mark} {escape(sentence)}</span>'

    def _did(self, line: str) -> None:
        with self._lock:
            if self._lines and self._lines[0] == line:
                return
            self._lines.appendleft(line)
            text = "\n".join(self._lines)
        self._shown_lines.content = f'<pre style="white-space:pre-wrap;user-select:text">{escape(text)}</pre>'


def _set(handle: Any, value: Any) -> None:
    if handle.value != value:
        handle.value = value
