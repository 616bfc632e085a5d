"""How well a policy does: episodes with seeds of their own, the same for every policy, and what they came to."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Protocol

import numpy as np
from gymnasium.utils.env_checker import check_env
from numpy.typing import NDArray

from dives.environment.gaze_env import GazeEnv, GazeVectorEnv
from dives.environment.policies import LoopPolicy, Policy, RandomPolicy
from dives.environment.task import GazeTask
from dives.metrics.intervals import Interval, difference_interval, mean_interval
from optics.kernels.arrays import FloatArray
from optics.mesh import PartMesh
from tracking.loop.variants import VARIANTS

Observation = dict[str, NDArray[Any]]


class Recorder(Protocol):
    """Is shown episodes that run side by side."""

    def begin(self, seeds: Sequence[int]) -> None:
        """An episode of each seed begins."""

    def step(self, observation: Observation, actions: NDArray[Any], rewards: NDArray[Any]) -> None:
        """What each environment showed, what was done, and the reward; there may be more than seeds."""

    def end(self) -> None:
        """Their time is up."""


RANDOM = "random"
POLICIES = (*VARIANTS, RANDOM)
"""Names of policies that are known."""


@dataclass(frozen=True, kw_only=True)
class PolicyResult:
    """What episodes came to.

    Attributes
    ----------
    returns : tuple of float
        Of each episode: sum of its rewards.
    gaze_error_rms_deg : tuple of float
        Likewise, over the images after the first.
    """

    returns: tuple[float, ...]
    gaze_error_rms_deg: tuple[float, ...]

    @property
    def mean_return(self) -> Interval:
        """Mean of the returns with its interval of 95 %."""
        return mean_interval(self.returns)

    @property
    def mean_gaze_error_deg(self) -> Interval:
        """Likewise of the RMS gaze error."""
        return mean_interval(self.gaze_error_rms_deg)

    def return_above(self, other: PolicyResult) -> Interval:
        """Mean by which the return is above another policy's, episode by episode."""
        return difference_interval(other.returns, self.returns)

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        means = {"mean_return": self.mean_return, "mean_gaze_error_rms_deg": self.mean_gaze_error_deg}
        return asdict(self) | {name: asdict(interval) for name, interval in means.items()}


def policy_table(results: Mapping[str, PolicyResult]) -> list[tuple[str, ...]]:
    """Return and gaze error of each policy, and how far its return is above the first one's; the head first."""
    first, *others = results
    rows = [(f"  {name}", str(result.mean_return), str(result.mean_gaze_error_deg)) for name, result in results.items()]
    above = ["-", *(str(results[name].return_above(results[first])) for name in others)]
    head = ("policy", "return", "gaze error RMS, deg", f"return above {first}")
    return [head, *((*row, more) for row, more in zip(rows, above, strict=True))]


def check_environment(env: GazeEnv) -> None:
    """Let Gymnasium check an environment (`gymnasium.utils.env_checker.check_env`); raises what it finds."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Actions are rad/s or radians on purpose; `gymnasium.wrappers.RescaleAction` makes -1 to 1 of them.
        warnings.filterwarnings("ignore", message=".*we recommend using a symmetric and normalized space")
        check_env(env, skip_render_check=True)


def steps_per_s(env: GazeEnv | GazeVectorEnv, *, steps: int = 30) -> float:
    """Steps a second of random actions, those of all environments side by side counted."""
    env.reset(seed=0)
    env.step(env.action_space.sample())  # compiles what is not compiled yet
    started = time.perf_counter()
    for _ in range(steps):
        env.step(env.action_space.sample())
    return steps * getattr(env, "num_envs", 1) / (time.perf_counter() - started)


def policy_named(name: str, task: GazeTask, parts: Sequence[PartMesh]) -> Policy:
    """Policy of `POLICIES`; `ValueError` for another name."""
    if name == RANDOM:
        return RandomPolicy(task)
    if name not in VARIANTS:
        raise ValueError(f"policy {name!r}: expected one of {', '.join(POLICIES)}")
    return LoopPolicy(task, VARIANTS[name], parts)


def run_policy(
    env: GazeVectorEnv,
    make_policy: Callable[[], Policy],
    *,
    episodes: int,
    seed: int = 0,
    recorder: Recorder | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> PolicyResult:
    """Let a policy act in episodes with the seeds `seed` to `seed + episodes - 1`.

    Parameters
    ----------
    env : GazeVectorEnv
        Which is reset; as many episodes run side by side as it has environments.
    make_policy : callable
        Makes the policy of one environment.
    episodes : int
    seed : int
    recorder : Recorder, optional
        Is shown every step of these episodes.
    progress : callable, optional
        Gets the episodes done and to do.
    """
    if episodes < 1:
        raise ValueError(f"expected one episode or more, got {episodes}")
    policies = [make_policy() for _ in range(env.num_envs)]
    rewards: list[FloatArray] = []
    errors: list[FloatArray] = []
    for first in range(0, episodes, env.num_envs):
        wanted = min(env.num_envs, episodes - first)
        of_round = _round(env, policies, [seed + first + k for k in range(wanted)], recorder)
        rewards += list(of_round[0].T)
        errors += list(of_round[1].T)
        progress(min(first + env.num_envs, episodes), episodes)
    return PolicyResult(
        returns=tuple(float(each.sum()) for each in rewards[:episodes]),
        gaze_error_rms_deg=tuple(float(np.degrees(np.sqrt(np.mean(each**2)))) for each in errors[:episodes]),
    )


def _round(
    env: GazeVectorEnv, policies: Sequence[Policy], seeds: Sequence[int], recorder: Recorder | None
) -> tuple[FloatArray, FloatArray]:
    """Rewards and gaze errors of an episode in each environment, shape (steps, environments).

    There may be fewer seeds than environments: what the others do is not recorded.
    """
    observation, _ = env.reset(seed=seeds[0])
    for k, policy in enumerate(policies):
        policy.begin(seeds[0] + k)
    if recorder is not None:
        recorder.begin(seeds)
    rewards, errors = [], []
    for _ in range(env.task.steps):
        actions = np.stack(
            [policy.act({name: values[k] for name, values in observation.items()}) for k, policy in enumerate(policies)]
        )
        seen = observation
        observation, reward, _, _, info = env.step(actions)
        if recorder is not None:
            recorder.step(seen, actions, reward)
        rewards.append(reward)
        errors.append(info["gaze_error_rad"])
    if recorder is not None:
        recorder.end()
    return np.array(rewards), np.array(errors)
