"""The server: what it says where it cannot serve."""

import socket

import pytest
from typer.testing import CliRunner

from mirrorgaze.cli import app
from studio import server
from studio.session import Session


def test_without_viser_the_next_step_is_said_and_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(server.importlib.util, "find_spec", lambda name: None)
    result = CliRunner().invoke(app, ["studio", "aqua2"])
    assert result.exit_code == 2
    assert "pip install 'mirrorgaze[studio]'" in result.output
    assert list(tmp_path.iterdir()) == []


def test_a_port_that_is_taken_is_said(tmp_path):
    pytest.importorskip("viser", reason=server.MISSING)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ValueError, match=f"--tcp-port {port}: expected a free port"):
            server.served(Session("aqua2", folder=tmp_path), tcp_port=port).__enter__()
