"""`./run bench bias`: whole images by the fast renderer and by the reference, as in docs/explanation/rendering.md.

A row takes 9 to 15 minutes of processor time at 1024 paths a pixel, one or two at 128, all of them 80.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from mirrorgaze.output import print_progress
from rigs import Rig
from scenes.light.waves import Wind
from scenes.reference.agreement import Agreement
from scenes.reference.compare import Comparison, compare
from scenes.reference.render import Progress
from scenes.stage.scene import make_scene

RIG = "aqua2"
Q1_DEG, Q2_DEG = 30.0, -10.0
WIDTH_PX, HEIGHT_PX = 160, 120
WORLDS = ("tank", "blue")
WATERS = ("IB", "III", "1C")
SAMPLES = {"sun": 1024, "overcast": 128}
"""Paths a pixel: the sun's peak makes them rare and bright, an overcast sky is known as well with an eighth."""

TOLERANCE_PERCENT = 3.0
STANDARD_ERRORS = 2.0
"""How far beyond the tolerance a bias has to be by its own error, for the row to fail: few paths leave much noise."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """One image of the table: `tank-IB-sun` is type IB in the tank, under the sun."""

    world: str
    water: str
    sky: str

    @property
    def name(self) -> str:
        """As the command line has it."""
        return f"{self.world}-{self.water}-{self.sky}"


ROWS = {row.name: row for row in (Row(world=a, water=b, sky=c) for c, a, b in product(SAMPLES, WORLDS, WATERS))}


def main(arguments: Sequence[str]) -> int:
    """Compare the rows asked for; 1 when the whole image of one is off by more than the tolerance."""
    options = _parser().parse_args(arguments)
    rows = [ROWS[name] for name in options.rows]
    samples = [options.samples or SAMPLES[row.sky] for row in rows]
    remaining = _Remaining(samples)
    options.output.mkdir(parents=True, exist_ok=True)
    print(f"bias of the fast renderer beside volpathmis, % of the mean radiance: {RIG}, {WIDTH_PX} x {HEIGHT_PX}")
    print("| | paths | pixels | red | green | blue |\n|---|---|---|---|---|---|", flush=True)
    failed = []
    for row, count in zip(rows, samples, strict=True):
        path = options.output / f"{row.name}.png"
        found = _compared(row, path, samples=count, seed=options.seed, progress=remaining.of_row(row.name))
        whole, *parts = found.agreements
        _print_line(row.name, count, whole)
        for part in parts if options.parts else ():
            _print_line(f"{row.name}, {part.name}", count, part)
        if _beyond(whole):
            failed.append(row.name)
    if failed:
        print(f"FAILED: expected whole images within {TOLERANCE_PERCENT:g} %, got more for {', '.join(failed)}")
    else:
        print(f"all are within {TOLERANCE_PERCENT:g} %, or beyond it by less than {STANDARD_ERRORS:g} standard errors")
    return 1 if failed else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="./run bench bias", description=__doc__)
    parser.add_argument(
        "--rows", nargs="+", choices=ROWS, default=list(ROWS), metavar="ROW", help=f"{', '.join(ROWS)}; all by default"
    )
    parser.add_argument(
        "--samples", type=int, metavar="N", help="paths a pixel; 1024 under the sun and 128 overcast by default"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="random seed of the reference")
    parser.add_argument("--parts", action="store_true", help="print regions and what is seen there as well")
    parser.add_argument(
        "-o", "--output", type=Path, default=Path("out/bias"), metavar="FOLDER", help="for images side by side"
    )
    return parser


def _compared(row: Row, path: Path, *, samples: int, seed: int, progress: Progress) -> Comparison:
    rig = Rig.load(RIG)
    cloud = 1.0 if row.sky == "overcast" else 0.0
    scene = make_scene(rig, world=row.world, jerlov_type=row.water, cloud=cloud, wind=Wind(speed_m_per_s=0.0))
    return compare(
        rig,
        scene,
        q1_deg=Q1_DEG,
        q2_deg=Q2_DEG,
        path=path,
        width_px=WIDTH_PX,
        height_px=HEIGHT_PX,
        samples=samples,
        seed=seed,
        progress=progress,
    )


def _print_line(name: str, samples: int, agreement: Agreement) -> None:
    pairs = zip(agreement.bias, agreement.standard_error, strict=True)
    cells = (f"{100 * bias:+.1f} ± {100 * error:.1f}" for bias, error in pairs)
    print(f"| {' | '.join([name, str(samples), str(agreement.pixels), *cells])} |", flush=True)


def _beyond(agreement: Agreement) -> bool:
    """Whether a channel is off by more than the tolerance and what the reference's noise can explain."""
    excess = np.abs(agreement.bias) - TOLERANCE_PERCENT / 100
    # What is no number is beyond it, too.
    return not (excess <= STANDARD_ERRORS * np.array(agreement.standard_error)).all()


class _Remaining:
    """Prints how far each row is, and how long all that are left still take at the pace of those before."""

    def __init__(self, samples: Sequence[int]):
        self._rows = iter(samples)
        self._total = sum(samples)
        self._before = self._current = 0
        self._start_s = time.perf_counter()

    def of_row(self, name: str) -> Callable[[int, int], None]:
        """Progress of the next row."""
        self._before, self._current = self._before + self._current, next(self._rows)

        def show(done: int, total: int) -> None:
            share = (self._before + self._current * done / total) / self._total
            left_s = (time.perf_counter() - self._start_s) * (1 - share) / share
            print_progress(f"{name} ({left_s / 60:.0f} min left for all rows)", done, total)

        return show
