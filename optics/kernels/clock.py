"""The clock of a command: what it is doing, how long that took the last time, and what its user has waited for.

Work is a row of parts. One begins when the one before it ends; one that is made on the way (`Clock.inside`), such as
what is not yet in the cache, interrupts the other. All time is counted once, that of imports as well: a part has the
seconds in which nothing else was going on, and what no part has is told as the rest.

How long the parts of earlier commands took is kept beside the cache (`TIMES_FILE`), to say how long one will take.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from optics.kernels.cache_contents import cache_folder

TIMES_FILE = "times.json"
WORTH_KEEPING_S = 1.0
"""Shorter parts are over before anybody asks."""

MOST_KEPT = 200
"""Names whose times are kept, the latest."""

SMALLEST_SHARE = 0.01
"""Of the time, what a part must have taken to be told by itself."""

IMPORTS, REST = "imports", "rest"


class Clock:
    """Seconds of what a command does, by part; the name of a part is what a person reads of it."""

    def __init__(self) -> None:
        # What the process did before this module was loaded, imports, has taken about as much time as it has computed.
        self._mark = self._begun = time.perf_counter() - time.process_time()
        self._spent: dict[str, float] = {}
        self._part: str | None = IMPORTS
        self._first = True

    def restart(self) -> None:
        """A command begins: the first one of a process began with the process."""
        if not self._first:
            self._mark = self._begun = time.perf_counter()
            self._spent, self._part = {}, None
        self._first = False

    def begin(self, name: str | None) -> None:
        """The part before ends, and this one begins; None: no part does."""
        now = time.perf_counter()
        if self._part is not None:
            self._spent[self._part] = self._spent.get(self._part, 0.0) + now - self._mark
        self._mark, self._part = now, name

    @contextmanager
    def inside(self, name: str) -> Iterator[None]:
        """A part that interrupts the one before it, which then goes on."""
        before = self._part
        self.begin(name)
        try:
            yield
        finally:
            self.begin(before)

    def told_apart(self, seconds: float, name: str) -> None:
        """Count seconds of the part that is going on for another one: its compiler, say, which ran in between."""
        self.begin(self._part)
        if self._part is not None:
            self._spent[self._part] -= seconds
            self._spent[name] = self._spent.get(name, 0.0) + seconds

    def waited(self) -> tuple[float, dict[str, float]]:
        """Seconds since the command began, and those of each part in their order, with what no part has."""
        self.begin(self._part)
        whole = self._mark - self._begun
        parts = dict(self._spent)
        return whole, parts | {REST: whole - sum(parts.values())}

    def sentence(self) -> str:
        """What the user has waited for; empty where nothing but imports was told to the clock."""
        whole, parts = self.waited()
        if set(parts) <= {IMPORTS, REST}:
            return ""
        grouped: dict[str, float] = {}
        for name, spent in parts.items():
            # Parts of one kind of work, as `checks: solids` and `checks: slicer`, are one in the sum.
            group = name.partition(":")[0]
            grouped[group] = grouped.get(group, 0.0) + spent
        small = [name for name, spent in grouped.items() if spent < SMALLEST_SHARE * whole and name != REST]
        grouped[REST] = grouped.pop(REST) + sum(grouped.pop(name) for name in small)
        if grouped[REST] < SMALLEST_SHARE * whole:
            del grouped[REST]
        told = ", ".join(f"{name} {duration(spent)}" for name, spent in grouped.items())
        return f"waited {duration(whole)}: {told}"

    def keep(self) -> None:
        """Keep how long the parts took; a cache that cannot be written costs a guess, no result."""
        spent = {
            name: round(s, 1)
            for name, s in self.waited()[1].items()
            # What has a number in its name will not come again.
            if s >= WORTH_KEEPING_S and not any(map(str.isdecimal, name))
        }
        if not spent.keys() - {IMPORTS, REST}:
            return
        # The latest last, and those that nobody has made for longest forgotten.
        times = {name: s for name, s in kept_times().items() if name not in spent} | spent
        from rigs.atomic_files import write_text  # noqa: PLC0415  (commands that keep nothing load no rigs)

        with suppress(OSError):
            cache_folder().mkdir(parents=True, exist_ok=True)
            write_text(cache_folder() / TIMES_FILE, json.dumps(dict(list(times.items())[-MOST_KEPT:]), indent=1))


CLOCK = Clock()
"""That of the process, which is one command."""


def kept_times() -> dict[str, float]:
    """Seconds that parts took the last time, by name; none when they cannot be read."""
    try:
        times = json.loads((cache_folder() / TIMES_FILE).read_text(encoding="utf-8"))
        told = {str(name): float(seconds) for name, seconds in times.items()}
        return {name: seconds for name, seconds in told.items() if math.isfinite(seconds)}
    except (OSError, ValueError, AttributeError, TypeError, RecursionError):
        return {}


def last_time(name: str) -> str:
    """Words on how long a part took the last time, to be put behind its name; empty when that is not known."""
    seconds = kept_times().get(name)
    return "" if seconds is None else f" ({duration(seconds)} the last time)"


class Pace:
    """How fast something goes, since it was first reported: what was done before is not this command's pace."""

    def __init__(self) -> None:
        self._first: tuple[int, float] | None = None

    def to_go(self, done: int, total: int) -> str:
        """Words on how long the rest takes, to be put behind a count; empty before there is a pace, and at the end."""
        if self._first is None:
            self._first = done, time.perf_counter()
        first, begun_s = self._first
        if not first < done < total:
            return ""
        return f", {duration((time.perf_counter() - begun_s) * (total - done) / (done - first))} to go"


def duration(seconds: float) -> str:
    """Duration as people say it: 0.8 s, 85 s, 4 min 10 s, 2 h 5 min."""
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 120:
        return f"{whole} s"
    if whole < 7200:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
