"""What a user waits for a design: its first page, the whole without its dive, and what a changed mirror costs after it.

Each row is a `mirrorgaze design` in a process of its own, with caches of its own that are empty at first. Times are of
the processor, with the slicer's where there is one; how fast the machine is says a frame of stock Mitsuba `path`.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from benchmarks.first import MIRROR_FILE, STOCK, Caches, waited_row, wider_rig

FIRST_PAGE = ("--only", "coverage", "--only", "outside")
"""The page is written after every stage: these come first."""
WAITS = (
    ("first page of a design", "first page", "aqua2", FIRST_PAGE, 30.0),
    ("design without its dive", "whole", "aqua2", ("--no-dive",), 100.0),
    ("the same after it, M2 10 mm wider", "whole", MIRROR_FILE, ("--no-dive",), 100.0),
)
"""Name, caches, rig, options and seconds that are allowed."""


def run() -> list[dict[str, Any]]:
    """Processor time of each design, beside what is allowed."""
    with tempfile.TemporaryDirectory() as named:
        folder = Path(named)
        wider_rig().save(folder / MIRROR_FILE)
        designs = []
        for name, caches, rig, options, _ in WAITS:
            words = ["-m", "mirrorgaze", "design", rig, *options, "-o", name.replace(" ", "_")]
            designs.append(Caches(folder, caches).finished(words, name))
        frame_s = float(Caches(folder, "whole").finished(["-c", STOCK], "stock").output)
    return [
        waited_row(name, done, allowed_s, frame_s) for (name, *_, allowed_s), done in zip(WAITS, designs, strict=True)
    ]
