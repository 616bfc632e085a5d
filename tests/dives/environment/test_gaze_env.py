"""The environments keep Gymnasium's promises, and are what a dive says: same seed, same bytes; alone or side by side.

The small rig in open water with coarse light, without hull and mount.
"""

from __future__ import annotations

import subprocess
import sys

import gymnasium
import numpy as np
import pytest

from dives.dive import varied
from dives.environment import evaluation
from dives.environment.episode import Episode
from dives.environment.evaluation import check_environment, policy_named, run_policy, steps_per_s
from dives.environment.gaze_env import GazeEnv, GazeVectorEnv
from dives.environment.task import REWARD_UNIT_RAD, GazeTask
from dives.ground_truth_columns import GroundTruthColumns
from dives.trajectories.motions import Straight
from scenes.baking.light_quality import LightQuality

FRAME_PX = 24


@pytest.fixture(scope="module")
def settings(small_dive):
    return {"dive": small_dive, "parts": (), "frame_px": FRAME_PX, "episode_s": 0.2, "quality": LightQuality.coarse()}


@pytest.fixture(scope="module")
def env(settings):
    return GazeEnv(**settings)


@pytest.fixture(scope="module")
def envs(settings):
    return GazeVectorEnv(3, **settings)


def played(env, seed, actions):
    """Observations and rewards of a reset and some actions."""
    observations, rewards = [env.reset(seed=seed)[0]], []
    for action in actions:
        observation, reward, *_ = env.step(action)
        observations.append(observation)
        rewards.append(reward)
    return observations, rewards


def some_actions(space, count):
    space.seed(5)
    return [space.sample() for _ in range(count)]


@pytest.mark.parametrize("action", ["speeds", "angles"])
def test_gymnasium_checks_it(settings, action):
    check_environment(GazeEnv(**settings, action=action))


def test_an_environment_side_by_side_is_the_one_alone_to_the_byte(env, envs):
    actions = some_actions(envs.action_space, 4)
    together, rewards = played(envs, 11, actions)
    for k in range(envs.num_envs):
        alone, own = played(env, 11 + k, [each[k] for each in actions])
        for one, several in zip(alone, together, strict=True):
            assert all(np.array_equal(one[name], several[name][k]) for name in one)
        assert own == [float(each[k]) for each in rewards]
    assert not np.array_equal(together[0]["frame"][0], together[0]["frame"][1])


def test_time_alone_ends_an_episode_and_the_next_one_begins(envs):
    envs.reset(seed=0)
    still = np.zeros((3, 2), dtype=np.float32)
    ended = [envs.step(still)[2:4] for _ in range(6)]
    assert [bool(truncated.all()) for _, truncated in ended] == [False] * 5 + [True]
    assert not any(terminated.any() for terminated, _ in ended)
    _, reward, _, truncated, _ = envs.step(still)
    assert (reward == 0).all()
    assert not truncated.any()


def test_reward_is_minus_the_gaze_error_of_the_true_joints(env):
    """By the virtual camera: its axis, and the direction from its centre to the target."""
    from dives.paths import body_pose, target_pose
    from optics.gaze.kinematics import virtual_camera
    from optics.layout import Layout

    env.reset(seed=4)
    _, reward, _, _, info = env.step(np.array([0.5, -0.5], dtype=np.float32))
    state = env._episode.state
    world_from_camera = state.world_from_body * virtual_camera(Layout.from_rig(env.task.rig), *info["q_true"])
    seen = world_from_camera.inv().apply(state.world_from_target.translation)
    error = np.arctan2(np.hypot(*seen[:2]), seen[2])
    assert reward == pytest.approx(-error / REWARD_UNIT_RAD, rel=1e-9)
    dive = env._episode._dive
    np.testing.assert_array_equal(state.world_from_body.as_matrix(), body_pose(dive, state.time_s).as_matrix())
    np.testing.assert_array_equal(state.world_from_target.as_matrix(), target_pose(dive, state.time_s).as_matrix())


