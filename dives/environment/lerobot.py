"""Episodes as a LeRobot data set, version 3.0: what an agent saw and did, for imitation and offline learning.

Many episodes share a Parquet and an MP4 file; `meta/episodes` says which rows and which seconds are an episode's. Row k
has the observation at image k, the action that was taken on it, and the reward that came of it.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from dives.environment.statistics import array_statistics, histogram, histogram_statistics
from dives.environment.task import GazeTask
from optics.kernels.arrays import FloatArray
from rigs.atomic_files import atomic_files
from tracking.video import VideoWriter, concatenate

CODEBASE_VERSION = "v3.0"
"""Of the format."""

CAMERA = "observation.images.mirror"
CHUNK = "chunk-{chunk_index:03d}/file-{file_index:03d}"
DATA, VIDEO = f"data/{CHUNK}.parquet", f"videos/{{video_key}}/{CHUNK}.mp4"
EPISODES, TASKS = "meta/episodes/chunk-000/file-000.parquet", "meta/tasks.parquet"

FILES_A_CHUNK = 1000
EPISODES_A_FILE = 100
"""Each file is written once: readers find episodes by `meta/episodes`, whatever the files' size."""

Observation = dict[str, NDArray[Any]]


@dataclass
class _Running:
    """An episode that is being recorded."""

    seed: int
    segment: Path
    video: VideoWriter
    colours: NDArray[np.int64] = field(default_factory=lambda: np.zeros((3, 256), dtype=np.int64))
    rows: dict[str, list[Any]] = field(default_factory=dict)

    def add(self, frame: NDArray[np.uint8], values: dict[str, Any]) -> None:
        self.video.write(frame)
        self.colours += histogram(frame)
        for name, value in values.items():
            self.rows.setdefault(name, []).append(value)


