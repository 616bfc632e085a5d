"""What the user of a command waits for: told while it works, and in the end."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

import typer

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def with_clock(command: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Wrap a command so that it says in the end, on stderr, how long its user has waited, and for what.

    What it says of each part (`optics.kernels.clock`) begins with what it logs of it (`mirrorgaze.output.print_step`).
    """

    @wraps(command)
    def wrapped(*arguments: Parameters.args, **options: Parameters.kwargs) -> Result:
        from optics.kernels.clock import CLOCK

        CLOCK.restart()
        try:
            result = command(*arguments, **options)
        except typer.Exit:
            # A result that is not good was waited for as well.
            _tell()
            raise
        _tell()
        return result

    return wrapped


def _tell() -> None:
    from optics.kernels.clock import CLOCK

    waited = CLOCK.sentence()
    if waited:
        typer.echo(waited, err=True)
        CLOCK.keep()
