"""Ctrl-C ends a command at once and whole, whatever it is doing.

Python's own way, an exception in whichever line is running, does harm in libraries: raised while a kernel is recorded
or a module is imported it is swallowed, turned into another error, or ends the process with an abort. All that we keep
appears whole or not at all, so the process may end anywhere: a thread hears of the signal, removes what is
half-written, and ends it. Where code listens to Ctrl-C itself (`signal.signal`), it is left to that code.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

INTERRUPTED = 130
"""128 and the number of the signal, as shells have it."""

_last_words = ["stopped"]


def exit_on_interrupt() -> None:
    """End this process with a sentence and status 130 at Ctrl-C, from now on; once for a process."""
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        return  # ours already, or somebody's who started us to ignore it
    heard, told = os.pipe()
    os.set_blocking(told, False)
    signal.signal(signal.SIGINT, _left_to_the_thread)
    signal.set_wakeup_fd(told, warn_on_full_buffer=False)
    threading.Thread(target=_listen, args=(heard,), name="interrupts", daemon=True).start()


@contextmanager
def stopping_says(sentence: str) -> Iterator[None]:
    """Let Ctrl-C say this, where a user wants to know more than that it was heard."""
    _last_words.append(sentence)
    try:
        yield
    finally:
        _last_words.pop()


def _left_to_the_thread(number: int, frame: object) -> None:
    """Python wants a handler for a signal that it is to tell of."""


def _listen(heard: int) -> None:
    while True:
        (number,) = os.read(heard, 1)
        if number == signal.SIGINT and signal.getsignal(signal.SIGINT) is _left_to_the_thread:
            _end()


def _end() -> None:
    files = sys.modules.get("rigs.atomic_files")
    if files is not None and hasattr(files, "remove_unfinished"):  # it may just be being imported
        files.remove_unfinished()
    # Not through sys.stderr, which the main thread may hold.
    os.write(2, f"mirrorgaze: {_last_words[-1]}\n".encode())
    os._exit(INTERRUPTED)
