"""Options that belong together become one parameter of a command."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import typer
from typer.testing import CliRunner

from mirrorgaze.option_groups import with_option_groups


@dataclass(frozen=True, kw_only=True)
class Pose:
    q1_deg: Annotated[float, typer.Option(help="Pan joint angle, in degrees.")] = 0.0
    stowed: Annotated[bool, typer.Option("--stowed", help="Swing the fold mirror away.")] = False


STOWED = Pose(q1_deg=5.0, stowed=True)


def printed(command, *arguments: str) -> str:
    app = typer.Typer(rich_markup_mode=None)
    app.command()(with_option_groups(command))
    result = CliRunner().invoke(app, list(arguments))
    assert result.exit_code == 0, result.output
    return result.stdout.strip()


def show(rig: str, pose: Pose, scale: float = 1.0) -> None:
    typer.echo(f"{rig} {pose} {scale}")


def show_stowed(pose: Pose = STOWED) -> None:
    typer.echo(f"{pose}")


def test_fields_are_options():
    assert printed(show, "aqua2", "--q1-deg", "30", "--scale", "2") == f"aqua2 {Pose(q1_deg=30.0)} 2.0"
    assert printed(show, "aqua2", "--stowed") == f"aqua2 {Pose(stowed=True)} 1.0"


def test_a_command_may_have_other_defaults():
    assert printed(show_stowed) == str(STOWED)
    assert printed(show_stowed, "--q1-deg", "0") == str(Pose(q1_deg=0.0, stowed=True))


def test_commands_without_groups_stay_as_they_are():
    def plain(rig: str) -> None:
        typer.echo(rig)

    assert with_option_groups(plain) is plain
