"""`mirrorgaze tolerance`: what it prints and writes, and that the same seed writes the same bytes."""

from __future__ import annotations

import csv
import json

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app


def mirrorgaze(*arguments: str):
    return CliRunner().invoke(app, ["tolerance", *arguments])


def rows_of(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_it_ranks_and_writes(tmp_path):
    result = mirrorgaze("aqua2", "--samples", "200", "-o", str(tmp_path / "out"))
    assert result.exit_code == 0, result.stderr
    lines = result.stdout.splitlines()
    assert lines[0] == "aqua2: 200 rigs built, 9 poses"
    assert any(line.strip().startswith("calibrated, gaze (deg)") for line in lines)
    rows = rows_of(tmp_path / "out/ranking.csv")
    shares = [float(row["gaze_share"]) for row in rows]
    assert shares == sorted(shares, reverse=True)
    assert sum(shares) == pytest.approx(1, abs=1e-4)
    assert len(rows_of(tmp_path / "out/percentiles.csv")) == 2 * (1 + 9)
    assert (tmp_path / "out/tolerances.png").stat().st_size > 5000
    assert not list(tmp_path.rglob("*.partial*"))


def test_the_same_seed_writes_the_same_bytes(tmp_path):
    for name in ("a", "b"):
        assert mirrorgaze("bluerov2", "--samples", "100", "--seed", "5", "-o", str(tmp_path / name)).exit_code == 0
    for file in (tmp_path / "a").iterdir():
        assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes(), file.name


def test_json_is_for_machines():
    found = json.loads(mirrorgaze("aqua2", "--samples", "50", "--json").stdout)
    assert found["samples"] == 50
    assert found["ranking"][0]["tolerance"] == "joint_offset_deg"
    assert found["files"] == []


def test_a_rig_without_mirrors_is_bad_input(tmp_path):
    result = mirrorgaze("bench", "-o", str(tmp_path / "out"))
    assert result.exit_code == 2
    assert "expected a rig with mirrors, got 'bench'" in result.stderr
    assert not (tmp_path / "out").exists()


def test_help_has_an_example():
    assert "mirrorgaze tolerance aqua2" in mirrorgaze("--help").stdout
