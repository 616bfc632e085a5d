"""What the workers of the tests do; of a module of its own that loads in no time, since they load it."""

import os
import signal
import time
from pathlib import Path


def square(folder, number, kills):
    """Write the square of a number and return it; -1 raises, -2 kills, one that `kills` does so when tried first."""
    tried = Path(folder) / f"{number}.tried"
    before = tried.exists()
    with tried.open("ab") as file:
        file.write(b".")
    if number == -1:
        raise ValueError("x" * 1_000_000)
    if number == -2 or (kills and not before):
        os.kill(os.getpid(), signal.SIGKILL)
    (Path(folder) / f"{number}.square").write_text(str(number**2))
    return number**2


def endless(folder, number):
    """Write down by which process it is done, and do not end."""
    (Path(folder) / f"{number}.began").write_text(str(os.getpid()))
    time.sleep(3600)
