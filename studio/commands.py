"""Long work as the very commands that a terminal would run: they can be copied, watched and stopped."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from optics.kernels.child_programs import ENDS_WITH_US

COUNTED = re.compile(r"(\d+) of (\d+)")
"""How commands say how far they are."""
LAST_LINES = 40
STOP_S = 5.0
"""How long a command that was told to stop may take, before it is killed."""
NICE = 5


@dataclass(frozen=True)
class Ended:
    """How a command ended.

    Attributes
    ----------
    good : bool
    stopped : bool
        By the user.
    lines : tuple of str
        The last that it said.
    """

    good: bool
    stopped: bool
    lines: tuple[str, ...]


@dataclass
class Runner:
    """Runs one command of mirrorgaze at a time.

    Attributes
    ----------
    folder : Path
        Where it runs.
    said : callable
        Takes each line that it prints, and the share that is done, where the line says it.
    """

    folder: Path
    said: Callable[[str, float | None], None] = lambda line, share: None
    _process: subprocess.Popen[str] | None = None
    _is_busy: bool = False
    _stopped: bool = False
    _lock: threading.RLock = field(default_factory=threading.RLock)

    def run(self, words: Sequence[str], ended: Callable[[Ended], None]) -> bool:
        """Begin a command, such as ``("place", "my.toml")``; False when another one runs still."""
        with self._lock:
            if self._is_busy:
                return False
            self._is_busy, self._stopped = True, False
        threading.Thread(target=self._watch, args=(words, ended), daemon=True).start()
        return True

    def stop(self) -> None:
        """Stop the command that runs, if one does."""
        with self._lock:
            process, self._stopped = self._process, True
        if process is None:
            return
        process.terminate()
        try:
            process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()

    def _watch(self, words: Sequence[str], ended: Callable[[Ended], None]) -> None:
        # Begun here and not where it is asked for: the system ends it with this thread, which ends after it.
        process = self._begin(words)
        lines: deque[str] = deque(maxlen=LAST_LINES)
        assert process.stdout is not None
        with process.stdout as said:
            for line in said:
                lines.append(line.rstrip())
                self.said(lines[-1], share_done(line))
        status = process.wait()
        with self._lock:
            self._process, self._is_busy, stopped = None, False, self._stopped
        ended(Ended(good=status == 0, stopped=stopped, lines=tuple(lines)))

    def _begin(self, words: Sequence[str]) -> subprocess.Popen[str]:
        with self._lock:
            self._process = subprocess.Popen(
                [*ENDS_WITH_US, sys.executable, "-m", "mirrorgaze", *words],
                cwd=self.folder,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                # Ctrl-C ends the page, and the page its command.
                start_new_session=True,
            )
            # Images come first.
            os.setpriority(os.PRIO_PROCESS, self._process.pid, NICE)
            if self._stopped:
                self._process.terminate()
            return self._process


def share_done(line: str) -> float | None:
    """Share that is done by a line such as ``360 of 720 frames``; None for a line that does not say."""
    found = COUNTED.search(line)
    if found is None or int(found[2]) == 0:
        return None
    return min(int(found[1]) / int(found[2]), 1.0)
