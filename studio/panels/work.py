"""Work that takes a while: saving, and commands with progress and Stop."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import Any

import viser

from studio.commands import Ended, Runner
from studio.controller import Studio
from studio.lines import command_line, dive_words, search_words, size_words
from studio.panels.markup import film_html, preformatted, put_value
from studio.results import Covered

SEARCHED_RIGS = 4
"""Designs of a search that become rig files."""
COMPARED = (
    ("covered", "{:.1%}", "covered"),
    ("upper half", "{:.1%}", "upper"),
    ("lower half", "{:.1%}", "lower"),
    ("mean field of view", "{:.0f} msr", "mean_msr"),
    ("resolution", "{:.1f} px/deg", "pixels_per_degree"),
)
"""Of two rigs: name, how it is shown, attribute of `Covered`."""


class WorkPanel:
    """Buttons that run commands, and those of the rig file.

    Parameters
    ----------
    gui : GuiApi
    studio : Studio
        Hears of what is said and done.
    """

    def __init__(self, gui: viser.GuiApi, studio: Studio) -> None:
        self._gui, self._studio = gui, studio
        self._runner = Runner(studio.session.autosave.parent, self._command_said)
        self._progress = gui.add_progress_bar(0.0, visible=False)
        self._stop = gui.add_button("Stop", visible=False)
        self._stop.on_click(lambda _: self._runner.stop())
        self._rig_file()
        self._size()
        self._place()
        self._search()
        with gui.add_folder("Export the mount", expand_by_default=False):
            self._button("Export", lambda: self._run(("export", self._file, "-o", f"{self._out}/mount")))
        with gui.add_folder("Short dive", expand_by_default=False):
            seconds = gui.add_slider("duration (s)", 10, 60, 5, 15)
            self._button("Dive", lambda: self._dive(seconds.value))
        with gui.add_folder("Beside another rig", expand_by_default=False):
            other = gui.add_text("preset or file", "bluerov2")
            self._button("Put it beside", lambda: studio.set_beside(other.value))
            self._beside = gui.add_html("")
        self._output = gui.add_html("")

    def _rig_file(self) -> None:
        session = self._studio.session
        with self._gui.add_folder("Rig file"):
            own = session.own_file
            name = self._gui.add_text("file", str(own or Path.cwd() / f"my-{session.rig.name}.toml"))
            self._button("Save", lambda: self._studio.save(Path(name.value)))
            self._button("Back to the file", self._studio.back_to_file)
            self._gui.add_markdown(
                f"Every change is kept in `{session.autosave.name}`; the next start goes on from there."
            )

    def _size(self) -> None:
        with self._gui.add_folder("Size the mirrors for a window", expand_by_default=False):
            window = self._gui.add_text("window", "0.2", hint="0.2 of the image's sides, 320x240 px or 20x15deg")
            azimuth = self._gui.add_vector2("azimuth, from and to (deg)", (-60.0, 60.0), step=1.0)
            elevation = self._gui.add_vector2("elevation, from and to (deg)", (-30.0, 30.0), step=1.0)
            self._button(
                "Size",
                lambda: self._run(size_words(self._file, window.value, azimuth.value, elevation.value), changes=True),
            )

    def _place(self) -> None:
        with self._gui.add_folder("Place again", expand_by_default=False):
            self._gui.add_markdown(
                "Place camera, mirrors and anchors again on a hull from a file, as far as they are not pinned."
            )
            self._button("Place", lambda: self._run(("place", self._file), changes=True))

    def _search(self) -> None:
        with self._gui.add_folder("Search around here", expand_by_default=False):
            designs = self._gui.add_slider("designs", 500, 20_000, 500, 2_000)
            take = self._gui.add_slider("design of the table", 1, SEARCHED_RIGS, 1, 1)
            self._button("Search", lambda: self._run(search_words(self._file, self._out, designs.value)))
            self._button(
                "Take the design",
                lambda: self._run(search_words(self._file, self._out, designs.value, take.value), changes=True),
            )

    def close(self) -> None:
        """Stop what runs."""
        self._runner.stop()

    def compare(self, this: Covered | None, other: Covered) -> None:
        """Show the coverage of the rig beside next to this one's."""
        if this is None:
            return
        table = "".join(
            f"<tr><td>{name}&ensp;</td>"
            + "".join(f"<td>{shown.format(getattr(each, key))}&ensp;</td>" for each in (this, other))
            + "</tr>"
            for name, shown, key in COMPARED
        )
        names = f"<tr><th></th><th>this rig</th><th>{escape(other.rig.name)}</th></tr>"
        self._beside.content = f'<table style="font-size:0.9em">{names}{table}</table>'

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
            self._output.content = preformatted(end.lines)
            if end.stopped:
                self._studio.heard.said(f"{words[0]}: stopped", False)
            elif not end.good:
                self._studio.heard.said(f"{words[0]}: {end.lines[-1] if end.lines else 'it said nothing'}", True)
            else:
                self._studio.heard.said(f"{words[0]}: done", False)
                if changes:
                    self._studio.read_back()
                then()

        if not self._runner.run(words, ended):
            self._studio.heard.said("another command runs still: wait, or stop it", True)
            return
        self._studio.heard.did(command_line(words))
        self._output.content = ""
        put_value(self._progress, 0.0)
        self._progress.visible = self._stop.visible = True

    def _command_said(self, line: str, share: float | None) -> None:
        self._output.content = preformatted([line])
        if share is not None:
            put_value(self._progress, 100 * share)

    def _dive(self, seconds: int) -> None:
        folder = f"{self._out}/dive-{time.strftime('%H%M%S')}"
        words = dive_words(self._studio.session.autosave, folder, seconds, self._studio.pose.surroundings)

        def watch() -> None:
            film = self._studio.session.autosave.parent / folder / "overlay.mp4"
            self._output.content += film_html(film.read_bytes())

        self._run(words, then=watch)
