"""The verdict: what is wrong, what is covered, what a part weighs."""

from __future__ import annotations

import threading
from html import escape

import viser

from studio.controller import Studio
from studio.panels.markup import mark, padded, row_mark
from studio.results import Checked, Covered, Judgement, Parts
from studio.rig_scene import RigScene


class VerdictPanel:
    """Checks, key numbers, the covered sphere and the part that was clicked.

    Parameters
    ----------
    gui : GuiApi
    studio : Studio
    scene : RigScene
        Shows the covered sphere.
    """

    def __init__(self, gui: viser.GuiApi, studio: Studio, scene: RigScene) -> None:
        self._studio, self._scene = studio, scene
        self._lock = threading.RLock()
        self._parts: Parts | None = None
        self._judged: Judgement | None = None
        self.covered: Covered | None = None
        self._checked: Checked | None = None
        self._picked: str | None = None
        self._verdict = gui.add_html("<p>the rig is being looked at ...</p>")
        self._shell_shown = gui.add_checkbox("show the covered sphere", True)
        self._shell_shown.on_update(lambda _: self._show_shell())
        self._legend = gui.add_html("")
        self._picked_part = gui.add_markdown("Click a part to read its name, mass, print time and clearance.")

    def have_parts(self, parts: Parts) -> None:
        """Show what the mount weighs."""
        with self._lock:
            self._parts = parts
            self._show_verdict()

    def have_coverage(self, covered: Covered) -> None:
        """Show what is covered."""
        with self._lock:
            self.covered = covered
            self._show_shell()
            self._show_verdict()

    def have_judgement(self, judged: Judgement) -> None:
        """Show what is wrong with the rig by its numbers."""
        with self._lock:
            self._judged = judged
            self._show_verdict()

    def have_checks(self, checked: Checked) -> None:
        """Show what the checks of the mount found."""
        with self._lock:
            self._checked = checked
            self._show_verdict()
        self._show_pick()

    def pick(self, name: str) -> None:
        """Show what is known of a part."""
        self._picked = name
        self._show_pick()

    def _show_shell(self) -> None:
        if self.covered is None:
            return
        self._scene.show_shell(self.covered.shell, visible=self._shell_shown.value)
        rows = [("seen, darker by more poses", (42, 157, 143), self.covered.covered), *self.covered.shell.blind]
        self._legend.content = padded(
            "".join(
                f'<div><span style="display:inline-block;width:0.9em;height:0.9em;background:rgb{colour}"></span> '
                f"{escape(name)}: {share:.1%}</div>"
                for name, colour, share in rows
            )
        )

    def _show_verdict(self) -> None:
        rows = [*self._coverage_rows(), *self._print_rows(), *self._mass_rows()]
        table = "".join(f"<tr><td>{escape(name)}&ensp;</td><td><b>{escape(text)}</b></td></tr>" for name, text in rows)
        self._verdict.content = padded(f"{self._checks()}<table>{table}</table>")

    def _coverage_rows(self) -> list[tuple[str, str]]:
        covered = self.covered
        if covered is None:
            return []
        return [
            ("covered", f"{covered.covered:.1%} of the sphere ({covered.fineness}, {covered.elapsed_s:.2f} s)"),
            ("upper, lower half", f"{covered.upper:.1%}, {covered.lower:.1%}"),
            ("usable field of view", f"{covered.mean_msr:.0f} msr mean, {covered.most_msr:.0f} msr at most"),
            ("resolution", f"{covered.pixels_per_degree:.1f} px per degree"),
        ]

    def _print_rows(self) -> list[tuple[str, str]]:
        if self._checked is None or not self._checked.print_s:
            return []
        hours = sum(self._checked.print_s.values()) / 3600
        return [("print time", f"{hours:.1f} h, {'sliced' if self._checked.sliced else 'estimated'}")]

    def _mass_rows(self) -> list[tuple[str, str]]:
        if self._parts is None:
            return []
        mass = 1000 * sum(self._parts.mass_kg.values())
        return [("mount", f"{mass:.0f} g, {len(self._parts.mass_kg)} parts")]

    def _checks(self) -> str:
        if self._judged is None:
            return ""
        if self._judged.sentences:
            return "".join(mark(each, wrong=True) for each in self._judged.sentences)
        said = mark("the rig: nothing in the way by its numbers", wrong=False)
        checked = self._checked
        if checked is None or checked.rig != self._studio.session.rig:
            return said + '<p style="margin:0.2em 0">the mount is checked when nothing moves, about a minute ...</p>'
        said += "".join(mark(each, wrong=True) for each in checked.problems)
        return said + "".join(row_mark(*row) for row in checked.rows)

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
