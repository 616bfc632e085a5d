"""What a user waits for: the first picture (a draft), the first render, the next ones, and those from the cache.

Each row is a `mirrorgaze render` in a process of its own, in caches of its own: of results and of compiled kernels,
empty for the first render in a world. Times are of the processor, for which others on the machine matter little; how
fast it is says a frame of stock Mitsuba `path` (`benchmarks.render`), measured in the same run.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.processes import CACHE, KERNELS, Finished, finished
from rigs import Rig

MIRROR_FILE, WIDER_MM = "wider.toml", 10
SAME_WATER_FILE = "same_water.toml"
STOCK = "from benchmarks.first import stock_frame_s; print(stock_frame_s())"
STOCK_WORLD, STOCK_SIZE = "reef", (640, 480)


@dataclass(frozen=True, kw_only=True)
class Wait:
    """A render that is waited for, after those before it in the same caches, and how long that may take."""

    name: str
    caches: str
    rig: str
    world: str
    allowed_s: float
    options: tuple[str, ...] = ()


DRAFT = ("--light", "draft")

WAITS = (
    Wait(name="first picture, tank", caches="tank draft", rig="aqua2", world="tank", allowed_s=10, options=DRAFT),
    Wait(name="first render, tank", caches="tank", rig="aqua2", world="tank", allowed_s=25),
    Wait(name="warm render, tank", caches="tank", rig="aqua2", world="tank", allowed_s=2.5),
    Wait(name=f"mirror {WIDER_MM} mm wider, tank", caches="tank", rig=MIRROR_FILE, world="tank", allowed_s=5),
    Wait(name="another rig in the same water, tank", caches="tank", rig=SAME_WATER_FILE, world="tank", allowed_s=8),
    Wait(name="another rig in other water, tank", caches="tank", rig="bluerov2", world="tank", allowed_s=25),
    Wait(name="first picture, reef", caches="reef draft", rig="aqua2", world="reef", allowed_s=10, options=DRAFT),
    Wait(name="first render, reef", caches="reef", rig="aqua2", world="reef", allowed_s=45),
    Wait(name="warm render, reef", caches="reef", rig="aqua2", world="reef", allowed_s=2.5),
)


def run() -> list[dict[str, Any]]:
    """Processor time of each render, beside what is allowed."""
    with tempfile.TemporaryDirectory() as named:
        folder = Path(named)
        wider_rig().save(folder / MIRROR_FILE)
        same_water = Rig.load("aqua2").water.model_dump()
        Rig.load("bluerov2").with_(water=same_water).save(folder / SAME_WATER_FILE)
        renders = [_render(wait, folder) for wait in WAITS]
        frame_s = float(Caches(folder, WAITS[-1].caches).finished(["-c", STOCK], "stock").output)
    return [waited_row(wait.name, done, wait.allowed_s, frame_s) for wait, done in zip(WAITS, renders, strict=True)]


def wider_rig() -> Rig:
    """The rig of the benchmarks with another gaze mirror."""
    rig = Rig.load("aqua2")
    return rig.with_(gaze_mirror__width_mm=rig.require_gaze().gaze_mirror.width_mm + WIDER_MM)


def stock_frame_s() -> float:
    """Median processor time of a frame of stock `path`, one sample per pixel."""
    from benchmarks.render import STOCK_FRAMES, STOCK_WARM_UP, _states, _stock_path
    from cad.assembly.meshes import rig_meshes
    from scenes.stage.scene import make_scene

    rig = Rig.load("aqua2")
    scene = make_scene(rig, world=STOCK_WORLD)
    frame = _stock_path(rig, rig_meshes(rig), scene, *STOCK_SIZE)
    seconds = []
    for state in _states(scene, STOCK_WARM_UP + STOCK_FRAMES):
        start = time.process_time()
        frame(state)
        seconds.append(time.process_time() - start)
    return statistics.median(seconds[STOCK_WARM_UP:])


def _render(wait: Wait, folder: Path) -> Finished:
    command = ["-m", "mirrorgaze", "render", wait.rig, "--world", wait.world, *wait.options, "-o", "view.png"]
    return Caches(folder, wait.caches).finished(command, wait.name)


@dataclass(frozen=True)
class Caches:
    """Caches of results and of compiled kernels, by name in a folder; empty at first."""

    folder: Path
    name: str

    def finished(self, arguments: list[str], name: str) -> Finished:
        """What a process came to that has these caches; it must succeed."""
        caches = self.folder / f"{self.name} caches"
        # Dr.Jit makes its folder, not those above it.
        caches.mkdir(exist_ok=True)
        variables = {CACHE: str(caches / "results"), KERNELS: str(caches / "kernels")}
        done = finished(arguments, folder=self.folder, name=name.replace(" ", "_"), variables=variables)
        if done.status:
            raise RuntimeError(f"{name}: expected success, got status {done.status}: {done.said}")
        return done


def waited_row(name: str, done: Finished, allowed_s: float, frame_s: float) -> dict[str, Any]:
    """Row of what a user waits for, beside what is allowed and the machine's speed, a frame of stock `path`."""
    width, height = STOCK_SIZE
    spent_s = done.processor_s
    beside = (
        f"{spent_s / frame_s:.0f} frames of stock path ({STOCK_WORLD}, {width} x {height}: {1000 * frame_s:.0f} ms)"
    )
    note = f"processor time, {beside}; at most {done.memory_gb:.2f} GB; peer: what is allowed"
    return {"name": name, "ours": spent_s, "peer": allowed_s, "unit": "s", "ratio": allowed_s / spent_s, "note": note}
