"""The journal of a dive that is being made: what is finished so far, and where everything stood when it was.

A segment is finished when its snapshot is there, which is written last. A dive that was stopped anywhere goes on from
its last finished segment, and whatever was left half-written behind it is written again.
"""

from __future__ import annotations

import fcntl
import json
import shutil
from pathlib import Path
from typing import Any

from rigs.atomic_files import sync, write_text

SEGMENT_FRAMES = 60
"""Fixed: the files must not depend on where a dive was stopped."""

FOLDER = "journal"
IDENTITY, LOCK = "identity", "lock"


class Journal:
    """Journal in a dive's folder; until it is closed it is this process's alone.

    Parameters
    ----------
    folder : Path
        Of the dive.
    identity : str
        What the dive is made from: a journal of another dive is not gone on with.

    Raises
    ------
    ValueError
        When the folder holds the journal of another dive, or another process is at work on it.
    """

    def __init__(self, folder: Path, identity: str):
        self.folder = folder / FOLDER
        self.folder.mkdir(parents=True, exist_ok=True)
        # The system lets go of the lock with the process, however that ends.
        self._lock = (self.folder / LOCK).open("w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._begin(folder, identity)
        except BlockingIOError:
            self.close()
            raise ValueError(f"{folder}: expected a folder that no other dive is being written into") from None
        except BaseException:
            self.close()
            raise

    def _begin(self, folder: Path, identity: str) -> None:
        marker = self.folder / IDENTITY
        if not marker.is_file():
            write_text(marker, identity)
        elif marker.read_text(encoding="utf-8") != identity:
            raise ValueError(f"{folder}: expected the same dive as before, to go on with it, or a new folder")
        self.finished = 0
        while self._snapshot_path(self.finished).is_file():
            self.finished += 1

    def close(self) -> None:
        """Let another process go on with it."""
        self._lock.close()

    @property
    def frames(self) -> int:
        """Images in finished segments, if the dive is long enough to fill them."""
        return self.finished * SEGMENT_FRAMES

    def ends_segment(self, frames: int) -> bool:
        """Whether a segment is full after a number of images."""
        return frames % SEGMENT_FRAMES == 0

    def snapshot(self) -> dict[str, Any] | None:
        """State behind the last finished segment; None before the first."""
        if not self.finished:
            return None
        state: dict[str, Any] = json.loads(self._snapshot_path(self.finished - 1).read_text(encoding="utf-8"))
        return state

    def path(self, segment: int, name: str) -> Path:
        """File of a segment."""
        return self.folder / f"{segment:06d}.{name}"

    def paths(self, name: str) -> list[Path]:
        """Files of all finished segments, those that were asked for."""
        return [path for path in (self.path(k, name) for k in range(self.finished)) if path.is_file()]

    def finish(self, segment: int, snapshot: str, names: list[str]) -> None:
        """Make a segment count: its files are on the disk, and its snapshot (JSON) is put beside them."""
        for name in names:
            sync(self.path(segment, name))
        write_text(self._snapshot_path(segment), snapshot)
        self.finished = segment + 1

    def remove(self) -> None:
        """Take the journal away, when its dive is finished."""
        shutil.rmtree(self.folder)

    def _snapshot_path(self, segment: int) -> Path:
        return self.path(segment, "snapshot.json")
