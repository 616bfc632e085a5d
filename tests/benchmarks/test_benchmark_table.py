"""The benchmarks' command: names, rows for people and rows for machines. What they measure is not run here."""

from __future__ import annotations

import importlib
import json
import shutil
import subprocess
import sys
import types
from pathlib import Path

import pytest

main_module = importlib.import_module("benchmarks.__main__")

ROOT = Path(__file__).parents[2]

ROW = {"name": "a name", "ours": 1234.5, "peer": 0.5, "unit": "G", "ratio": 2469.0, "note": "peer: somebody"}


@pytest.fixture
def benchmarks(monkeypatch):
    """Names of the benchmarks that are asked for; none is run."""
    runs = []

    def measured(module):
        runs.append(module.removeprefix("benchmarks."))
        return [{**ROW, "name": runs[-1]}]

    monkeypatch.setattr(main_module, "measured", measured)
    return runs


def test_the_command_runs_each_benchmark_in_a_process_of_its_own(tmp_path):
    package = tmp_path / "benchmarks"
    package.mkdir()
    for name in ("__init__", "__main__", "processes"):
        shutil.copy(ROOT / "benchmarks" / f"{name}.py", package)
    for name in ("train", "search"):
        (package / f"{name}.py").write_text(
            "import os\n\n\ndef run():\n    return [{'ours': [os.getpid(), os.getppid()]}]\n"
        )
    command = [sys.executable, "-m", "benchmarks", "train", "search", "--json"]
    finished = subprocess.run(command, check=False, cwd=tmp_path, capture_output=True, text=True)
    assert finished.returncode == 0, finished.stderr
    (first, parent), (second, same_parent) = (row["ours"] for row in json.loads(finished.stdout))
    assert parent == same_parent
    assert len({first, second, parent}) == 3


def test_all_benchmarks_are_run_by_default(benchmarks, capsys):
    assert main_module.main(["--json"]) == 0
    assert benchmarks == ["first", "design", "train", "projection", "coverage", "render", "search", "loop"]
    assert [row["name"] for row in json.loads(capsys.readouterr().out)] == benchmarks


def test_named_benchmarks_are_run_in_the_order_given(benchmarks, capsys):
    assert main_module.main(["render", "train"]) == 0
    assert benchmarks == ["render", "train"]
    output = capsys.readouterr().out
    assert "2.47e+03 x" in output
    assert "peer" in output


def test_an_unknown_name_is_bad_input(benchmarks, capsys):
    assert main_module.main(["train", "speed"]) == 2
    assert benchmarks == []
    names = "first, design, train, projection, coverage, render, search, loop"
    checks = "healpix, distances, bias, robots, detector, control, studio, kills, simulator"
    assert capsys.readouterr().err == f"expected benchmarks among {names}, or first one of {checks}, got speed\n"


@pytest.mark.parametrize("name", main_module.CHECKS)
def test_a_check_gets_its_own_arguments_and_tells_by_its_exit_code(name, monkeypatch):
    stand_in = types.ModuleType(f"benchmarks.{name}")
    stand_in.main = lambda arguments: 1 if arguments == ["--rows", "3"] else 0
    monkeypatch.setitem(sys.modules, f"benchmarks.{name}", stand_in)
    assert main_module.main([name, "--rows", "3"]) == 1
    assert main_module.main([name]) == 0
