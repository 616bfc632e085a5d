"""Bytes to and from a device on a serial port of a Unix machine."""

from __future__ import annotations

import errno
import os
import select
import termios
import time
import tty
from pathlib import Path
from types import TracebackType
from typing import Self

GONE = (errno.EIO, errno.ENXIO, errno.ENODEV)
"""What the system says of a port whose device has been unplugged."""


class SerialPort:
    """A raw serial port: eight bits, no echo, no flow control.

    The baud rate stays as it is; devices on USB have none.

    Parameters
    ----------
    path : Path
        Such as ``/dev/ttyACM0``.
    timeout_s : float
        How long an answer may take.

    Raises
    ------
    OSError
        `FileNotFoundError` or `PermissionError` among others, when it cannot be opened.
    ValueError
        When it is something else than a serial port.
    """

    def __init__(self, path: Path, *, timeout_s: float = 0.5):
        self._path = path
        self._timeout_s = timeout_s
        self._file = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        if not os.isatty(self._file):
            self.close()
            raise ValueError(f"{path}: expected a serial port")
        tty.setraw(self._file)
        termios.tcflush(self._file, termios.TCIOFLUSH)

    def write(self, message: bytes) -> None:
        """Send all of a message; `TimeoutError` when the device does not take it."""
        deadline_s = time.monotonic() + self._timeout_s
        while message:
            if not select.select([], [self._file], [], max(0.0, deadline_s - time.monotonic()))[1]:
                raise TimeoutError(f"{self._path}: expected it to take {len(message)} bytes, it does not")
            try:
                message = message[os.write(self._file, message) :]
            except OSError as error:
                raise self._named(error) from None

    def read(self, count: int) -> bytes:
        """Next bytes; `TimeoutError` when fewer come."""
        deadline_s = time.monotonic() + self._timeout_s
        answer = b""
        while len(answer) < count:
            if not select.select([self._file], [], [], max(0.0, deadline_s - time.monotonic()))[0]:
                raise TimeoutError(
                    f"{self._path}: expected an answer of {count} bytes within {self._timeout_s:g} s, got {len(answer)}"
                )
            try:
                part = os.read(self._file, count - len(answer))
            except OSError as error:
                raise self._named(error) from None
            if not part:
                raise self._named(OSError(errno.EIO, "end of file"))
            answer += part
        return answer

    def close(self) -> None:
        """Give the port back."""
        os.close(self._file)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _named(self, error: OSError) -> OSError:
        reason = "the device is gone" if error.errno in GONE else error.strerror
        return OSError(error.errno, reason, str(self._path))
