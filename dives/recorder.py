"""Writes what a dive yields while its next image is being rendered: rows, video, overlay, segment by segment."""

from __future__ import annotations

import queue
import threading
from dataclasses import dataclass
from pathlib import Path

import cv2

from dives.dive import Dive
from dives.journal import Journal
from rigs.atomic_files import write_bytes
from tracking.log import Row, table_of, write_table
from tracking.overlay import overlay
from tracking.protocols import CameraFrame
from tracking.records import Step
from tracking.video import Image, VideoWriter

ROWS, VIDEO, OVERLAY = "parquet", "video.mkv", "overlay.mkv"
"""Files of a segment."""

FRAMES = "frames"
"""Folder of single images."""

MOST_WAITING = 8
"""Images between the loop and its record: memory stays flat when the disk is slow."""


@dataclass(frozen=True)
class _Entry:
    camera_frame: CameraFrame
    step: Step
    row: Row


@dataclass(frozen=True)
class _End:
    snapshot: str


class Recorder:
    """Records in a thread of its own; what goes wrong there is raised by the next call.

    Parameters
    ----------
    dive : Dive
    folder : Path
    journal : Journal
    """

    def __init__(self, dive: Dive, folder: Path, journal: Journal):
        self._dive, self._journal = dive, journal
        self._frames: Path | None = folder / FRAMES if dive.video == "frames" else None
        if self._frames is not None:
            self._frames.mkdir(parents=True, exist_ok=True)
        self._segment = journal.finished
        self._rows: list[Row] = []
        self._images: list[Path] = []
        self._writers: dict[str, VideoWriter] = {}
        self._error: Exception | None = None
        self._waiting: queue.Queue[_Entry | _End | None] = queue.Queue(MOST_WAITING)
        self._thread = threading.Thread(target=self._work, name="recorder", daemon=True)
        self._thread.start()

    def add(self, camera_frame: CameraFrame, step: Step, row: Row) -> None:
        """Record one image; it may wait for those before it."""
        self._put(_Entry(camera_frame, step, row))

    def finish_segment(self, snapshot: str) -> None:
        """End the segment: what was added since the last one counts when all of it is on the disk."""
        self._put(_End(snapshot))

    def close(self) -> None:
        """Wait until all is written."""
        self._waiting.put(None)
        self._thread.join()
        if self._error is not None:
            raise self._error

    def abandon(self) -> None:
        """Stop without a word: what waits is recorded still, and only the segment that has no end is lost."""
        self._waiting.put(None)
        self._thread.join()

    def _put(self, item: _Entry | _End) -> None:
        if self._error is not None:
            raise self._error
        self._waiting.put(item)

    def _work(self) -> None:
        while (item := self._waiting.get()) is not None:
            if self._error is not None:
                continue  # taken out, so that nobody waits for room
            try:
                if isinstance(item, _End):
                    self._finish(item.snapshot)
                else:
                    self._record(item)
            except Exception as error:  # raised again where somebody listens
                self._error = error
        self._close_writers(quietly=True)

    def _record(self, entry: _Entry) -> None:
        video = self._dive.video
        if self._frames is not None:
            image = self._frames / f"{entry.row['frame']:06d}.png"
            write_bytes(image, png(entry.camera_frame.image))
            self._images.append(image)
        elif video in ("ffv1", "h264"):
            self._writer(VIDEO, "ffv1" if video == "ffv1" else "h264").write(entry.camera_frame.image)
        if self._dive.overlay:
            self._writer(OVERLAY, "h264").write(overlay(entry.camera_frame, entry.step))
        self._rows.append(entry.row)

    def _writer(self, name: str, codec: str) -> VideoWriter:
        if name not in self._writers:
            path = self._journal.path(self._segment, name)
            self._writers[name] = VideoWriter(path, "ffv1" if codec == "ffv1" else "h264", self._dive.frame_rate_hz)
        return self._writers[name]

    def _finish(self, snapshot: str) -> None:
        files = [self._journal.path(self._segment, name) for name in (ROWS, *self._writers)]
        self._close_writers()
        write_table(table_of(self._rows), files[0])
        self._journal.finish(self._segment, snapshot, [*files, *self._images])
        self._rows, self._images = [], []
        self._segment += 1

    def _close_writers(self, *, quietly: bool = False) -> None:
        writers, self._writers = self._writers, {}
        for writer in writers.values():
            try:
                writer.close()
            except Exception:
                if not quietly:
                    raise


def png(image: Image) -> bytes:
    """Image (uint8 sRGB) as PNG."""
    written, content = cv2.imencode(".png", cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    if not written:
        raise OSError("an image could not be written as PNG")
    return content.tobytes()
