"""What was done, as lines to copy."""

from __future__ import annotations

import threading
from collections import deque

import viser

from studio.panels.markup import preformatted

LINES_KEPT = 12
"""Of the actions that are shown as commands or Python."""


class LinesPanel:
    """The last actions as commands and Python.

    Parameters
    ----------
    gui : GuiApi
    """

    def __init__(self, gui: viser.GuiApi) -> None:
        self._lines: deque[str] = deque(maxlen=LINES_KEPT)
        self._lock = threading.Lock()
        gui.add_markdown("What was done, newest first, as commands and Python:")
        self._shown = gui.add_html("")

    def did(self, line: str) -> None:
        """Show one more; the same again is not repeated."""
        with self._lock:
            if self._lines and self._lines[0] == line:
                return
            self._lines.appendleft(line)
            text = "\n".join(self._lines)
        self._shown.content = preformatted([text])
