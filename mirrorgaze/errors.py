"""The one place where what went wrong becomes a sentence on stderr and an exit status."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

import typer

FAILED = 1
BAD_INPUT = 2

HOUSE = ("rigs", "optics", "cad", "scenes", "tracking", "dives", "reports", "studio", "mirrorgaze")
"""The packages whose `ValueError` is a sentence for the user."""

WRONG_PATH = (FileNotFoundError, FileExistsError, IsADirectoryError, NotADirectoryError, PermissionError)

FAILURES = {"optics.kernels.backend": "BackendError", "dives": "DiveStoppedError"}
"""Errors of ours, by module, that say what went wrong with good input."""

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def with_exit_status(command: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Wrap a command so that bad input ends it with 2 and failure with 1, each with a sentence.

    What is neither keeps its traceback: it is a mistake of ours, and the traceback belongs into the report.
    """

    @wraps(command)
    def wrapped(*arguments: Parameters.args, **options: Parameters.kwargs) -> Result:
        try:
            return command(*arguments, **options)
        except Exception as error:
            status = _status(error)
            if status is None:
                raise
            typer.echo(f"mirrorgaze: {_sentence(error)}", err=True)
            raise typer.Exit(status) from None

    return wrapped


def _status(error: Exception) -> int | None:
    if isinstance(error, WRONG_PATH) or (isinstance(error, ValueError) and _comes_from_house(error)):
        return BAD_INPUT
    if isinstance(error, OSError) and not isinstance(error, BrokenPipeError):
        return FAILED
    # Looked up, not imported: a module that nobody has loaded cannot have failed.
    for module, name in FAILURES.items():
        loaded = sys.modules.get(module)
        if loaded is not None and isinstance(error, getattr(loaded, name)):
            return FAILED
    return None


def _comes_from_house(error: Exception) -> bool:
    """Whether our code raised it, and not a library that it called with something unforeseen."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    module = trace.tb_frame.f_globals.get("__name__", "") if trace is not None else ""
    return module.partition(".")[0] in HOUSE


def _sentence(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror and error.filename:
        return f"{error.filename}: {error.strerror}"
    return str(error)
