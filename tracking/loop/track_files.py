"""What a run of the loop leaves behind: its log and the video of what it saw and thought."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from rigs.atomic_files import PARTIAL, atomic_file, write_text
from tracking.log import COLUMNS, SCHEMA, loop_columns
from tracking.overlay import overlay
from tracking.protocols import CameraFrame
from tracking.records import Step
from tracking.video import ENCODERS

LOG, OVERLAY, SUMMARY = "log.parquet", "overlay.mp4", "track.json"

NEEDS_TRUTH = frozenset(
    {
        "exposure_s",
        "gain_db",
        "q1_true_deg",
        "q2_true_deg",
        "q1_first_row_deg",
        "q2_first_row_deg",
        "q1_last_row_deg",
        "q2_last_row_deg",
        "true_azimuth_deg",
        "true_elevation_deg",
        "target_distance_m",
        "gaze_azimuth_deg",
        "gaze_elevation_deg",
        "gaze_error_deg",
        "true_x_px",
        "true_y_px",
        "target_visible_px",
        "target_full_px",
        "detector_true_px",
        "detector_both_px",
        "detected_thing",
        "cause_of_loss",
    }
)
"""Columns of a dive's log that only a rendered dive can fill."""

TRACK_SCHEMA = pa.schema([SCHEMA.field(column.name) for column in COLUMNS if column.name not in NEEDS_TRUTH])

ROWS_PER_GROUP = 1024
"""Rows that wait in memory before they are written."""

TICKS_PER_S = 90_000
"""Of the overlay's time stamps: images of a camera do not come at an even rate."""

NOMINAL_RATE = 30
"""Frames per second that the encoder is told; it only steers its bit rate."""


class TrackFiles:
    """Log and overlay video, row by row and image by image; `finish` puts them in place.

    Parameters
    ----------
    folder : Path
        Made if it is missing.

    Raises
    ------
    FileExistsError
        When the folder holds something else than an earlier run.
    """

    def __init__(self, folder: Path):
        found = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
        others = {name for name in found - {LOG, OVERLAY, SUMMARY} if not PARTIAL.fullmatch(name)}
        if others:
            raise FileExistsError(f"{folder}: expected a new folder or that of an earlier run, found {min(others)}")
        folder.mkdir(parents=True, exist_ok=True)
        self._folder = folder
        self._rows: list[dict[str, Any]] = []
        self._count = 0
        self._log_file, self._video_file = atomic_file(folder / LOG), atomic_file(folder / OVERLAY)
        self._log = pq.ParquetWriter(self._log_file.__enter__(), TRACK_SCHEMA, compression="zstd")
        self._video = _TimedVideo(self._video_file.__enter__())

    def write(self, camera_frame: CameraFrame, step: Step) -> None:
        """Add one step of the loop."""
        row = loop_columns(step, np.full(2, np.nan)) | {
            "frame": self._count,
            "detector_found_px": int(np.count_nonzero(step.detection.mask)),
            "saturated_fraction": float((step.crop == 255).any(axis=-1).mean()),
        }
        self._rows.append({name: row[name] for name in TRACK_SCHEMA.names})
        self._count += 1
        self._video.write(overlay(camera_frame, step), camera_frame.time_s)
        if len(self._rows) == ROWS_PER_GROUP:
            self._write_rows()

    def finish(self, summary: dict[str, Any]) -> None:
        """Close the files and give them their names; a file that cannot be finished is removed."""
        with ExitStack() as stack:  # the one is closed even when the other cannot be
            stack.callback(_place, self._log_file, self._close_log)
            stack.callback(_place, self._video_file, self._video.close)
        if self._video.is_empty:
            (self._folder / OVERLAY).unlink()  # a video without an image is none
        write_text(self._folder / SUMMARY, json.dumps(summary, indent=2) + "\n")

    def _close_log(self) -> None:
        try:
            self._write_rows()
        finally:
            self._log.close()

    def _write_rows(self) -> None:
        self._log.write_table(pa.Table.from_pylist(self._rows, schema=TRACK_SCHEMA))
        self._rows = []


def _place(file: AbstractContextManager[Path], close: Callable[[], None]) -> None:
    """Close a file and give it its name; remove it when that fails."""
    with ExitStack() as stack:
        stack.push(file)
        close()


class _TimedVideo:
    """H.264 in MP4, each image with its own time stamp."""

    def __init__(self, path: Path):
        self._container = av.open(str(path), "w", format="mp4", options={"fflags": "+bitexact"})
        self._stream: Any = None
        self._first_s = 0.0

    @property
    def is_empty(self) -> bool:
        return self._stream is None

    def write(self, image: NDArray[np.uint8], time_s: float) -> None:
        name, pixel_format, options = ENCODERS["h264"]
        if self._stream is None:
            self._first_s = time_s
            self._stream = self._container.add_stream(name, rate=NOMINAL_RATE, options=options | {"flags": "+bitexact"})
            self._stream.height, self._stream.width = image.shape[:2]
            self._stream.pix_fmt = pixel_format
            self._stream.codec_context.time_base = Fraction(1, TICKS_PER_S)
        frame = av.VideoFrame.from_ndarray(image, format="rgb24")
        frame.pts = round((time_s - self._first_s) * TICKS_PER_S)
        frame.time_base = Fraction(1, TICKS_PER_S)
        self._container.mux(self._stream.encode(frame))

    def close(self) -> None:
        try:
            if self._stream is not None:
                self._container.mux(self._stream.encode(None))
        finally:
            self._container.close()
