"""A recorded LeRobot data set, read as LeRobot's own reader (v3.0) does: pandas, datasets and PyAV.

Reader's steps: `meta/tasks.parquet` by pandas with the texts as index; `meta/episodes` by datasets; rows by datasets
with the types of `meta/info.json`; a frame of an episode at `from_timestamp` + `frame_index` / fps of its file, within
1e-4 s.
"""

import json
import shutil

import av
import numpy as np
import pyarrow.parquet as pq
import pytest

from dives.environment import lerobot
from dives.environment.evaluation import policy_named, run_policy
from dives.environment.gaze_env import GazeVectorEnv
from dives.environment.lerobot import CAMERA, check_recordable, record_episodes, task_text
from dives.environment.recording_check import check_recording, is_recording
from dives.environment.statistics import array_statistics, histogram, histogram_statistics
from scenes.baking.light_quality import LightQuality

EPISODES, EPISODE_S, FRAME_PX = 3, 0.2, 32
STEPS = 6
TIME_TOLERANCE_S = 1e-4
"""LeRobot's own."""

LOSSY_LEVELS = 4.0
"""Mean difference of a frame that was encoded with half its colour's resolution; frames are painted farther apart."""


@pytest.fixture(scope="module")
def envs(small_dive):
    quality = LightQuality.coarse()
    return GazeVectorEnv(2, small_dive, parts=(), frame_px=FRAME_PX, episode_s=EPISODE_S, quality=quality)


