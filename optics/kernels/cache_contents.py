"""What is in the cache of results: where it is, how much of it may be kept, what goes first, and how to empty it."""

from __future__ import annotations

import math
import os
import re
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

LIMIT_VARIABLE = "MIRRORGAZE_CACHE_LIMIT_GB"
DEFAULT_LIMIT_GB = 5.0
GB = 1e9

ENTRY = re.compile(r"[0-9a-f]{64}\.npz")
PARTIAL = re.compile(r"\.[0-9a-f]{64}\.[0-9a-f]{8}\.partial\.npz")
"""What a program leaves that is stopped while it writes an entry (`rigs.atomic_files`)."""


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One result that is kept.

    Attributes
    ----------
    path : Path
    kind : str
        What the result is; the name of its folder.
    bytes : int
    made_s, used_s : float
        When it was made and when it was used last, seconds since 1970.
    """

    path: Path
    kind: str
    bytes: int
    made_s: float
    used_s: float


@dataclass(frozen=True, kw_only=True)
class KeptKind:
    """All results of one kind that are kept.

    Attributes
    ----------
    kind : str
    entries, bytes : int
        How many, and their size.
    oldest_s : float
        Age of the one that was made first, seconds.
    unused_s : float
        How long ago one of them was used last, seconds.
    """

    kind: str
    entries: int
    bytes: int
    oldest_s: float
    unused_s: float


def cache_folder() -> Path:
    """Where results are kept: $MIRRORGAZE_CACHE, or `mirrorgaze` in the user's cache folder."""
    own = os.environ.get("MIRRORGAZE_CACHE")
    if own:
        return Path(own)
    shared = os.environ.get("XDG_CACHE_HOME")
    return (Path(shared) if shared else Path.home() / ".cache") / "mirrorgaze"


def limit_bytes() -> int:
    """Most that is kept: $MIRRORGAZE_CACHE_LIMIT_GB, or 5 GB.

    Raises
    ------
    ValueError
        When the variable is no number of at least 0.
    """
    said = os.environ.get(LIMIT_VARIABLE) or str(DEFAULT_LIMIT_GB)
    try:
        limit_gb = float(said)
    except ValueError:
        limit_gb = math.nan
    if not 0 <= limit_gb < math.inf:
        raise ValueError(f"{LIMIT_VARIABLE}: expected a number of GB of at least 0, got {said!r}")
    return int(limit_gb * GB)


def entry_path(kind: str, key: str) -> Path:
    """Where a result of a kind is kept."""
    return cache_folder() / kind.replace(" ", "-") / f"{key}.npz"


def entries() -> list[Entry]:
    """All results that are kept, the one that was used last first. Other files in the folder are not the cache's."""
    found = []
    for path in cache_folder().glob("*/*.npz"):
        # Another process may be quicker.
        with suppress(OSError):
            if ENTRY.fullmatch(path.name) or PARTIAL.fullmatch(path.name):
                facts = path.stat()
                times = {"made_s": facts.st_mtime, "used_s": max(facts.st_atime, facts.st_mtime)}
                found.append(Entry(path=path, kind=path.parent.name, bytes=facts.st_size, **times))
    return sorted(found, key=lambda entry: entry.used_s, reverse=True)


def kept_kinds() -> list[KeptKind]:
    """What is kept, by kind."""
    now = time.time()
    by_kind = groupby(sorted(entries(), key=lambda entry: entry.kind), key=lambda entry: entry.kind)
    return [_together(kind, list(members), now) for kind, members in by_kind]


def evict(most_bytes: int) -> None:
    """Remove the results that were not used for longest, until no more than so much is left."""
    kept = 0
    for entry in entries():
        kept += entry.bytes
        if kept > most_bytes:
            entry.path.unlink(missing_ok=True)


def clear_cache(kind: str | None = None) -> list[Entry]:
    """Remove what is kept of a kind, or everything, and say what it was.

    Raises
    ------
    ValueError
        When nothing of the kind is kept.
    """
    kept = entries()
    removed = [entry for entry in kept if kind in {None, entry.kind}]
    if kind is not None and not removed:
        kinds = ", ".join(sorted({entry.kind for entry in kept})) or "none"
        raise ValueError(f"expected a kind that is kept ({kinds}), got {kind!r}")
    for entry in removed:
        entry.path.unlink(missing_ok=True)
    return removed


def _together(kind: str, members: Sequence[Entry], now_s: float) -> KeptKind:
    return KeptKind(
        kind=kind,
        entries=len(members),
        bytes=sum(entry.bytes for entry in members),
        oldest_s=now_s - min(entry.made_s for entry in members),
        unused_s=now_s - max(entry.used_s for entry in members),
    )
