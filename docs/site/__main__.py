"""Build the site: `./run docs`, or `python -m docs.site`."""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

from docs.site import gallery
from docs.site.command_pages import write_command_pages
from docs.site.python_pages import write_python_pages
from docs.site.rig_file_page import write_rig_file_page
from docs.site.staging import stage
from rigs import Rig

ROOT = Path(__file__).resolve().parents[2]


def main(arguments: list[str] | None = None) -> int:
    """Build the site below `out/docs`, say where it is and how long it took; 0 without warnings."""
    parser = argparse.ArgumentParser(prog="./run docs", description="Build the manual as a site, from disk for disk.")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "out" / "docs", help="folder (out/docs)")
    parser.add_argument("--no-notebooks", action="store_true", help="show notebooks and gallery without running them")
    parser.add_argument("--no-python", action="store_true", help="leave out the Python reference")
    chosen = parser.parse_args(arguments)
    began = time.monotonic()
    source, site = chosen.output / "source", chosen.output / "site"
    for folder in (source, site):
        shutil.rmtree(folder, ignore_errors=True)
    stage(ROOT, source)
    _generate(source, python=not chosen.no_python)
    make = gallery.stand_ins if chosen.no_notebooks else gallery.make_images
    make(source / "gallery.md")
    status = _sphinx(source, site, notebooks=not chosen.no_notebooks)
    sys.stdout.write(f"{site / 'index.html'} ({time.monotonic() - began:.0f} s)\n")
    return status


def _generate(source: Path, *, python: bool) -> None:
    write_command_pages(source / "reference" / "command_line")
    write_rig_file_page(
        Rig.model_json_schema(), ROOT / "rigs" / "presets" / "aqua2.toml", source / "reference" / "rig_file.md"
    )
    if python:
        write_python_pages(ROOT, source / "reference" / "python")


def _sphinx(source: Path, site: Path, *, notebooks: bool) -> int:
    # A process of its own: notebooks take settings and path from its environment.
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")])),
        "MIRRORGAZE_DOCS_NOTEBOOKS": "force" if notebooks else "off",
    }
    settings = Path(__file__).parent
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-c", settings, "-b", "html", source, site]
    return subprocess.run([str(word) for word in command], env=environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
