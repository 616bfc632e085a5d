"""The page: what is on it, and which part of the studio each thing speaks to."""

from __future__ import annotations

import base64
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import viser

from optics.kernels.arrays import FloatArray
from rigs import Rig
from studio.commands import Ended, Runner
from studio.controller import Heard, Studio
from studio.design import Number, choices, numbers, value_at
from studio.lines import command_line, dive_words, search_words, size_words
from studio.results import Checked, Covered, Judgement, Parts, View
from studio.rig_scene import RigScene
from studio.surroundings import OVERLAYS, RIGS_WATER, TARGETS, WORLDS

SEARCHED_RIGS = 4
"""Designs of a search that become rig files."""
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
        self._checked: Checked | None = None
        self._picked: str | None = None
        self._inputs: dict[str, Any] = {}
        self._lock = threading.RLock()
        self._scene = RigScene(server, self._pick, self._pull)
        self._runner = Runner(studio.session.autosave.parent, self._command_said)
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
            checked=self._have_checks,
            other_parts=self._scene.put_beside,
            other_covered=self._have_other,
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
        panel = self._gui.add_panel(order=-1)
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
        self._said = self._gui.add_html("")
        tabs = self._gui.add_tab_group()
        with tabs.add_tab("Design"):
            self._design_tab()
        with tabs.add_tab("Verdict"):
            self._verdict_tab()
        with tabs.add_tab("Water"):
            self._water_tab()
        with tabs.add_tab("Work"):
            self._work_tab()
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
        self._picked_part = self._gui.add_markdown("Click a part to read its name, mass, print time and clearance.")

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

    def _work_tab(self) -> None:
        session = self._studio.session
        self._progress = self._gui.add_progress_bar(0.0, visible=False)
        self._stop = self._gui.add_button("Stop", visible=False)
        self._stop.on_click(lambda _: self._runner.stop())
        with self._gui.add_folder("Rig file"):
            own = session.own_file
            name = self._gui.add_text("file", str(own or Path.cwd() / f"my-{session.rig.name}.toml"))
            self._button("Save", lambda: self._studio.save(Path(name.value)))
            self._button("Back to the file", self._studio.back_to_file)
            self._gui.add_markdown(
                f"Every change is kept in `{session.autosave.name}`; the next start goes on from there."
            )
        with self._gui.add_folder("Size the mirrors for a window", expand_by_default=False):
            window = self._gui.add_text("window", "0.2", hint="0.2 of the image's sides, 320x240 px or 20x15deg")
            azimuth = self._gui.add_vector2("azimuth, from and to (deg)", (-60.0, 60.0), step=1.0)
            elevation = self._gui.add_vector2("elevation, from and to (deg)", (-30.0, 30.0), step=1.0)
            self._button(
                "Size",
                lambda: self._run(size_words(self._file, window.value, azimuth.value, elevation.value), changes=True),
            )
        with self._gui.add_folder("Place again", expand_by_default=False):
            self._gui.add_markdown(
                "Camera, mirrors and anchors anew on a hull from a file, as far as they are not pinned."
            )
            self._button("Place", lambda: self._run(("place", self._file), changes=True))
        with self._gui.add_folder("Search around here", expand_by_default=False):
            designs = self._gui.add_slider("designs", 500, 20_000, 500, 2_000)
            take = self._gui.add_slider("design of the table", 1, SEARCHED_RIGS, 1, 1)
            self._button("Search", lambda: self._run(search_words(self._file, self._out, designs.value)))
            self._button(
                "Take the design",
                lambda: self._run(search_words(self._file, self._out, designs.value, take.value), changes=True),
            )
        with self._gui.add_folder("Export the mount", expand_by_default=False):
            self._button("Export", lambda: self._run(("export", self._file, "-o", f"{self._out}/mount")))
        with self._gui.add_folder("Short dive", expand_by_default=False):
            seconds = self._gui.add_slider("duration (s)", 10, 60, 5, 15)
            self._button("Dive", lambda: self._dive(seconds.value))
        with self._gui.add_folder("Beside another rig", expand_by_default=False):
            other = self._gui.add_text("preset or file", "bluerov2")
            self._button("Put it beside", lambda: self._studio.set_beside(other.value))
            self._beside = self._gui.add_html("")
        self._output = self._gui.add_html("")

    @property
    def _file(self) -> str:
        """Rig file of commands, which run in its folder."""
        return self._studio.session.autosave.name

    @property
    def _out(self) -> str:
        """Folder for what commands write."""
        return f"out/{self._studio.session.rig.name}-studio"

    def _button(self, label: str, act: Callable[[], object]) -> None:
        @self._gui.add_button(label).on_click
        def _(_: Any) -> None:
            act()

    def _run(self, words: Sequence[str], *, changes: bool = False, then: Callable[[], None] = lambda: None) -> None:
        """Run a command; one that `changes` the rig file has it read back when it ends well."""

        def ended(end: Ended) -> None:
            self._progress.visible = self._stop.visible = False
            self._output.content = _preformatted(end.lines)
            if end.stopped:
                self._say(f"{words[0]}: stopped", False)
            elif not end.good:
                self._say(f"{words[0]}: {end.lines[-1] if end.lines else 'it said nothing'}", True)
            else:
                self._say(f"{words[0]}: done", False)
                if changes:
                    self._studio.read_back()
                then()

        if not self._runner.run(words, ended):
            self._say("another command runs still: wait, or stop it", True)
            return
        self._did(command_line(words))
        self._output.content = ""
        _set(self._progress, 0.0)
        self._progress.visible = self._stop.visible = True

    def _command_said(self, line: str, share: float | None) -> None:
        self._output.content = _preformatted([line])
        if share is not None:
            _set(self._progress, 100 * share)

    def _dive(self, seconds: int) -> None:
        folder = f"{self._out}/dive-{time.strftime('%H%M%S')}"
        words = dive_words(self._studio.session.autosave, folder, seconds, self._studio.pose.surroundings)

        def watch() -> None:
            film = self._studio.session.autosave.parent / folder / "overlay.mp4"
            self._output.content += film_html(film.read_bytes())

        self._run(words, then=watch)

    def close(self) -> None:
        """Stop what runs."""
        self._runner.stop()

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

    def _have_other(self, other: Covered) -> None:
        if self._covered is None:
            return
        rows = (
            ("covered", "{:.1%}", "covered"),
            ("upper half", "{:.1%}", "upper"),
            ("lower half", "{:.1%}", "lower"),
            ("mean field of view", "{:.0f} msr", "mean_msr"),
            ("resolution", "{:.1f} px/deg", "pixels_per_degree"),
        )
        table = "".join(
            f"<tr><td>{name}&ensp;</td>"
            + "".join(f"<td>{shown.format(getattr(each, key))}&ensp;</td>" for each in (self._covered, other))
            + "</tr>"
            for name, shown, key in rows
        )
        names = f"<tr><th></th><th>this rig</th><th>{escape(other.rig.name)}</th></tr>"
        self._beside.content = f'<table style="font-size:0.9em">{names}{table}</table>'

    def _have_checks(self, checked: Checked) -> None:
        with self._lock:
            self._checked = checked
            self._show_verdict()
        self._show_pick()

    def _have_judgement(self, judged: Judgement) -> None:
        with self._lock:
            self._judged = judged
            self._show_verdict()

    def _show_shell(self) -> None:
        if self._covered is None:
            return
        self._scene.show_shell(self._covered.shell, visible=self._shell_shown.value)
        rows = [("seen, darker by more poses", (42, 157, 143), self._covered.covered), *self._covered.shell.blind]
        self._legend.content = _padded(
            "".join(
                f'<div><span style="display:inline-block;width:0.9em;height:0.9em;background:rgb{colour}"></span> '
                f"{escape(name)}: {share:.1%}</div>"
                for name, colour, share in rows
            )
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
        if self._checked is not None and self._checked.print_s:
            hours, source = (
                sum(self._checked.print_s.values()) / 3600,
                "sliced" if self._checked.sliced else "estimated",
            )
            rows.append(("print time", f"{hours:.1f} h, {source}"))
        if self._parts is not None:
            mass = 1000 * sum(self._parts.mass_kg.values())
            rows.append(("mount", f"{mass:.0f} g, {len(self._parts.mass_kg)} parts"))
        table = "".join(f"<tr><td>{escape(name)}&ensp;</td><td><b>{escape(text)}</b></td></tr>" for name, text in rows)
        self._verdict.content = _padded(f"{self._checks()}<table>{table}</table>")

    def _checks(self) -> str:
        if self._judged is None:
            return ""
        if self._judged.sentences:
            return "".join(_mark(each, wrong=True) for each in self._judged.sentences)
        said = _mark("the rig: nothing in the way by its numbers", wrong=False)
        checked = self._checked
        if checked is None or checked.rig != self._studio.session.rig:
            return said + '<p style="margin:0.2em 0">the mount is checked when nothing moves, about a minute ...</p>'
        said += "".join(_mark(each, wrong=True) for each in checked.problems)
        return said + "".join(_row_mark(*row) for row in checked.rows)

    def _pick(self, name: str) -> None:
        self._picked = name
        self._show_pick()

    def _show_pick(self) -> None:
        name = self._picked
        if self._parts is None or name is None:
            return
        mass = self._parts.mass_kg.get(name)
        facts = [f"**{name.replace('_', ' ')}**"] + ([] if mass is None else [f"{1000 * mass:.1f} g"])
        if self._checked is not None and name in self._checked.print_s:
            facts.append(f"{self._checked.print_s[name] / 3600:.1f} h to print")
        if self._checked is not None and name in self._checked.clearance_mm:
            facts.append(f"{self._checked.clearance_mm[name]:.1f} mm clear of what moves past it")
        self._picked_part.content = ", ".join(facts)

    def _pull(self, direction: FloatArray) -> None:
        """Turn the gaze to where it is dragged."""
        if self._studio.look_towards(direction):
            pose = self._studio.pose
            _set(self._q1, pose.q1_deg)
            _set(self._q2, pose.q2_deg)
            self._scene.turn(pose.q1_deg, pose.q2_deg)

    def _say(self, sentence: str, wrong: bool) -> None:
        self._said.content = _padded(_mark(sentence, wrong=wrong))

    def _did(self, line: str) -> None:
        with self._lock:
            if self._lines and self._lines[0] == line:
                return
            self._lines.appendleft(line)
            text = "\n".join(self._lines)
        self._shown_lines.content = _preformatted([text])


def _set(handle: Any, value: Any) -> None:
    if handle.value != value:
        handle.value = value


def _padded(html: str) -> str:
    """HTML as far from the panel's edges as its inputs are."""
    return f'<div style="padding:0 0.8em;font-size:0.875em">{html}</div>'


def _mark(sentence: str, *, wrong: bool) -> str:
    mark, colour = ("&#10007;", RED) if wrong else ("&#10003;", GREEN)
    return f'<p style="color:{colour};margin:0.2em 0">{mark} {escape(sentence)}</p>'


def _row_mark(check: str, counts: str, nearest: str) -> str:
    return f'<div title="{escape(nearest)}">{_mark(f"{check}: {counts}", wrong="failed" in counts)}</div>'


def _preformatted(lines: Iterable[str]) -> str:
    text = escape("\n".join(lines))
    return _padded(
        f'<pre style="white-space:pre-wrap;overflow-wrap:anywhere;user-select:text;font-size:0.8em">{text}</pre>'
    )


def film_html(film: bytes) -> str:
    """A film in the page itself: the server has no other files."""
    source = f"data:video/mp4;base64,{base64.b64encode(film).decode()}"
    return f'<video src="{source}" controls autoplay muted loop style="width:100%"></video>'
