"""The page: which panels are on it, and which of them hears of what."""

from __future__ import annotations

import threading

import viser

from optics.kernels.arrays import FloatArray
from rigs import Rig
from studio.controller import Heard, Studio
from studio.door import Listener
from studio.panels.camera import CameraPanel
from studio.panels.design import DesignPanel
from studio.panels.hand import POINTED
from studio.panels.lines import LinesPanel
from studio.panels.markup import PHONE_STYLE, mark, padded
from studio.panels.verdict import VerdictPanel
from studio.panels.water import add_water
from studio.panels.work import WorkPanel
from studio.results import Covered, Parts
from studio.rig_scene import RigScene

CONTROLS_WIDTH_PX = 380


class Page:
    """The page of a studio.

    Parameters
    ----------
    server : ViserServer
    studio : Studio
        Is started by `open`.
    heard : dict
        Gets who takes what the page's own script tells, by its path.
    """

    def __init__(self, server: viser.ViserServer, studio: Studio, heard: dict[str, Listener]) -> None:
        self._gui, self._studio = server.gui, studio
        self._lock = threading.RLock()
        server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(30, 110, 140))
        server.gui.set_panel_label(f"mirrorgaze studio: {studio.session.rig.name}")
        self._scene = RigScene(server, self._pick, self._pull)
        self._camera = CameraPanel(server.gui, studio, self._scene)
        heard[POINTED] = self._camera.pointed
        self._add_controls()
        studio.heard = Heard(
            changed=self._changed,
            view=self._camera.show,
            parts=self._have_parts,
            covered=self._verdict.have_coverage,
            judged=self._verdict.have_judgement,
            checked=self._verdict.have_checks,
            other_parts=self._scene.put_beside,
            other_covered=self._have_other,
            said=self._say,
            did=self._lines.did,
        )

    def open(self) -> None:
        """Begin: everything is asked for."""
        session = self._studio.session
        if session.recovered:
            self._say(
                f"went on with the changes of the last time ({session.autosave.name}); undo takes them back", False
            )
        self._studio.start()

    def close(self) -> None:
        """Stop what runs."""
        self._work.close()

    def _add_controls(self) -> None:
        self._gui.main_panel.dock_right()
        self._gui.main_panel.set_width(CONTROLS_WIDTH_PX)
        self._gui.add_html(PHONE_STYLE)
        self._said = self._gui.add_html("")
        tabs = self._gui.add_tab_group()
        with tabs.add_tab("Design"):
            self._design = DesignPanel(self._gui, self._studio)
        with tabs.add_tab("Verdict"):
            self._verdict = VerdictPanel(self._gui, self._studio, self._scene)
        with tabs.add_tab("Water"):
            add_water(self._gui, self._studio)
        with tabs.add_tab("Work"):
            self._work = WorkPanel(self._gui, self._studio)
        with tabs.add_tab("Lines"):
            self._lines = LinesPanel(self._gui)

    def _changed(self, rig: Rig) -> None:
        with self._lock:
            self._scene.lay_out(rig)
            self._camera.follow(rig)
            self._design.follow(rig)

    def _have_parts(self, parts: Parts) -> None:
        with self._lock:
            self._scene.put_parts(parts)
            self._verdict.have_parts(parts)

    def _have_other(self, other: Covered) -> None:
        self._work.compare(self._verdict.covered, other)

    def _pick(self, name: str) -> None:
        self._verdict.pick(name)

    def _pull(self, direction: FloatArray) -> None:
        self._camera.pull(direction)

    def _say(self, sentence: str, wrong: bool) -> None:
        self._said.content = padded(mark(sentence, wrong=wrong))
