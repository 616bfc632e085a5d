"""The server of the studio's page: on loopback, behind its door, until Ctrl-C."""

from __future__ import annotations

import importlib.util
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO

from studio.controller import Studio
from studio.session import Session

MISSING = "the studio needs viser, which is not installed: pip install 'mirrorgaze[studio]'"


def check_viser() -> None:
    """Raise a `ValueError` that says what to do when viser is missing."""
    if importlib.util.find_spec("viser") is None:
        raise ValueError(MISSING)


@contextmanager
def served(session: Session, *, tcp_port: int = 0, width_px: int = 640) -> Iterator[str]:
    """Serve a session's page; gives its address.

    Parameters
    ----------
    session : Session
    tcp_port : int
        By default one that is free.
    width_px : int
        Of the camera's image.

    Raises
    ------
    ValueError
        When viser is missing, or the port is taken.
    """
    check_viser()
    import viser  # noqa: PLC0415  (an extra)

    from studio.door import LOOPBACK, Door  # noqa: PLC0415
    from studio.page import Page  # noqa: PLC0415

    door = Door()
    # viser prints its own address, without the token.
    with door.guarding(), redirect_stdout(StringIO()):
        server = viser.ViserServer(LOOPBACK, tcp_port, verbose=False)
    try:
        if tcp_port not in (0, server.get_port()):
            raise ValueError(
                f"--tcp-port {tcp_port}: expected a free port; {server.get_port()} is one, "
                "without --tcp-port any is found"
            )
        studio = Studio(session, width_px=width_px)
        page = Page(server, studio, door.heard)
        try:
            page.open()
            yield door.address(server.get_port())
        finally:
            page.close()
            studio.close()
            session.close()
    finally:
        with redirect_stdout(StringIO()):
            server.stop()


def serve_until_interrupted(session: Session, *, tcp_port: int, width_px: int, opened: Callable[[str], None]) -> None:
    """Serve until Ctrl-C or a signal to end; `opened` takes the address."""
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    with served(session, tcp_port=tcp_port, width_px=width_px) as address:
        opened(address)
        ended.wait()
