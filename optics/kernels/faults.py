"""What an exception tells a person: a sentence, and whose fault it is.

Bad input, and what good input could not reach, get a sentence each. What is neither is a mistake of ours: its traceback
goes into a file, and the sentence says where it is.
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
from enum import Enum
from pathlib import Path

HOUSE = ("rigs", "optics", "cad", "scenes", "tracking", "dives", "reports", "studio", "mirrorgaze")
"""The packages whose `ValueError` is a sentence for the user."""

WRONG_PATH = (FileNotFoundError, FileExistsError, IsADirectoryError, NotADirectoryError, PermissionError)
WRONG_NAME = (errno.ENAMETOOLONG, errno.ELOOP)

FAILURES = {
    "optics.kernels.backend": "BackendError",
    "optics.workers.cluster": "WorkersError",
    "dives": "DiveStoppedError",
}
"""Errors of ours, by module, that say what went wrong with good input."""


class Fault(Enum):
    """What kind of thing went wrong."""

    BAD_INPUT = "what was given cannot be used"
    FAILURE = "good input met what nobody asked for: a full disk, no memory, a missing library"
    BUG = "a mistake of ours"


def fault_of(error: Exception) -> Fault:
    """Whose fault an exception tells of."""
    if _is_bad_input(error):
        return Fault.BAD_INPUT
    return Fault.FAILURE if _is_failure(error) else Fault.BUG


def sentence_of(error: Exception) -> str:
    """Sentence for the user; of a mistake of ours it names the file that its traceback was written to."""
    return _report(error) if fault_of(error) is Fault.BUG else _sentence(error)


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
            sentence = f"expected fields separated by commas in a CSV file, got {error}"
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
