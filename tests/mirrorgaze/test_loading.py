"""Commands refuse a rig that is invalid or physically impossible."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app
from rigs import load_document, preset_path, save_document


@pytest.fixture
def impossible_rig(here):
    document = load_document(preset_path("aqua2"))
    document["fold_mirror"]["distance_mm"] = 10.0
    save_document(document, here / "impossible.toml")
    return "impossible.toml"


@pytest.mark.parametrize("command", ["render", "export", "design"])
def test_an_impossible_rig_is_refused_by_every_command(impossible_rig, here, command):
    """M1 inside the port: the sentence names the key; nothing but the rig file is there afterwards."""
    result = CliRunner().invoke(app, [command, impossible_rig])
    assert result.exit_code == 2
    assert "fold_mirror.distance_mm = 10" in result.stderr
    assert [path.name for path in here.iterdir()] == [impossible_rig]
