"""The studio without a browser: images while joints are dragged, what follows a change, memory over minutes."""

from __future__ import annotations

import argparse
import math
import os
import queue
import tempfile
import time
from collections.abc import Sequence
from multiprocessing import active_children
from pathlib import Path
from typing import Any

import numpy as np

from studio.controller import Heard, Studio
from studio.results import Parts, View
from studio.session import Session

RIG = "aqua2"
EVENTS_PER_S = 50.0
"""As a browser sends them while a slider is dragged."""
DRAG_S = 10.0
WIDTHS_MM = (84.0, 88.0, 76.0)
PATIENCE_S = 300.0


def main(arguments: Sequence[str]) -> int:
    """Print images per second and milliseconds from input to image, seconds to coverage, and memory by the minute."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks studio", description=__doc__)
    parser.add_argument("--minutes", type=float, default=2.0, help="of dragging and changing, for the memory")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        _measure(Path(folder), options.minutes)
    return 0


def _measure(folder: Path, minutes: float) -> None:
    heard: queue.Queue[tuple[float, Any]] = queue.Queue()

    def keep(result: Any) -> None:
        heard.put((time.monotonic(), result))

    studio = Studio(Session(RIG, folder=folder))
    studio.heard = Heard(view=keep, parts=keep, covered=keep)
    try:
        begin = time.monotonic()
        studio.start()
        image, _ = _wait(heard, View, "fine")
        print(f"first image after {image - begin:.1f} s")
        print(f"640 x 480, dragged: {_dragged(studio, heard)}")
        for width in WIDTHS_MM:
            begin = time.monotonic()
            studio.change("gaze_mirror.width_mm", width)
            coarse, mount = (when - begin for when in _wait(heard, "coarse", Parts))
            image, fine = (when - begin for when in _wait(heard, View, "fine"))
            print(f"a change: coverage {coarse:.2f} s, mount {mount:.2f} s, image {image:.2f} s, fine {fine:.2f} s")
        begin = time.monotonic()
        while (passed := (time.monotonic() - begin) / 60) < minutes:
            studio.change("gaze_mirror.width_mm", 70.0 + math.floor(10 * passed) % 30)
            print(f"{passed:.1f} min: {_dragged(studio, heard)}; {_memory()}")
    finally:
        studio.close()


def _wait(heard: queue.Queue[tuple[float, Any]], *wanted: type | str) -> list[float]:
    """When the first result of each kind, or fineness of coverage, came, in whatever order."""
    came: dict[type | str, float] = {}
    while len(came) < len(wanted):
        when, result = heard.get(timeout=PATIENCE_S)
        came.setdefault(getattr(result, "fineness", type(result)), when)
        came = {kind: when for kind, when in came.items() if kind in wanted}
    return [came[kind] for kind in wanted]


def _dragged(studio: Studio, heard: queue.Queue[tuple[float, Any]]) -> str:
    """Turn the joints for a while; images per second, and how long an image took from what asked for it."""
    while not heard.empty():
        heard.get()
    begin, count = time.monotonic(), 0
    while time.monotonic() - begin < DRAG_S:
        studio.turn(40 * math.sin(count / 40), 20 * math.sin(count / 63))
        count += 1
        time.sleep(1 / EVENTS_PER_S)
    views = [(when, view) for when, view in list(heard.queue) if isinstance(view, View)]
    delays_ms = [1000 * (when - view.request.asked_s) for when, view in views]
    render_ms = np.median([view.render_ms for _, view in views])
    return (
        f"{len(views) / DRAG_S:.1f} images/s, {render_ms:.0f} ms to render, from input to image "
        f"{np.median(delays_ms):.0f} ms in the median, {np.percentile(delays_ms, 90):.0f} ms in nine of ten"
    )


def _memory() -> str:
    """Resident megabytes of this process and of those that it began, in their order."""
    each_mb = [_resident_mb(pid) for pid in _processes()]
    return f"{sum(each_mb):.0f} MB in all processes ({', '.join(f'{mb:.0f}' for mb in each_mb)})"


def _resident_mb(pid: int) -> float:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def _processes() -> list[int]:
    return [os.getpid(), *sorted(child.pid for child in active_children() if child.pid is not None)]
