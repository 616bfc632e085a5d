"""`mirrorgaze env`: what it prints of a small dive, and how it refuses. What is in it is tested with the dives."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app

pytestmark = pytest.mark.usefixtures("rough_light")

DIVE = """
name = "short"
rig = "aqua2"
world = "blue"
depth_m = 5.0
duration_s = 1.0

[robot]
motion = "hover"

[target.path]
shape = "straight"
start_m = [2.0, 0.3, 0.1]
velocity_m_per_s = [0.0, 0.1, 0.0]
"""


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, ["env", *arguments])


@pytest.fixture
def short_dive(tmp_path):
    file = tmp_path / "short.toml"
    file.write_text(DIVE, encoding="utf-8")
    return str(file)


def test_policies_get_the_same_episodes(short_dive, monkeypatch, tmp_path):
    from cad.assembly import meshes

    monkeypatch.setattr(meshes, "rig_meshes", lambda rig: [])
    few = ("--episodes", "2", "--envs", "2", "--episode-s", "0.1", "--frame-px", "16")
    result = mirrorgaze(short_dive, *few, "--policy", "paper,random", "--json")
    assert result.exit_code == 0, result.stderr
    data = json.loads(result.stdout)
    assert data["steps_per_episode"] == 3
    assert set(data["steps_per_s"]) == {"1", "2"}
    assert all(len(policy["returns"]) == 2 for policy in data["policies"].values())
    recording = ("--record", str(tmp_path / "set"))
    table = mirrorgaze(short_dive, *few, "--policy", "random", *recording).stdout.splitlines()
    assert table[0] == "short, aqua2: Gymnasium's check_env passed"
    assert table[-2].split()[0] == "random"
    assert json.loads((tmp_path / "set/meta/info.json").read_text())["total_episodes"] == 2
    verified = CliRunner().invoke(app, ["dataset", "--verify", str(tmp_path / "set")])
    assert verified.stdout == f"{tmp_path / 'set'}: 6 samples, 3 files read: in order\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("spiral", "--policy", "best"), "policy 'best': expected one of paper-literal, paper, default, random"),
        (("spiral", "--episode-s", "100"), "episode_s: expected 0.0333333 to 60 s"),
        (("spiral", "--record", "demonstrations"), "--record: expected one policy"),
        (("nosuch",), "expected a preset"),
    ],
)
def test_bad_input_is_a_sentence_and_2(arguments, message):
    result = mirrorgaze(*arguments)
    assert result.exit_code == 2
    assert message in result.stderr
