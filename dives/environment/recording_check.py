"""Whether recorded episodes are what their metadata says: rows, times and frames, as LeRobot's reader finds them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import Any

import av
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from dives.datasets.check import CheckResult
from dives.environment.lerobot import CAMERA

INFO = "meta/info.json"

TIME_TOLERANCE_S = 1e-4
"""LeRobot's own."""

Rows = list[dict[str, Any]]


def is_recording(folder: Path) -> bool:
    """Whether a folder holds a LeRobot data set."""
    return (folder / INFO).is_file()


def check_recording(folder: Path) -> CheckResult:
    """Read all rows and frames of a recorded data set, and compare them with its metadata; samples are its steps."""
    problems, steps, files = [], 0, 1
    try:
        info = json.loads((folder / INFO).read_text(encoding="utf-8"))
        parts = [pq.read_table(file).to_pylist() for file in sorted((folder / "meta/episodes").glob("*/*.parquet"))]
        episodes = [row for part in parts for row in part]
        steps = sum(each["length"] for each in episodes)
        if (len(episodes), steps) != (info["total_episodes"], info["total_frames"]):
            expected = f"{info['total_episodes']} episodes with {info['total_frames']} steps"
            problems.append(f"{folder / INFO}: expected {expected}, got {len(episodes)} with {steps}")
        for what, read in (("data", _data), (f"videos/{CAMERA}", _video)):
            for place, found in _files(episodes, what):
                problems += list(read(folder, info, place, found))
                files += 1
    except (OSError, ValueError, KeyError, TypeError, pa.ArrowException) as error:
        problems.append(f"{folder}: expected a recorded data set that can be read, got {error}; record it again")
    return CheckResult(samples=steps, files=files, problems=tuple(problems))


def _files(episodes: Rows, what: str) -> Iterator[tuple[tuple[int, int], Rows]]:
    """Chunk and number of each file, and the episodes in it."""
    for place, found in groupby(episodes, key=lambda each: (each[f"{what}/chunk_index"], each[f"{what}/file_index"])):
        yield place, list(found)


def _data(folder: Path, info: dict[str, Any], place: tuple[int, int], episodes: Rows) -> Iterator[str]:
    """Problems of a file of rows."""
    path = folder / info["data_path"].format(chunk_index=place[0], file_index=place[1])
    table = pq.read_table(path)
    if set(table.column_names) | {CAMERA} != set(info["features"]):
        yield f"{path}: expected the columns of {INFO}"
        return
    numbers = {
        name: table[name].to_numpy() for name in ("episode_index", "index", "frame_index", "timestamp", "next.done")
    }
    for each in episodes:
        own = numbers["episode_index"] == each["episode_index"]
        count = np.arange(each["length"])
        if not (
            np.array_equal(numbers["index"][own], each["dataset_from_index"] + count)
            and np.array_equal(numbers["frame_index"][own], count)
            and np.allclose(numbers["timestamp"][own], count / info["fps"], rtol=0, atol=TIME_TOLERANCE_S)
            and np.array_equal(numbers["next.done"][own], count == each["length"] - 1)
        ):
            yield f"{path}: expected {each['length']} steps of episode {each['episode_index']}, in their order"


def _video(folder: Path, info: dict[str, Any], place: tuple[int, int], episodes: Rows) -> Iterator[str]:
    """Problems of a file of frames."""
    path = folder / info["video_path"].format(video_key=CAMERA, chunk_index=place[0], file_index=place[1])
    began = [each[f"videos/{CAMERA}/from_timestamp"] + np.arange(each["length"]) / info["fps"] for each in episodes]
    expected, times = np.concatenate(began), []
    with av.open(path) as container:
        for frame in container.decode(video=0):
            times.append(frame.time)
            if [frame.height, frame.width, 3] != info["features"][CAMERA]["shape"]:
                yield f"{path}: expected frames of the size in {INFO}"
                return
    if len(times) != len(expected) or not np.allclose(times, expected, rtol=0, atol=TIME_TOLERANCE_S):
        yield f"{path}: expected {len(expected)} frames at the times of their episodes, got {len(times)}"
