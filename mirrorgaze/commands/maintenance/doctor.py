"""What is installed, what is missing, and whether the toolkit can work."""

from __future__ import annotations

import typer

from mirrorgaze.errors import FAILED
from mirrorgaze.options import JsonOption
from mirrorgaze.output import print_json, print_table


def doctor(json: JsonOption = False) -> None:
    """Check the installation.

    Lists what is installed, what is missing and why it matters. Exit status 1 when something is missing without which
    the toolkit cannot work.

    \b
    Example:
      mirrorgaze doctor
    """
    from dataclasses import asdict

    from mirrorgaze.doctor import examine, version

    findings = examine()
    works = all(finding.found for finding in findings if finding.needed)
    if json:
        print_json({"version": version(), "works": works, "findings": [asdict(finding) for finding in findings]})
    else:
        typer.echo(f"mirrorgaze {version()}")
        print_table((f"  {finding.name}", finding.verdict, finding.detail) for finding in findings)
        typer.echo("can work" if works else "cannot work: what is marked MISSING is required")
    if not works:
        raise typer.Exit(FAILED)
