"""`mirrorgaze design`: options that do not go together; what it makes is tested in tests/reports/studies."""

from __future__ import annotations

from typer.testing import CliRunner

from mirrorgaze.cli import app


def test_a_dive_that_is_left_out_cannot_be_chosen(here):
    result = CliRunner().invoke(app, ["design", "aqua2", "--dive", "spiral", "--no-dive"])
    assert result.exit_code == 2
    assert result.stderr == "mirrorgaze: --dive spiral: expected no dive beside --no-dive; leave one of the two out\n"
    assert not any(here.iterdir())
