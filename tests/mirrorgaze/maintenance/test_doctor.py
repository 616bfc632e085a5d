"""`mirrorgaze doctor` proves the backend, and says what is missing and why it matters."""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
from functools import cache

import pytest
from typer.testing import CliRunner

from mirrorgaze import doctor
from mirrorgaze.cli import app


@pytest.fixture(scope="module", autouse=True)
def asked_once():
    """A process that proves something gives the same answer in the same environment, after seconds of imports."""
    ask = doctor._ask

    @cache
    def answer(code, backend):
        return ask(code)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(doctor, "_ask", lambda code: answer(code, os.environ.get("MIRRORGAZE_BACKEND")))
        yield


def examined(*arguments: str):
    return CliRunner().invoke(app, ["doctor", *arguments])


def findings() -> dict[str, dict[str, object]]:
    return {finding["name"]: finding for finding in json.loads(examined("--json").stdout)["findings"]}


def test_the_toolkit_can_work_where_its_tests_run():
    result = examined()
    assert result.exit_code == 0, result.stdout
    assert result.stdout.splitlines()[-1] == "can work"
    assert "float64 kernel" in result.stdout


def test_machines_are_told_the_same():
    answer = json.loads(examined("--json").stdout)
    assert answer["works"] is True
    assert {"python", "backend", "float64 kernel", "rays", "threads", "build123d", "slicer", "chromium"} <= {
        finding["name"] for finding in answer["findings"]
    }


def test_without_a_backend_it_cannot_work(monkeypatch):
    monkeypatch.setenv("MIRRORGAZE_BACKEND", "metal")
    result = examined()
    assert result.exit_code == 1
    assert "MISSING  MIRRORGAZE_BACKEND = 'metal': expected llvm or cuda" in result.stdout
    assert result.stdout.splitlines()[-1].startswith("cannot work")


def test_a_backend_that_aborts_is_survived(monkeypatch):
    """Drjit aborts the process with LLVM 15 or 16; the child stands in for it."""
    ask = doctor._ask
    monkeypatch.setattr(doctor, "_ask", lambda code: ask("import os; os.abort()"))
    found = findings()["backend"]
    assert (found["found"], found["detail"]) == (False, "the process was ended by signal 6")


@pytest.mark.parametrize(
    ("name", "proof"),
    [
        # Single precision.
        ("float64 kernel", {"error": 1e-7, "hit_m": doctor.TRIANGLES_M}),
        # What a graphics card does with scenes that do not share a table: the second is not searched.
        ("rays", {"error": 1e-15, "hit_m": [1.0, float("inf")]}),
    ],
)
def test_a_backend_that_computes_something_else_is_not_good_enough(monkeypatch, name, proof):
    ask = doctor._ask
    answer = {"kind": "llvm", "llvm_path": None, "device": None, "variant": "v", "threads": 1, **proof}
    monkeypatch.setattr(doctor, "_ask", lambda code: (answer, "") if "prove_backend" in code else ask(code))
    assert findings()[name]["found"] is False
    assert examined().exit_code == 1


@pytest.mark.parametrize("name", ["slicer", "chromium"])
def test_a_program_that_is_absent_is_not_needed(monkeypatch, name):
    monkeypatch.setattr(shutil, "which", lambda _command: None)
    finding = findings()[name]
    assert (finding["found"], finding["needed"]) == (False, False)
    assert "apt-get install" in finding["detail"]


def test_an_extra_that_is_absent_is_not_needed(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: None)
    finding = findings()["embreex"]
    assert (finding["found"], finding["needed"]) == (False, False)
    assert "./run bench installs it" in finding["detail"]
