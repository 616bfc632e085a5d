"""An ensemble in folders: what is finished stays, what failed is done again, what is no dive is refused at once.

A stand-in dives in its place: it puts a made log where a dive would put its own.
"""

from __future__ import annotations

import json
import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from dives.ensembles.members import Choice, members
from dives.ensembles.run import planned, run_ensemble, with_rigs
from dives.known_target import with_known_target
from dives.metrics.frames import FLAGS, NUMBERS, TEXT
from dives.runner import identity_of
from optics.workers.shards import Shard
from rigs import Rig
from tracking.log import LOG

DIVE = """
name = "short"
rig = "aqua2"
depth_m = 5.0
duration_s = 1.0
[robot]
motion = "hover"
[target]
[target.path]
shape = "spiral"
start_radius_m = 2.0
turning_deg_per_s = 2.0
"""

WORK = '''
"""Writes a log that tells its dive, but for what `failing` names."""

import json
from pathlib import Path

import pyarrow.parquet as pq

HERE = Path(__file__).parent


def work(text, folder):
    folder = Path(folder)
    if folder.name in (HERE / "failing").read_text().split():
        raise OSError("No space left on device")
    table = pq.read_table(HERE / "log.parquet")
    identity = json.loads((HERE / "identities.json").read_text())[folder.name]
    folder.mkdir(parents=True)
    pq.write_table(table.replace_schema_metadata({"identity": identity, "digests": "{}"}), folder / "log.parquet")
'''


@pytest.fixture
def short(tmp_path):
    file = tmp_path / "short.toml"
    file.write_text(DIVE)
    return file


@pytest.fixture
def work(tmp_path, monkeypatch):
    (tmp_path / "stand_in").mkdir()
    (tmp_path / "stand_in/stand_in.py").write_text(WORK)
    (tmp_path / "stand_in/failing").touch()
    monkeypatch.syspath_prepend(tmp_path / "stand_in")
    frames = 10
    columns = {name: np.zeros(frames) for name in NUMBERS} | {"time_s": np.arange(frames) / 10}
    columns |= {name: ["track"] * frames for name in TEXT} | {name: np.zeros(frames, dtype=bool) for name in FLAGS}
    pq.write_table(pa.table(columns), tmp_path / "stand_in/log.parquet")
    import stand_in

    yield stand_in.work
    del sys.modules["stand_in"]


@pytest.fixture
def run(work, short, tmp_path):
    """`run(members, failing)`: what became of them, and what was said."""

    def running(chosen, failing="", shard=None):
        dives = planned(short, chosen)
        # As `run_dive` has it: a dive that names no least area of a blob gets that of its ball.
        rig = Rig.load("aqua2")
        identities = {
            name: identity_of(with_known_target(dive, dive.at_frame_rate(rig)), dive.at_frame_rate(rig))
            for name, dive in dives.items()
        }
        (tmp_path / "stand_in/identities.json").write_text(json.dumps(identities))
        (tmp_path / "stand_in/failing").write_text(failing)
        said: list[str] = []
        found = run_ensemble(short, chosen, tmp_path / "out", workers=1, shard=shard, log=said.append, work=work)
        return found, said

    return running


def test_each_dive_in_its_folder_and_finished_ones_stay(run, tmp_path):
    chosen = members([Choice(key="variant", values=("default", "paper"))], seeds=[0])
    failed = "variant=paper,seed=0"
    found, said = run(chosen, failing=failed)
    assert [outcome.failure is None for outcome in found] == [True, False]
    assert found[0].metrics["duration_s"] == pytest.approx(1.0)
    assert found[1].metrics is None
    assert f"{failed}, failed: OSError: No space left on device" in "\n".join(said)
    first = (tmp_path / "out/variant=default,seed=0" / LOG).stat().st_mtime_ns

    # Once more, with a seed more: the finished one is left alone, the failed one is done again.
    more = members([Choice(key="variant", values=("default", "paper"))], seeds=[0, 1])
    found, said = run(more)
    assert said[0] == "1 of 4 dives: done before"
    assert said[-1].startswith("4 of 4 dives: ")
    assert all(outcome.failure is None for outcome in found)
    assert [outcome.member.name for outcome in found] == [member.name for member in more]
    assert (tmp_path / "out/variant=default,seed=0" / LOG).stat().st_mtime_ns == first


