"""The journal of a dive that is being made: what is finished so far, and where everything stood when it was.

A segment is finished when its snapshot is there, which is written last and holds the digests of itself and of the
segment's files. A dive that was stopped anywhere goes on behind the last of its finished segments before the first that
is missing or damaged, and all behind that is made again.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import re
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rigs.atomic_files import as_digests_say, digest_of, sync, write_text

SEGMENT_FRAMES = 60
"""Fixed: the files must not depend on where a dive was stopped."""

FOLDER = "journal"
IDENTITY, LOCK = "identity", "lock"
DIGEST = re.compile(rb"[0-9a-f]{64}")


class Journal:
    """Journal in a dive's folder; until it is closed it is this process's alone.

    Parameters
    ----------
    folder : Path
        Of the dive.
    identity : str
        Digest of what the dive is made from: a journal of another dive is not gone on with.

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
        found = marker.read_bytes() if marker.is_file() else b""
        if not DIGEST.fullmatch(found):
            # Damaged: nobody knows which dive the segments are of.
            for path in self.folder.glob("[0-9]*"):
                path.unlink()
            write_text(marker, identity)
        elif found != identity.encode():
            raise ValueError(f"{folder}: expected the same dive as before, to go on with it, or a new folder")
        self.finished = 0
        self._state: dict[str, Any] | None = None
        while (state := self._state_of(self.finished)) is not None:
            self._state = state
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
        """State behind the last segment that was finished when the journal was opened; None before the first."""
        return self._state

    def path(self, segment: int, name: str) -> Path:
        """File of a segment."""
        return self.folder / f"{segment:06d}.{name}"

    def paths(self, name: str) -> list[Path]:
        """Files of all finished segments, those that were asked for."""
        return [path for path in (self.path(k, name) for k in range(self.finished)) if path.is_file()]

    def finish(self, segment: int, snapshot: str, files: Sequence[Path]) -> None:
        """Make a segment count: its files are on the disk, and its snapshot is put beside them.

        Parameters
        ----------
        segment : int
        snapshot : str
            State behind the segment, JSON.
        files : sequence of Path
            All that was written of it, in the dive's folder or below.
        """
        for file in files:
            sync(file)
        digests = {str(file.relative_to(self.folder.parent)): digest_of(file) for file in files}
        content = {"state": snapshot, "digests": digests}
        write_text(self._snapshot_path(segment), json.dumps(content | {"digest": _digest(content)}))
        self.finished = segment + 1

    def remove(self) -> None:
        """Take the journal away, when its dive is finished."""
        shutil.rmtree(self.folder)

    def _state_of(self, segment: int) -> dict[str, Any] | None:
        """State behind a segment; None where it is not finished, or not all of it is as it was then."""
        try:
            content = json.loads(self._snapshot_path(segment).read_text(encoding="utf-8"))
            if content.pop("digest") != _digest(content) or not as_digests_say(self.folder.parent, content["digests"]):
                return None
            state: dict[str, Any] = json.loads(content["state"])
        except (FileNotFoundError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
            return None
        return state

    def _snapshot_path(self, segment: int) -> Path:
        return self.path(segment, "snapshot.json")


def _digest(content: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()