class Kept:
    """Passes everything on, and keeps it; each frame gets a grey of its own, so that it is known again."""

    def __init__(self, recorder):
        self.recorder, self.frames, self.rows = recorder, [], []

    def begin(self, seeds):
        self.recorder.begin(seeds)
        self.count, self.steps = len(seeds), []

    def step(self, observation, actions, rewards):
        painted = observation["frame"] // 2
        for k, frame in enumerate(painted):
            frame[: FRAME_PX // 2] = 12 * (len(self.steps) + k * STEPS) + len(self.frames) // 2
        self.recorder.step({**observation, "frame": painted}, actions, rewards)
        self.steps.append(({**observation, "frame": painted}, actions, rewards))

    def end(self):
        self.recorder.end()
        for k in range(self.count):
            for observation, actions, rewards in self.steps:
                self.frames.append(observation["frame"][k])
                state = [*observation["joints"][k], *observation["rates"][k]]
                self.rows.append({"observation.state": state, "action": actions[k], "next.reward": rewards[k]})


@pytest.fixture(scope="module")
def recorded(envs, tmp_path_factory):
    """Folder of three episodes, two in a file, and what the recorder was shown."""
    folder = tmp_path_factory.mktemp("lerobot") / "set"
    with pytest.MonkeyPatch.context() as patch, record_episodes(folder, envs.task, policy="random") as recorder:
        patch.setattr(lerobot, "EPISODES_A_FILE", 2)
        kept = Kept(recorder)
        run_policy(envs, lambda: policy_named("random", envs.task, []), episodes=EPISODES, seed=5, recorder=kept)
    return folder, kept


@pytest.fixture(scope="module")
def info(recorded):
    return json.loads((recorded[0] / "meta/info.json").read_text())


def rows_of(folder, place, features, cache):
    datasets = pytest.importorskip("datasets")
    paths = sorted(str(path) for path in (folder / place).glob("*/*.parquet"))
    return datasets.Dataset.from_parquet(paths, features=features, cache_dir=str(cache))


def hf_features(info):
    """Types of the columns, as LeRobot makes them of `meta/info.json`."""
    datasets = pytest.importorskip("datasets")
    found = {}
    for name, each in info["features"].items():
        if each["dtype"] != "video":
            value = datasets.Value(dtype=each["dtype"])
            (length,) = each["shape"]
            found[name] = value if length == 1 else datasets.Sequence(length=length, feature=value)
    return datasets.Features(found)


@pytest.mark.filterwarnings("ignore")  # what libraries warn about themselves is not ours
def test_rows_and_frames_are_those_that_the_policy_saw(recorded, info, tmp_path, monkeypatch):
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    folder, kept = recorded
    rows = rows_of(folder, "data", hf_features(info), tmp_path)
    episodes = rows_of(folder, "meta/episodes", None, tmp_path).to_list()
    assert (info["codebase_version"], info["fps"], info["total_frames"]) == ("v3.0", 30, EPISODES * STEPS)
    assert len(rows) == len(kept.rows) == EPISODES * STEPS
    assert [each["seed"] for each in episodes] == [5, 6, 7]
    for index, (row, own) in enumerate(zip(rows, kept.rows, strict=True)):
        assert row["index"] == index
        for name, values in own.items():
            np.testing.assert_array_equal(np.float32(row[name]), np.float32(values))
        episode = episodes[row["episode_index"]]
        assert episode["dataset_from_index"] <= index < episode["dataset_to_index"]
        assert row["frame_index"] == index - episode["dataset_from_index"]
        assert row["timestamp"] == pytest.approx(row["frame_index"] / info["fps"])
        assert row["next.done"] == (row["frame_index"] == episode["length"] - 1)
        shown = frame_at(folder, info, episode, row["frame_index"])
        differences = [np.abs(shown.astype(float) - each).mean() for each in kept.frames]
        assert np.argmin(differences) == index
        assert differences[index] < LOSSY_LEVELS
    files = {(each["data/file_index"], each[f"videos/{CAMERA}/file_index"]) for each in episodes}
    assert files == {(0, 0), (1, 1)}


def frame_at(folder, info, episode, frame_index):
    """Frame of an episode, found by its time in the file."""
    place = {key: episode[f"videos/{CAMERA}/{key}"] for key in ("chunk_index", "file_index")}
    asked = episode[f"videos/{CAMERA}/from_timestamp"] + frame_index / info["fps"]
    with av.open(folder / info["video_path"].format(video_key=CAMERA, **place)) as container:
        frames = {frame.time: frame for frame in container.decode(video=0)}
    nearest = min(frames, key=lambda time: abs(time - asked))
    assert abs(nearest - asked) < TIME_TOLERANCE_S
    return frames[nearest].to_ndarray(format="rgb24")


def test_a_task_is_found_by_its_text(recorded, envs):
    pandas = pytest.importorskip("pandas")
    tasks = pandas.read_parquet(recorded[0] / "meta/tasks.parquet")
    assert tasks.index.name == "task"
    assert int(tasks.loc[task_text(envs.task)].task_index) == 0
    assert task_text(envs.task) == "keep the gaze on the red ball"


def test_statistics_are_those_of_all_rows(recorded, info):
    folder, kept = recorded
    told = json.loads((folder / "meta/stats.json").read_text())
    assert told.keys() == info["features"].keys()
    actions = np.array([row["action"] for row in kept.rows])
    np.testing.assert_allclose(told["action"]["mean"], actions.mean(axis=0), rtol=1e-5)
    frames = np.array(kept.frames) / 255
    np.testing.assert_allclose(np.array(told[CAMERA]["mean"])[:, 0, 0], frames.mean(axis=(0, 1, 2)))
    np.testing.assert_allclose(np.array(told[CAMERA]["std"])[:, 0, 0], frames.std(axis=(0, 1, 2)))
    assert told[CAMERA]["count"] == told["action"]["count"] == [EPISODES * STEPS]


def test_a_histogram_says_what_all_its_pixels_say():
    image = np.random.default_rng(1).integers(20, 200, (30, 40, 3)).astype(np.uint8)
    told = histogram_statistics(histogram(image), 1)
    expected = array_statistics(image.reshape(-1, 3) / 255)
    for name in ("min", "max", "mean", "std"):
        np.testing.assert_allclose(np.ravel(told[name]), expected[name], rtol=1e-12)
    for name in ("q01", "q10", "q50", "q90", "q99"):
        # A level is met as a whole; between two of them NumPy interpolates.
        np.testing.assert_allclose(np.ravel(told[name]), expected[name], atol=1 / 255)


def test_what_the_format_does_not_know_is_refused_at_once(envs, tmp_path):
    (tmp_path / "something").write_text("keep me")
    with pytest.raises(ValueError, match="expected a new folder"):
        check_recordable(tmp_path, envs.task)
    from dataclasses import replace

    with pytest.raises(ValueError, match="expected an even number"):
        check_recordable(tmp_path / "new", replace(envs.task, frame_px=33))
    slow = envs.task.dive.model_copy(update={"frame_rate_hz": 12.5})
    with pytest.raises(ValueError, match=r"expected a whole number.* got 12\.5"):
        check_recordable(tmp_path / "new", replace(envs.task, dive=slow))


def test_what_is_broken_off_leaves_nothing(envs, tmp_path):
    def broken_off():
        with record_episodes(tmp_path / "set", envs.task, policy="random") as recorder:
            recorder.begin([1])
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        broken_off()
    assert list(tmp_path.iterdir()) == []


def test_a_recording_in_order_has_no_problems(recorded):
    found = check_recording(recorded[0])
    assert (found.samples, found.files, found.problems) == (EPISODES * STEPS, 5, ())
    assert is_recording(recorded[0]) and not is_recording(recorded[0] / "meta")


def cut_video(folder):
    """The second file's frames in place of the first's."""
    first, second = sorted(folder.glob("videos/*/*/*.mp4"))
    shutil.copy(second, first)


def swap_rows(folder):
    file = min(folder.glob("data/*/*.parquet"))
    table = pq.read_table(file)
    pq.write_table(table.take([1, 0, *range(2, len(table))]), file)


def forget_an_episode(folder):
    (file,) = folder.glob("meta/episodes/*/*.parquet")
    pq.write_table(pq.read_table(file).slice(0, EPISODES - 1), file)


@pytest.mark.parametrize(
    ("damage", "sentence"),
    [
        (cut_video, f"expected {2 * STEPS} frames at the times of their episodes, got {STEPS}"),
        (swap_rows, f"expected {STEPS} steps of episode 0, in their order"),
        (forget_an_episode, f"expected {EPISODES} episodes with {EPISODES * STEPS} steps, got 2 with {2 * STEPS}"),
        (lambda folder: min(folder.glob("data/*/*.parquet")).unlink(), "that can be read"),
        (lambda folder: min(folder.glob("videos/*/*/*.mp4")).write_bytes(b"?"), "that can be read"),
        (lambda folder: (folder / "meta/info.json").write_text("{}"), "that can be read"),
    ],
)
def test_damage_to_a_recording_is_named(recorded, tmp_path, damage, sentence):
    copied = shutil.copytree(recorded[0], tmp_path / "set")
    damage(copied)
    (problem,) = check_recording(copied).problems
    assert sentence in problem