def test_shards_make_what_the_whole_puts_together(run, tmp_path):
    """Two of two, the second with a dive that fails; the whole finds what they made, and makes what is missing."""
    chosen = members([], seeds=[0, 1, 2])
    first, _ = run(chosen, shard=Shard(1, 2))
    assert [outcome.member.seed for outcome in first] == [0, 2]
    second, _ = run(chosen, failing="seed=1", shard=Shard(2, 2))
    assert [outcome.failure is None for outcome in second] == [False]
    told = [json.loads((tmp_path / f"out/shard-{number}-of-2.json").read_text()) for number in (1, 2)]
    assert told[0] == {"shard": 1, "of": 2, "all_pieces": 3, "pieces": {"seed=0": "done", "seed=2": "done"}}
    assert told[1]["pieces"] == {"seed=1": "failed: OSError: No space left on device"}
    found, said = run(chosen)
    assert said[0] == "2 of 3 dives: done before"
    assert [outcome.failure for outcome in found] == [None] * 3


def test_a_folder_of_another_dive_is_refused_before_anything_is_dived(run, tmp_path):
    chosen = members([], seeds=[0, 1])
    run(chosen[:1])
    log = tmp_path / "out/seed=0" / LOG
    pq.write_table(pq.read_table(log).replace_schema_metadata({"identity": "another"}), log)
    with pytest.raises(ValueError, match="seed=0: expected the same dive as before"):
        run(chosen)
    assert not (tmp_path / "out/seed=1").exists()


def test_settings_reach_the_dive(short):
    chosen = members([Choice(key="target.path.rising_m_per_s", values=(0.0, 0.01))], seeds=[3])
    dives = planned(short, chosen)
    assert [dive.target.path.rising_m_per_s for dive in dives.values()] == [0.0, 0.01]
    assert {dive.seed for dive in dives.values()} == {3}


def test_settings_reach_the_rig(short, tmp_path):
    """Its file lies beside the dives, one for each setting; a rig that cannot be is told before any is written."""
    chosen = members([Choice(key="rig.image_sensor.read_noise_e", values=(1.0, 9.0))], seeds=[0, 1])
    dives = with_rigs(planned(short, chosen), chosen, tmp_path / "rigs")
    assert [dive.load_rig().image_sensor.read_noise_e for dive in dives.values()] == [1.0, 1.0, 9.0, 9.0]
    assert len(list((tmp_path / "rigs").iterdir())) == 2
    wrong = members([Choice(key="rig.image_sensor.read_noise_e", values=(2.0, -1.0))], seeds=[0])
    with pytest.raises(ValueError, match="read_noise_e"):
        with_rigs(planned(short, wrong), wrong, tmp_path / "more")
    assert not (tmp_path / "more").exists()


def test_every_impossible_member_is_told_at_once(short, tmp_path):
    chosen = members(
        [Choice(key="variant", values=("nosuch", "default")), Choice(key="deptj_m", values=(3,))], seeds=[0]
    )
    with pytest.raises(ValueError, match="variant") as error:
        run_ensemble(short, chosen, tmp_path / "out", workers=1, log=print)
    assert str(error.value).count("deptj_m") >= 2  # in each of the two
    assert not (tmp_path / "out").exists()


def test_no_workers_are_refused(short, tmp_path):
    with pytest.raises(ValueError, match="one worker or more, got 0"):
        run_ensemble(short, [], tmp_path, workers=0, log=print)
