"""The one place where what went wrong becomes a sentence on stderr and an exit status.

Bad input ends with 2, and what good input could not reach and mistakes of ours with 1 (`optics.kernels.faults`).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

import typer

from mirrorgaze.interrupts import INTERRUPTED
from optics.kernels.faults import Fault, fault_of, sentence_of

FAILED = 1
BAD_INPUT = 2

EXPECTED = {"int_parsing": "a whole number", "float_parsing": "a number"}
"""What Pydantic's error types mean on a command line, where its own words would speak of parsing strings."""

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def with_exit_status(command: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Wrap a command so that it ends with a sentence and an exit status, whatever it raises."""

    @wraps(command)
    def wrapped(*arguments: Parameters.args, **options: Parameters.kwargs) -> Result:
        try:
            return command(*arguments, **options)
        except KeyboardInterrupt:
            typer.echo("mirrorgaze: stopped", err=True)
            raise typer.Exit(INTERRUPTED) from None
        except BrokenPipeError:
            raise  # whoever read our output has gone, and wants no more sentences
        except Exception as error:
            if isinstance(error, typer.Exit) or _is_usage(error):
                raise
            typer.echo(f"mirrorgaze: {sentence_of(error)}", err=True)
            raise typer.Exit(BAD_INPUT if fault_of(error) is Fault.BAD_INPUT else FAILED) from error

    return wrapped


def _is_usage(error: Exception) -> bool:
    """Whether it is the command line's own error, which it shows itself."""
    return any(kind.__name__ in ("ClickException", "Abort") for kind in type(error).__mro__)


def said_of_value(error: typer.BadParameter) -> str:
    """What is wrong with a value of the command line; Typer has it from Pydantic, whose words do not name the value."""
    from pydantic import ValidationError

    if not isinstance(error.__cause__, ValidationError):
        return error.message
    detail = error.__cause__.errors()[0]
    kind, said = detail["type"], detail["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    bound = f"a number {said}" if kind.startswith(("greater_than", "less_than")) else None
    expected = EXPECTED.get(kind, bound)
    return said if expected is None else f"expected {expected}, got {detail['input']!r}"
