"""`mirrorgaze share`: where it refuses to write, before anything is computed; its file is tests/reports' matter."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app


@pytest.mark.parametrize(
    ("output", "words"),
    [
        ("explorer.pdf", "explorer.pdf: expected an HTML file, such as aqua2-explorer.html"),
        ("no/such/explorer.html", "expected a folder that exists, got"),
    ],
)
def test_a_place_that_is_none_is_named(tmp_path, output, words):
    result = CliRunner().invoke(app, ["share", "aqua2", "-o", str(tmp_path / output)])
    assert result.exit_code == 2
    assert words in result.stderr.replace("\n", " ")
    assert list(tmp_path.iterdir()) == []


def test_a_rig_without_mirrors_has_nothing_to_explore(tmp_path):
    result = CliRunner().invoke(app, ["share", "bench", "-o", str(tmp_path / "explorer.html")])
    assert result.exit_code == 2
    assert "expected a rig with mirrors, got 'bench'" in result.stderr
