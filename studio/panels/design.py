"""The design: undo and redo, a slider for each number, a choice for each kind."""

from __future__ import annotations

from typing import Any

import viser

from rigs import Rig
from studio.controller import Studio
from studio.design import Number, choices, numbers, value_at
from studio.panels.markup import put_value

OPEN_HEADING = "Mirrors"
"""Whose sliders are not folded away at first."""


class DesignPanel:
    """Sliders and choices of a design.

    Parameters
    ----------
    gui : GuiApi
    studio : Studio
    """

    def __init__(self, gui: viser.GuiApi, studio: Studio) -> None:
        self._gui, self._studio = gui, studio
        self._inputs: dict[str, Any] = {}
        rig = studio.session.rig
        undo_redo = gui.add_button_group("Steps", ("Undo", "Redo"))
        undo_redo.on_click(lambda event: studio.undo() if event.target.value == "Undo" else studio.redo())
        for heading, group in numbers(rig).items():
            if not group:
                continue
            with gui.add_folder(heading, expand_by_default=heading == OPEN_HEADING):
                for number in group:
                    self._number(rig, number)
        with gui.add_folder("Outlines and material", expand_by_default=False):
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

    def follow(self, rig: Rig) -> None:
        """Take over the values of a rig that has changed."""
        for place, handle in self._inputs.items():
            put_value(handle, value_at(rig, place))
