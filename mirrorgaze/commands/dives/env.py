"""A dive as an environment for learning."""

from __future__ import annotations

from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from mirrorgaze.options import DiveArgument, JsonOption, SeedOption
from mirrorgaze.output import print_json, print_progress, print_step, print_table


def env(
    dive: DiveArgument,
    rig: Annotated[
        str | None, typer.Option(metavar="RIG", help="Preset name or rig file.", show_default="the dive's")
    ] = None,
    policy: Annotated[
        str, typer.Option(help="Policies, separated by commas: default, paper, paper-literal, random.")
    ] = "default,paper,random",
    episodes: Annotated[int, typer.Option(metavar="N", help="Number of episodes of each policy.", min=1)] = 8,
    envs: Annotated[int, typer.Option(metavar="N", help="Number of environments side by side.", min=1)] = 8,
    action: Annotated[
        Literal["speeds", "angles"], typer.Option(help="What an action is: joint speeds or joint angles.")
    ] = "speeds",
    frame_px: Annotated[int, typer.Option(metavar="N", help="Size of the square frame, in pixels.")] = 64,
    episode_s: Annotated[float, typer.Option(help="Length of an episode, in seconds.")] = 10.0,
    start_error_deg: Annotated[
        float, typer.Option(help="How far the gaze is off the target at the start at most, in degrees.")
    ] = 8.0,
    seed: SeedOption = 0,
    record: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Write the policy's episodes as a LeRobot data set (v3.0) into this folder.",
            show_default=False,
        ),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Check a learning environment and run policies.

    The environment is one of Gymnasium: an action turns the mirrors, an observation is the frame over the mirrors
    with the joints, the reward is minus the gaze error. Lets Gymnasium check it, prints its spaces and its steps per
    second, alone and side by side, and the return and RMS gaze error of policies that are known with intervals of
    95 %. Every policy gets the same episodes, with seeds from --seed on. --record writes those of one policy as
    demonstrations: what was seen, done and rewarded at each step.

    Takes the package gymnasium: pip install 'mirrorgaze[env]'.

    \b
    Example:
      mirrorgaze env spiral --episodes 16
      mirrorgaze env my-dive.toml --rig my-auv.toml --policy default,random --json
      mirrorgaze env spiral --policy default --episodes 50 --record out/demonstrations
    """
    from cad.assembly.meshes import rig_meshes
    from dives.environment.evaluation import check_environment, policy_named, policy_table, run_policy, steps_per_s
    from dives.environment.gaze_env import GazeEnv, GazeVectorEnv, observation_space
    from dives.environment.lerobot import check_recordable, record_episodes
    from dives.environment.task import GazeTask
    from mirrorgaze.loading import load_usable_rig

    settings: dict[str, Any] = {
        "action": action,
        "frame_px": frame_px,
        "episode_s": episode_s,
        "start_error_deg": start_error_deg,
    }
    task = GazeTask.of(dive, None if rig is None else load_usable_rig(rig), **settings)
    parts = rig_meshes(task.rig)
    names = [name.strip() for name in policy.split(",")]
    policies = {name: partial(policy_named, name, task, parts) for name in names}
    for make in policies.values():
        make()  # an unknown name is reported before anything takes time
    if record is not None:
        if len(names) != 1:
            raise typer.BadParameter(f"--record: expected one policy, got {policy}; say which with --policy")
        check_recordable(record, task)
    print_step("environment ...")
    alone = GazeEnv(task.dive, rig=task.rig, parts=parts, **settings)
    check_environment(alone)
    speeds = {1: steps_per_s(alone)}
    together = GazeVectorEnv(envs, task.dive, rig=task.rig, parts=parts, **settings)
    speeds[envs] = steps_per_s(together)
    results = {}
    for name, make in policies.items():
        recording = nullcontext() if record is None else record_episodes(record, task, policy=name)
        with recording as recorder:
            results[name] = run_policy(
                together,
                make,
                episodes=episodes,
                seed=seed,
                recorder=recorder,
                progress=partial(print_progress, name),
            )
    if json:
        print_json(
            {
                "observation_space": str(alone.observation_space),
                "action_space": str(alone.action_space),
                "steps_per_episode": task.steps,
                "steps_per_s": {str(count): speed for count, speed in speeds.items()},
                "policies": {name: result.as_dict() for name, result in results.items()},
            }
        )
        return
    typer.echo(f"{task.dive.name}, {task.rig.name}: Gymnasium's check_env passed")
    print_table(
        [
            *((f"  {name}", str(space)) for name, space in observation_space(task).items()),
            (f"  action, {action}", str(alone.action_space)),
            ("  steps of an episode", str(task.steps)),
            *((f"  steps per second, {count} side by side", f"{speed:.0f}") for count, speed in speeds.items()),
        ]
    )
    print_table(policy_table(results))
    if record is not None:
        typer.echo(f"{record}: {episodes} episodes")
