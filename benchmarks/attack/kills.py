"""Commands killed at random moments: the same command then goes on or starts again, and ends with the same bytes.

Every case is a kill. Three come one after another in the folder of a command; before the next command's first, that one
is left to finish and compared. Light and steps are coarse: a run takes seconds of processor time, not minutes.
"""

from __future__ import annotations

import hashlib
import os
import random
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.attack.verdicts import LostError

NAME = "kills"
GOAL = 200
HANG_S = 1800.0

KILLS = 3
"""One after another, before a command is left to finish."""

LATEST = 0.9
"""Share of a command's time within which it is killed."""

ROOT = Path(__file__).parents[2]
# A design's report has no option for its light, and a case shall take seconds.
COARSE = """
from scenes.baking.light_quality import LightQuality
LightQuality.full = LightQuality.coarse
from mirrorgaze.cli import main
main()
"""
DIVE = """name = "tiny"
rig = "aqua2"
world = "tank"
depth_m = 2.0
duration_s = 3.0
[robot]
motion = "hover"
[target.path]
shape = "straight"
start_m = [2.0, 0.5, 0.0]
velocity_m_per_s = [0.0, 0.0, 0.0]
"""
COMMANDS = {
    "calibrate": "calibrate aqua2 observations.csv -o out/calibration.toml",
    "dive": "dive tiny.toml --light draft -o out",
    "search": "search aqua2 --designs 40 --rigs 1 --objective coverage,area -o out",
    "coverage": "coverage aqua2 --step-deg 30 -o out",
    "export": "export aqua2 -o out",
    "design": "design aqua2 --dive tiny.toml --only coverage --only mount --only tolerance --only dive -o out",
}
"""What is killed; each writes into `out` of its folder."""


@dataclass
class Attacked:
    """A command, what it comes to when nothing happens to it, and its folder while it is attacked."""

    name: str
    folder: Path
    takes_s: float = 0.0
    expected: dict[str, str] = field(default_factory=dict)

    def begin(self) -> subprocess.Popen[bytes]:
        """Start the command in its folder."""
        command = COMMANDS[self.name]
        run = ("-c", COARSE) if self.name == "design" else ("-m", "mirrorgaze")
        with (self.folder / "said").open("wb") as said:
            return subprocess.Popen(
                [sys.executable, *run, *command.split()],
                cwd=self.folder,
                env={**os.environ, "PYTHONPATH": str(ROOT), "SOURCE_DATE_EPOCH": "1767225600"},
                stdout=said,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def finish(self) -> dict[str, str]:
        """Let the command run to its end; digests of what it wrote."""
        status = self.begin().wait()
        if status:
            said = (self.folder / "said").read_text(encoding="utf-8", errors="replace")
            raise LostError(f"{self.name} after a kill: status {status}: {said[-2000:]}")
        out = self.folder / "out"
        files = sorted(path for path in out.rglob("*") if path.is_file())
        return {str(path.relative_to(out)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def prepare(folder: Path) -> Callable[[random.Random], None]:
    """What the cases share: each command's result when it is left alone."""
    write_observations(folder / "observations.csv")
    attacked: dict[str, Attacked] = {}
    names = list(COMMANDS)
    kills = 0

    def case(rng: random.Random) -> None:
        nonlocal kills
        name = names[kills // KILLS % len(names)]
        if kills % KILLS == 0:
            attacked[name] = _begun(folder, name, attacked.get(name))
        kills += 1
        at_work = attacked[name]
        _kill(at_work, rng.uniform(0, LATEST) * at_work.takes_s)
        if kills % KILLS == 0:
            found = at_work.finish()
            if found != at_work.expected:
                differ = {file for file, _ in found.items() ^ at_work.expected.items()}
                raise LostError(f"{name} after {KILLS} kills: other bytes in {sorted(differ)}")

    return case


def _begun(folder: Path, name: str, before: Attacked | None) -> Attacked:
    """A command in a new folder; the first time it is also left alone, to know what it comes to."""
    if before is None:
        before = Attacked(name, _new_folder(folder))
        before.finish()  # what is kept for the next time is kept now
        before = Attacked(name, _new_folder(folder))
        start = time.monotonic()
        before.expected = before.finish()
        before.takes_s = time.monotonic() - start
    return Attacked(name, _new_folder(folder), takes_s=before.takes_s, expected=before.expected)


def _new_folder(folder: Path) -> Path:
    made = folder / f"{len(list(folder.iterdir()))}"
    made.mkdir()
    (made / "out").mkdir()
    (made / "tiny.toml").write_text(DIVE, encoding="utf-8")
    (made / "observations.csv").write_bytes((folder / "observations.csv").read_bytes())
    return made


def _kill(attacked: Attacked, after_s: float) -> None:
    process = attacked.begin()
    try:
        process.wait(timeout=after_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def write_observations(file: Path) -> None:
    """Points of boards in a tank, as a rig that was built with errors would see them."""
    from dives.calibration.simulation import simulated_target, useful_poses
    from rigs import Rig
    from tracking.calibration.observation_files import write_observations as write
    from tracking.calibration.prior import PRINT_TOLERANCES, draw_perturbations

    rig = Rig.load("aqua2")
    built = draw_perturbations(rig, PRINT_TOLERANCES, seed=1)
    write(file, simulated_target(rig, built, useful_poses(rig, 8), known=True, direct=False, noise_px=0.3, seed=1))
