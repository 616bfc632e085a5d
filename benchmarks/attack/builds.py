"""Mounts built one after the other in one process, each of another size: its memory must not grow with them."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path

from benchmarks.attack.verdicts import LostError

NAME = "builds"
GOAL = 30

SETTLED = 10
"""Mounts after which all that stays is loaded."""
MOST_KB = 30_000
"""That memory may have grown by since: a megabyte and a half for each of the twenty that follow."""
NARROWER_MM = 20.0


def prepare(folder: Path) -> Callable[[random.Random], None]:
    """What the cases share: the presets, and how much memory was in use when it had settled."""
    from cad.assembly.assembly import build_assembly
    from rigs import Rig
    from rigs.files import preset_names

    presets = [rig for rig in map(Rig.load, preset_names()) if rig.gaze is not None]
    for rig in presets:
        build_assembly(rig)
    used_kb: list[int] = []

    def case(rng: random.Random) -> None:
        rig = presets[len(used_kb) % len(presets)]
        width_mm = rig.require_gaze().gaze_mirror.width_mm - rng.uniform(0, NARROWER_MM)
        build_assembly(rig.with_(gaze_mirror__width_mm=width_mm))
        used_kb.append(_used_kb())
        if len(used_kb) > SETTLED and used_kb[-1] > used_kb[SETTLED - 1] + MOST_KB:
            raise LostError(f"mount {len(used_kb)}: {used_kb[-1] - used_kb[SETTLED - 1]} kB more than {SETTLED} took")

    return case


def _used_kb() -> int:
    """Memory of this process; the most that it ever had would hide what a test before it needed."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return int(next(line for line in lines if line.startswith("VmRSS:")).split()[1])