class EpisodeRecorder:
    """Writes episodes that run side by side; made by `record_episodes`.

    Parameters
    ----------
    folder : Path
        Empty.
    task : GazeTask
    policy : str
        Its name, for the card.
    """

    def __init__(self, folder: Path, task: GazeTask, policy: str):
        self._folder, self._task, self._policy = folder, task, policy
        self._fps = round(task.dive.frame_rate_hz)
        self._running: list[_Running] = []
        self._segments: list[Path] = []
        self._episodes: list[dict[str, Any]] = []
        self._colours: list[NDArray[np.int64]] = []
        self._arrays: list[dict[str, FloatArray]] = []
        self._data: pq.ParquetWriter | None = None
        self._frames = self._file_began = 0

    def begin(self, seeds: Sequence[int]) -> None:
        """Begin an episode for each seed."""
        place = self._folder / "segments"
        place.mkdir(exist_ok=True)
        self._running = []
        for seed in seeds:
            segment = place / f"{len(self._episodes) + len(self._running):06d}.mkv"
            self._running.append(_Running(seed, segment, VideoWriter(segment, "h264_short", self._fps)))

    def step(self, observation: Observation, actions: NDArray[Any], rewards: NDArray[Any]) -> None:
        """Take what each environment showed, the action on it, and the reward that followed."""
        for k, running in enumerate(self._running):
            state = np.concatenate([observation["joints"][k], observation["rates"][k]]).astype(np.float32)
            values = {"observation.state": state, "action": np.asarray(actions[k], dtype=np.float32)}
            running.add(observation["frame"][k], values | {"next.reward": np.float32(rewards[k])})

    def end(self) -> None:
        """Write the episodes that ran: their time is up."""
        for running in self._running:
            running.video.close()
            self._add(running)
        self._running = []

    def finish(self) -> None:
        """Write what is told of all."""
        self._close_files()
        shutil.rmtree(self._folder / "segments", ignore_errors=True)
        write_rows(self._folder / EPISODES, self._episodes)
        write_tasks(self._folder / TASKS, [task_text(self._task)])
        _write_json(self._folder / "meta/info.json", self._info())
        arrays = {name: np.concatenate([each[name] for each in self._arrays]) for name in self._arrays[0]}
        _write_json(self._folder / "meta/stats.json", _statistics(arrays, sum(self._colours[1:], self._colours[0])))
        (self._folder / "README.md").write_text(self._card(), encoding="utf-8")

    def _add(self, running: _Running) -> None:
        columns = _columns(running, len(self._episodes), self._frames, self._fps)
        self._write_data(columns)
        self._segments.append(running.segment)
        self._arrays.append({name: _as_floats(values) for name, values in columns.items()})
        self._colours.append(running.colours)
        self._episodes.append(self._row(running))
        self._frames += self._episodes[-1]["length"]
        if len(self._segments) == EPISODES_A_FILE:
            self._close_files()

    def _row(self, running: _Running) -> dict[str, Any]:
        """Row of `meta/episodes`: which rows and which seconds of which files are the episode's."""
        number, length = len(self._episodes), len(running.rows["action"])
        first, place = self._frames - self._file_began, _place(number)
        told = _statistics(self._arrays[-1], running.colours)
        return {
            "episode_index": number,
            "tasks": [task_text(self._task)],
            "length": length,
            "seed": running.seed,
            "dataset_from_index": self._frames,
            "dataset_to_index": self._frames + length,
            **{f"data/{name}": value for name, value in place.items()},
            **{f"videos/{CAMERA}/{name}": value for name, value in place.items()},
            f"videos/{CAMERA}/from_timestamp": first / self._fps,
            f"videos/{CAMERA}/to_timestamp": (first + length) / self._fps,
            **{f"stats/{name}/{key}": value for name, each in told.items() for key, value in each.items()},
            "meta/episodes/chunk_index": 0,
            "meta/episodes/file_index": 0,
        }

    def _write_data(self, columns: dict[str, NDArray[Any]]) -> None:
        """One row group an episode, so that one can be read by itself."""
        table = pa.table({key: _arrow(values) for key, values in columns.items()})
        if self._data is None:
            path = self._folder / DATA.format(**_place(len(self._episodes)))
            path.parent.mkdir(parents=True, exist_ok=True)
            self._data, self._file_began = pq.ParquetWriter(path, table.schema), self._frames
        self._data.write_table(table)

    def _close_files(self) -> None:
        """Put the segments of the file at hand together."""
        if self._data is None:
            return
        self._data.close()
        path = self._folder / VIDEO.format(video_key=CAMERA, **_place(len(self._episodes) - 1))
        path.parent.mkdir(parents=True, exist_ok=True)
        concatenate(self._segments, path, container="mp4", frame_rate_hz=self._fps)
        self._data, self._segments = None, []

    def _info(self) -> dict[str, Any]:
        return {
            "codebase_version": CODEBASE_VERSION,
            "robot_type": self._task.rig.name,
            "total_episodes": len(self._episodes),
            "total_frames": self._frames,
            "total_tasks": 1,
            "chunks_size": FILES_A_CHUNK,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 200,
            "fps": self._fps,
            "splits": {"train": f"0:{len(self._episodes)}"},
            "data_path": DATA,
            "video_path": VIDEO,
            "features": features(self._task),
        }

    def _card(self) -> str:
        task, seeds = self._task, [each["seed"] for each in self._episodes]
        return (
            "---\ntask_categories:\n- robotics\ntags:\n- LeRobot\nconfigs:\n- config_name: default\n"
            "  data_files: data/*/*.parquet\n---\n\n"
            f"# {task.dive.name}\n\n{len(seeds)} episodes of {task.episode_s:g} s of the dive {task.dive.name}, "
            f"rig {task.rig.name}, policy {self._policy}, seeds {seeds[0]} to {seeds[-1]}; actions are joint "
            f"{task.action}. "
            f"Made by mirrorgaze {version('mirrorgaze')} in the format LeRobotDataset {CODEBASE_VERSION}.\n"
        )


@contextmanager
def record_episodes(folder: Path, task: GazeTask, *, policy: str) -> Iterator[EpisodeRecorder]:
    """Give a recorder whose data set appears in a folder at the end, whole or not at all.

    Raises
    ------
    ValueError
        When there is something in the folder, or for a frame rate or size that the format does not know.
    """
    check_recordable(folder, task)
    with atomic_files(folder) as scratch:
        recorder = EpisodeRecorder(scratch, task, policy)
        yield recorder
        recorder.finish()


