"""`mirrorgaze bag`: its help, and what it says of a folder that holds no dive."""

from __future__ import annotations

from typer.testing import CliRunner

from mirrorgaze.cli import app


def test_the_help_has_an_example():
    result = CliRunner().invoke(app, ["bag", "--help"])
    assert result.exit_code == 0
    assert "mirrorgaze bag out/spiral -o spiral.bag" in result.output


def test_a_folder_without_a_dive_is_bad_input(tmp_path):
    result = CliRunner().invoke(app, ["bag", str(tmp_path), "-o", str(tmp_path / "bag")])
    assert result.exit_code == 2
    assert "without dive.toml, without log.parquet, without video.mkv" in result.output
    assert not (tmp_path / "bag").exists()


def test_a_dive_without_a_video_is_refused_before_it_is_made(tmp_path):
    arguments = ["dive", "spiral", "--no-video", "--bag", "-o", str(tmp_path / "out")]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2
    assert "--bag: expected a dive with a video" in result.stderr
    assert not (tmp_path / "out").exists()
