"""A dead man's switch for servos: where the loop stops sending, or fails, they are stopped or sent to their rest.

It watches from a thread of its own, so it needs this process alive; what becomes of the servos when that is killed is
the controller's to decide (a Maestro's own serial timeout).
"""

from __future__ import annotations

import logging
import threading
import time
from types import TracebackType
from typing import Protocol, Self

from optics.kernels.arrays import FloatArray
from tracking.protocols import MirrorDriver, MirrorReport

LOG = logging.getLogger(__name__)


class StoppableMirrors(MirrorDriver, Protocol):
    """A driver that can do what its rig says for when nobody sends any more."""

    def make_safe(self) -> None:
        """Stop or park; `OSError` when the device does not take it."""


class DeadMan:
    """A driver that is watched, for a `with` statement; the time begins with the first command.

    Parameters
    ----------
    mirrors : StoppableMirrors
    silent_after_s : float
        Without a command for so long the mirrors are made safe, once; the next command turns them again.
    """

    def __init__(self, mirrors: StoppableMirrors, *, silent_after_s: float):
        self._mirrors = mirrors
        self._silent_after_s = silent_after_s
        # Held by whoever talks to the device: commands and the watch never meet.
        self._turn = threading.Condition()
        self._sent_s: float | None = None
        self._ended = False
        self._thread = threading.Thread(target=self._watch, name="dead man", daemon=True)

    def command(self, q: FloatArray, time_s: float) -> None:
        """As the driver's."""
        with self._turn:
            self._mirrors.command(q, time_s)
            self._sent_s = time.monotonic()
            self._turn.notify()

    def report(self, time_s: float) -> MirrorReport:
        """As the driver's."""
        with self._turn:
            return self._mirrors.report(time_s)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._turn:
            self._ended = True
            self._turn.notify()
            if error is not None and self._sent_s is not None:
                self._make_safe()
        self._thread.join()

    def _watch(self) -> None:
        with self._turn:
            while not self._ended:
                left_s = None if self._sent_s is None else self._sent_s + self._silent_after_s - time.monotonic()
                if left_s is None or left_s > 0:
                    self._turn.wait(left_s)
                    continue
                LOG.warning("no command for %g s: the mirrors are made safe", self._silent_after_s)
                self._sent_s = None
                self._make_safe()

    def _make_safe(self) -> None:
        try:
            self._mirrors.make_safe()
        except OSError as error:
            LOG.warning("the mirrors could not be made safe: %s", error)