def check_recordable(folder: Path, task: GazeTask) -> None:
    """What `record_episodes` refuses, before anything takes time."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ValueError(f"{folder}: expected a new folder; there is something in it: take another one")
    if not float(task.dive.frame_rate_hz).is_integer():
        rate = f"{task.dive.frame_rate_hz:g}"
        raise ValueError(f"frame_rate_hz: expected a whole number, which LeRobot's format has, got {rate} in the dive")
    if task.frame_px % 2:
        raise ValueError(f"frame_px: expected an even number, which videos have, got {task.frame_px}")


def task_text(task: GazeTask) -> str:
    """What is to be done, in words, as policies that read language take it."""
    return f"keep the gaze on the {task.dive.target.name}"


def features(task: GazeTask) -> dict[str, Any]:
    """Columns with types, shapes and names of axes, as `meta/info.json` has them."""
    size, unit = task.frame_px, "rad_per_s" if task.action == "speeds" else "rad"
    video = {"height": size, "width": size, "codec": "h264", "pix_fmt": "yuv420p", "is_depth_map": False}
    video |= {"fps": round(task.dive.frame_rate_hz), "channels": 3}
    state = ["pan_rad", "tilt_rad", "pan_rad_per_s", "tilt_rad_per_s"]
    return {
        CAMERA: {
            "dtype": "video",
            "shape": [size, size, 3],
            "names": ["height", "width", "channels"],
            "info": {f"video.{name}": value for name, value in video.items()} | {"has_audio": False},
        },
        "observation.state": {"dtype": "float32", "shape": [4], "names": state},
        "action": {"dtype": "float32", "shape": [2], "names": [f"pan_{unit}", f"tilt_{unit}"]},
        "next.reward": {"dtype": "float32", "shape": [1], "names": None},
        "next.done": {"dtype": "bool", "shape": [1], "names": None},
        "timestamp": {"dtype": "float32", "shape": [1], "names": None},
        **{
            name: {"dtype": "int64", "shape": [1], "names": None}
            for name in ("frame_index", "episode_index", "index", "task_index")
        },
    }


def write_rows(path: Path, rows: list[dict[str, Any]]) -> None:
    """Write rows as Parquet."""
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(pa.Table.from_pylist(rows), path)


def write_tasks(path: Path, tasks: Sequence[str]) -> None:
    """Write tasks as pandas does with their texts as the index, which is how LeRobot finds them."""
    index = {"name": "task", "field_name": "task", "pandas_type": "unicode", "numpy_type": "object", "metadata": None}
    column = {"name": "task_index", "field_name": "task_index", "pandas_type": "int64", "numpy_type": "int64"}
    told = {"index_columns": ["task"], "column_indexes": [], "columns": [column | {"metadata": None}, index]}
    path.parent.mkdir(parents=True, exist_ok=True)
    table = pa.table({"task_index": pa.array(range(len(tasks)), pa.int64()), "task": list(tasks)})
    pq.write_table(table.replace_schema_metadata({"pandas": json.dumps(told)}), path)


def _place(episode: int) -> dict[str, int]:
    """Numbers of chunk and file of an episode."""
    chunk, file = divmod(episode // EPISODES_A_FILE, FILES_A_CHUNK)
    return {"chunk_index": chunk, "file_index": file}


def _columns(running: _Running, number: int, first: int, fps: int) -> dict[str, NDArray[Any]]:
    count = len(running.rows["action"])
    frames = np.arange(count)
    return {
        **{name: np.stack(values) for name, values in running.rows.items()},
        "next.done": frames == count - 1,
        "timestamp": (frames / fps).astype(np.float32),
        "frame_index": frames,
        "episode_index": np.full(count, number),
        "index": first + frames,
        "task_index": np.zeros(count, dtype=np.int64),
    }


def _arrow(values: NDArray[Any]) -> pa.Array:
    flat = pa.array(values.ravel())
    return flat if values.ndim == 1 else pa.FixedSizeListArray.from_arrays(flat, values.shape[1])


def _as_floats(values: NDArray[Any]) -> FloatArray:
    return values.reshape(len(values), -1).astype(np.float64)


def _statistics(arrays: dict[str, FloatArray], colours: NDArray[np.int64]) -> dict[str, dict[str, Any]]:
    frames = len(arrays["action"])
    return {CAMERA: histogram_statistics(colours, frames)} | {
        name: array_statistics(values) for name, values in arrays.items()
    }


def _write_json(path: Path, contents: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(contents, indent=4) + "\n", encoding="utf-8")
