"""The gallery's images, made by the command lines that stand above them."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import numpy as np


def command_lines(page: str) -> list[list[str]]:
    """The arguments of `mirrorgaze` in each block of the page, in order."""
    blocks = re.findall(r"^```\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    lines = "".join(blocks).replace("\\\n", " ").splitlines()
    return [shlex.split(line)[1:] for line in lines if line.startswith("./run ")]


def images(page: str) -> list[str]:
    """The images that the page shows."""
    return re.findall(r"!\[[^\]]*\]\(([^)]+)\)", page)


def make_images(page: Path) -> None:
    """Run the page's command lines in its folder."""
    for arguments in command_lines(page.read_text(encoding="utf-8")):
        sys.stdout.write(f"gallery: {shlex.join(arguments)}\n")
        sys.stdout.flush()
        Path(page.parent, "gallery").mkdir(exist_ok=True)
        subprocess.run([sys.executable, "-m", "mirrorgaze", *arguments], cwd=page.parent, check=True)


def stand_ins(page: Path) -> None:
    """Put an even grey where the page's images would be, for a site that is built without running anything."""
    for image in images(page.read_text(encoding="utf-8")):
        target = page.parent / image
        target.parent.mkdir(parents=True, exist_ok=True)
        matplotlib.image.imsave(target, np.full((120, 160, 3), 0.5))
