"""The one place where what went wrong becomes a sentence on stderr and an exit status.

Bad input ends with 2 and what good input could not reach (a full disk, no memory, a missing library) with 1, each with
a sentence. What is neither is a mistake of ours: its traceback goes into a file, and the sentence says where it is.
"""

from __future__ import annotations

import csv
import errno
import importlib.metadata
import platform
import shlex
import sys
import tempfile
import traceback
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import ParamSpec, TypeVar

import typer

from mirrorgaze.interrupts import INTERRUPTED

FAILED = 1
BAD_INPUT = 2
HOUSE = ("rigs", "optics", "cad", "scenes", "tracking", "dives", "reports", "studio", "mirrorgaze")
"""The packages whose `ValueError` is a sentence for the user."""

WRONG_PATH = (FileNotFoundError, FileExistsError, IsADirectoryError, NotADirectoryError, PermissionError)
WRONG_NAME = (errno.ENAMETOOLONG, errno.ELOOP)

FAILURES = {"optics.kernels.backend": "BackendError", "dives": "DiveStoppedError"}
"""Errors of ours, by module, that say what went wrong with good input."""

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
            status, sentence = _told(error)
            typer.echo(f"mirrorgaze: {sentence}", err=True)
            raise typer.Exit(status) from error

    return wrapped


def _is_usage(error: Exception) -> bool:
    """Whether it is the command line's own error, which it shows itself."""
    return any(kind.__name__ in ("ClickException", "Abort") for kind in type(error).__mro__)


def _told(error: Exception) -> tuple[int, str]:
    """Exit status and sentence."""
    if _is_bad_input(error):
        return BAD_INPUT, _sentence(error)
    return FAILED, _sentence(error) if _is_failure(error) else _report(error)


def _is_bad_input(error: Exception) -> bool:
    if isinstance(error, OSError):
        return isinstance(error, WRONG_PATH) or error.errno in WRONG_NAME
    return isinstance(error, UnicodeDecodeError | csv.Error) or (
        isinstance(error, ValueError) and _comes_from_house(error)
    )


def _is_failure(error: Exception) -> bool:
    if isinstance(error, OSError | MemoryError | ImportError):
        return True
    # Looked up, not imported: a module that nobody has loaded cannot have failed.
    loaded = ((sys.modules.get(module), name) for module, name in FAILURES.items())
    return any(module is not None and isinstance(error, getattr(module, name)) for module, name in loaded)


def _comes_from_house(error: Exception) -> bool:
    """Whether our code raised it, and not a library that it called with something unforeseen."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    module = trace.tb_frame.f_globals.get("__name__", "") if trace is not None else ""
    return module.partition(".")[0] in HOUSE


def _sentence(error: Exception) -> str:
    match error:
        case FileNotFoundError() if _working_folder_is_gone():
            sentence = "the working folder was deleted or moved; change to one that is there"
        case OSError() if error.strerror and error.filename:
            sentence = f"{error.filename}: {error.strerror}"
        case UnicodeDecodeError():
            sentence = f"expected text in UTF-8, got byte 0x{error.object[error.start]:02x} at byte {error.start}"
        case csv.Error():
            sentence = f"expected fields with commas between them in a CSV file, got {error}"
        case MemoryError():
            sentence = "there is not enough memory; ask for less (a smaller image, fewer samples), or allow more"
        case ImportError():
            sentence = f"a library cannot be loaded ({error}); mirrorgaze doctor says what is missing"
        case _:
            sentence = str(error) or type(error).__name__
    return sentence


def _working_folder_is_gone() -> bool:
    try:
        Path.cwd()
    except FileNotFoundError:
        return True
    return False


def _report(error: Exception) -> str:
    """Sentence on a mistake of ours, whose traceback is kept in a file to be sent to us."""
    what = f"{type(error).__name__}: {str(error).partition(chr(10))[0][:200]}"
    content = "\n".join(
        [
            f"mirrorgaze {importlib.metadata.version('mirrorgaze')}, Python {platform.python_version()}",
            platform.platform(),
            shlex.join(sys.argv),
            "",
            "".join(traceback.format_exception(error)),
        ]
    )
    try:
        with tempfile.NamedTemporaryFile(
            "w", prefix="mirrorgaze-", suffix=".txt", delete=False, encoding="utf-8", errors="replace"
        ) as file:
            file.write(content)
    except OSError:
        return f"this is a mistake of the program ({what}); please report it with what follows\n{content}"
    place = Path(file.name)
    return f"this is a mistake of the program ({what}); please report it with {place}, which says where it happened"