@pytest.mark.parametrize("seed", range(3))
def test_an_episode_begins_with_the_gaze_near_the_target(env, seed):
    """Within the start's error, and what mirror and virtual camera see differently: they are 0.26 m apart."""
    info = env.reset(seed=seed)[1]
    assert np.degrees(info["gaze_error_rad"]) < env.task.start_error_deg + 3


def test_the_frame_shows_the_target_where_the_gaze_error_says(settings):
    """At a perfect gaze the red ball is in the frame's middle."""
    env = GazeEnv(**{**settings, "start_error_deg": 0.0, "frame_px": 48})
    frame = env.reset(seed=1)[0]["frame"].astype(float)
    redness = np.clip(frame[..., 0] - frame[..., 1:].max(axis=-1), 0, None)
    rows, columns = np.indices(redness.shape)
    centre = np.array([(rows * redness).sum(), (columns * redness).sum()]) / redness.sum()
    # Servos stop within their deadband, and the mirror looks from another place than the virtual camera.
    assert np.abs(centre - 23.5).max() < 4


def test_angles_are_commanded_as_they_are(settings):
    env = GazeEnv(**settings, action="angles")
    env.reset(seed=2)
    asked = env._episode.q_command + 0.01
    env.step(asked.astype(np.float32))
    np.testing.assert_allclose(env._episode.q_command, asked, atol=1e-6)
    beyond = np.array([100.0, -100.0])
    env.step(beyond)
    np.testing.assert_array_equal(env._episode.q_command, [env.task.gimbal.highest[0], env.task.gimbal.lowest[1]])


def test_a_law_holds_the_target_and_chance_does_not(small_dive):
    quality = LightQuality.coarse()
    envs = GazeVectorEnv(2, varied(small_dive), parts=(), frame_px=32, episode_s=0.26, quality=quality)
    results = {
        name: run_policy(envs, lambda name=name: policy_named(name, envs.task, []), episodes=3)
        for name in ("paper", "random")
    }
    assert len(results["paper"].returns) == 3
    assert results["paper"].mean_return.estimate > results["random"].mean_return.estimate
    assert results["paper"] == run_policy(envs, lambda: policy_named("paper", envs.task, []), episodes=3)


def test_settings_outside_their_limits_are_named_together(small_dive):
    with pytest.raises(ValueError, match=r"action: expected speeds or angles, got 'torque'; frame_px: .*; episode_s: "):
        GazeTask.of(small_dive, action="torque", frame_px=4, episode_s=99)


def test_an_unreachable_target_is_told(small_dive):
    """Straight below, which the tilt of aqua2 does not reach."""
    below = Straight(shape="straight", start_m=(0.3, 0.0, -3.0), velocity_m_per_s=(0.0, 0.0, 0.0))
    away = small_dive.model_copy(update={"target": small_dive.target.model_copy(update={"path": below})})
    task = GazeTask.of(away, episode_s=0.2)
    truth = GroundTruthColumns(task.rig, away.target.load_shape(), away.detector_settings())
    with pytest.raises(ValueError, match="expected a target that the mirrors of 'aqua2' can look at"):
        Episode(task, truth, np.random.default_rng(0))


def test_steps_are_counted_in_all_environments(envs, monkeypatch):
    """Ten seconds pass while two steps are made in each of three."""
    clock = iter([0.0, 10.0])
    monkeypatch.setattr(evaluation.time, "perf_counter", lambda: next(clock))
    assert steps_per_s(envs, steps=2) == pytest.approx(0.6)


def test_it_is_registered(settings):
    made = gymnasium.make("MirrorGaze-v0", **settings)
    assert made.spec.id == "MirrorGaze-v0"


def test_without_gymnasium_a_sentence_says_what_to_install():
    code = "import sys; sys.modules['gymnasium'] = None\nimport dives.environment.gaze_env"
    child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "pip install 'mirrorgaze[env]'" in child.stderr
