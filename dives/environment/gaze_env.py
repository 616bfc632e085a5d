"""The task as environments of Gymnasium: one episode, or many whose frames are rendered together.

`docs/how-to/learn_to_look.md` says what actions, observations and rewards are.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from cad.assembly.meshes import rig_meshes
from dives.dive import Dive
from dives.environment.episode import Episode
from dives.environment.mirror_camera import MirrorCamera
from dives.environment.task import REWARD_UNIT_RAD, Action, GazeTask
from dives.ground_truth_columns import GroundTruthColumns
from optics.mesh import PartMesh
from rigs import Rig
from scenes.baking.light_quality import LightQuality

try:
    import gymnasium
    from gymnasium import spaces
    from gymnasium.utils.seeding import np_random
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        "the environment needs the package gymnasium, which is not installed: pip install 'mirrorgaze[env]'"
    ) from error

Observation = dict[str, NDArray[Any]]


class _Episodes:
    """Episodes side by side, and what is seen in them."""

    def __init__(self, task: GazeTask, parts: Sequence[PartMesh] | None, quality: LightQuality | None):
        self.task = task
        self._camera = MirrorCamera(task, rig_meshes(task.rig) if parts is None else parts, quality)
        target = task.dive.target.load_shape()
        self._truth = GroundTruthColumns(task.rig, target, task.dive.detector_settings())

    def begin(self, rng: np.random.Generator) -> Episode:
        return Episode(self.task, self._truth, rng)

    def observe(self, episodes: Sequence[Episode]) -> Observation:
        """Observations with a first axis of the episodes."""
        q = np.stack([episode.report.q for episode in episodes])
        return {
            "frame": self._camera.frames([episode.state for episode in episodes], q),
            "joints": q.astype(np.float32),
            "rates": np.stack([episode.rates for episode in episodes]).astype(np.float32),
        }


def observation_space(task: GazeTask) -> spaces.Dict:
    """Of one environment."""
    low, high, speed = (
        np.asarray(each, dtype=np.float32) for each in (task.gimbal.lowest, task.gimbal.highest, task.speed_limit)
    )
    return spaces.Dict(
        {
            "frame": spaces.Box(0, 255, (task.frame_px, task.frame_px, 3), np.uint8),
            "joints": spaces.Box(low, high, dtype=np.float32),
            "rates": spaces.Box(-speed, speed, dtype=np.float32),
        }
    )


def action_space(task: GazeTask) -> spaces.Space[Any]:
    """Of one environment."""
    low, high = (-task.speed_limit, task.speed_limit)
    if task.action == "angles":
        low, high = task.gimbal.lowest, task.gimbal.highest
    return spaces.Box(low.astype(np.float32), high.astype(np.float32), dtype=np.float32)


class GazeEnv(gymnasium.Env[Observation, NDArray[Any]]):
    """A robot that shall keep its gaze on a target, as an environment of Gymnasium.

    Parameters
    ----------
    dive : str, Path or Dive
        Preset, file or dive.
    rig : Rig, optional
        Instead of the dive's.
    action, frame_px, episode_s, start_error_deg
        As `GazeTask` has them.
    parts : sequence of PartMesh, optional
        Hull and mount; made from the rig unless given.
    quality : LightQuality, optional
        Of the light in the frames, full by default.
    render_mode : {"rgb_array"}, optional
        With it `render` returns the last frame.

    Raises
    ------
    DiveError, FileNotFoundError, ValueError
        As `GazeTask.of`.
    """

    metadata = {"render_modes": ["rgb_array"]}  # noqa: RUF012  (Gymnasium's own attribute)

    def __init__(
        self,
        dive: str | Path | Dive = "spiral",
        *,
        rig: Rig | None = None,
        action: Action = "speeds",
        frame_px: int = 64,
        episode_s: float = 10.0,
        start_error_deg: float = 8.0,
        parts: Sequence[PartMesh] | None = None,
        quality: LightQuality | None = None,
        render_mode: str | None = None,
    ):
        self.task = GazeTask.of(
            dive, rig, action=action, frame_px=frame_px, episode_s=episode_s, start_error_deg=start_error_deg
        )
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"expected render_mode None or 'rgb_array', got {render_mode!r}")
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": self.task.dive.frame_rate_hz}
        self.observation_space = cast("spaces.Space[Any]", observation_space(self.task))
        self.action_space = action_space(self.task)
        self._episodes = _Episodes(self.task, parts, quality)
        self._episode: Episode | None = None
        self._frame: NDArray[np.uint8] | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode; the same seed gives the same bytes."""
        super().reset(seed=seed, options=options)
        self._episode = self._episodes.begin(self.np_random)
        return self._observed(self._episode)

    def step(self, action: NDArray[Any]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Take an action; observation, reward, False (nothing ends an episode but its time), time is up, info."""
        if self._episode is None:
            raise RuntimeError("expected a reset before the first step")
        self._episode.act(np.asarray(action))
        observation, info = self._observed(self._episode)
        return observation, -info["gaze_error_rad"] / REWARD_UNIT_RAD, False, self._episode.over, info

    def render(self) -> NDArray[np.uint8] | None:
        """Last frame, where the render mode is "rgb_array"."""
        return self._frame if self.render_mode == "rgb_array" else None

    def _observed(self, episode: Episode) -> tuple[Observation, dict[str, Any]]:
        observation = {name: values[0] for name, values in self._episodes.observe([episode]).items()}
        self._frame = observation["frame"]
        return observation, {"gaze_error_rad": episode.gaze_error_rad, "q_true": episode.q_true}


class GazeVectorEnv(VectorEnv):
    """Environments side by side in one process, whose frames one kernel renders.

    Environment i with seed s is `GazeEnv` with seed s + i, to the byte. An episode that is over begins again at the
    next step, which takes no action and gives no reward (Gymnasium's `AutoresetMode.NEXT_STEP`).

    Parameters
    ----------
    num_envs : int
    dive, rig, action, frame_px, episode_s, start_error_deg, parts, quality
        As `GazeEnv` has them.
    """

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012  (Gymnasium's own attribute)

    def __init__(
        self,
        num_envs: int,
        dive: str | Path | Dive = "spiral",
        *,
        rig: Rig | None = None,
        action: Action = "speeds",
        frame_px: int = 64,
        episode_s: float = 10.0,
        start_error_deg: float = 8.0,
        parts: Sequence[PartMesh] | None = None,
        quality: LightQuality | None = None,
    ):
        if num_envs < 1:
            raise ValueError(f"expected one environment or more, got {num_envs}")
        self.task = GazeTask.of(
            dive, rig, action=action, frame_px=frame_px, episode_s=episode_s, start_error_deg=start_error_deg
        )
        self.num_envs = num_envs
        self.single_observation_space = observation_space(self.task)
        self.single_action_space = action_space(self.task)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._episodes = _Episodes(self.task, parts, quality)
        self._rngs = [np_random(None)[0] for _ in range(num_envs)]
        self._running: list[Episode] = []

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode in each; seeds from `seed` on, or one for each."""
        everywhere = range(self.num_envs)
        seeds = seed if isinstance(seed, Sequence) else [None if seed is None else seed + k for k in everywhere]
        if len(seeds) != self.num_envs:
            raise ValueError(f"expected {self.num_envs} seeds, got {len(seeds)}")
        for k, own in enumerate(seeds):
            if own is not None:
                self._rngs[k] = np_random(own)[0]
        self._running = [self._episodes.begin(rng) for rng in self._rngs]
        return self._episodes.observe(self._running), self._info()

    def step(
        self, actions: NDArray[Any]
    ) -> tuple[Observation, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Take an action in each, shape (num_envs, 2)."""
        if not self._running:
            raise RuntimeError("expected a reset before the first step")
        began = np.array([episode.over for episode in self._running])
        for k, episode in enumerate(self._running):
            if began[k]:
                self._running[k] = self._episodes.begin(self._rngs[k])
            else:
                episode.act(np.asarray(actions[k]))
        info = self._info()
        rewards = np.where(began, 0.0, -info["gaze_error_rad"] / REWARD_UNIT_RAD)
        over = np.array([episode.over for episode in self._running])
        return self._episodes.observe(self._running), rewards, np.zeros(self.num_envs, dtype=np.bool_), over, info

    def _info(self) -> dict[str, Any]:
        everywhere = np.ones(self.num_envs, dtype=np.bool_)
        return {
            "gaze_error_rad": np.array([episode.gaze_error_rad for episode in self._running]),
            "_gaze_error_rad": everywhere,
            "q_true": np.stack([episode.q_true for episode in self._running]),
            "_q_true": everywhere,
        }


gymnasium.register(
    id="MirrorGaze-v0",
    entry_point="dives.environment.gaze_env:GazeEnv",
    vector_entry_point="dives.environment.gaze_env:GazeVectorEnv",
)
