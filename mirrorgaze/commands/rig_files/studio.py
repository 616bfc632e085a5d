"""The studio: a rig on a local web page, to be touched."""

from __future__ import annotations

from typing import Annotated

import typer

from mirrorgaze.options import RigArgument
from mirrorgaze.output import print_note


def studio(
    rig: RigArgument,
    tcp_port: Annotated[
        int,
        typer.Option(
            metavar="N", help="TCP port of the page on this machine.", show_default="a free one", min=0, max=65535
        ),
    ] = 0,
    open_page: Annotated[bool, typer.Option("--open", help="Open the page in the browser.")] = False,
    width_px: Annotated[
        int, typer.Option(metavar="N", help="Width of the camera's image, in pixels.", min=32, max=4096)
    ] = 640,
) -> None:
    """Open a rig on a local web page.

    Turn the joints, change the design, see what follows. Prints an address that works on this machine only, and only
    with the token in it; Ctrl-C ends it. Each change is kept in a file beside the rig's (of a preset, in the working
    directory), from which the next start goes on; the rig file itself changes when you save it.

    \b
    Example:
      mirrorgaze studio aqua2 --open
    """
    from studio.server import check_viser, serve_until_interrupted
    from studio.session import Session

    check_viser()
    session = Session(rig)

    def opened(address: str) -> None:
        typer.echo(address)
        print_note("Ctrl-C ends it")
        if open_page:
            typer.launch(address)

    serve_until_interrupted(session, tcp_port=tcp_port, width_px=width_px, opened=opened)
