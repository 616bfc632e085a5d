"""`./run bench healpix`: the cells of `optics.coverage.sphere` against healpy, at every nside that there is."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import healpy
import numpy as np

from optics.coverage.sphere import LARGEST_NSIDE, cell_directions, cells_of
from optics.kernels.arrays import FloatArray

DIRECTIONS = 2_000_000
SEED = 0
CENTRE_TOLERANCE = 1e-14
"""Between unit vectors to the centres of cells: a few roundings."""


def main(arguments: Sequence[str]) -> int:
    """Compare cell numbers of random directions, and the centres of all cells; 1 when they differ."""
    parser = argparse.ArgumentParser(prog="./run bench healpix", description=__doc__)
    parser.add_argument("--directions", type=int, default=DIRECTIONS, metavar="N", help="random directions per nside")
    options = parser.parse_args(arguments)
    directions = np.random.default_rng(SEED).normal(size=(options.directions, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    print(f"cells of {options.directions} directions and centres of all cells, ours and healpy {healpy.__version__}")
    agree = True
    for nside in 2 ** np.arange(int(np.log2(LARGEST_NSIDE)) + 1):
        differ, centres = _differences(int(nside), directions)
        print(f"nside {nside:4}: {differ} directions in another cell, centres at most {centres:.1e} apart", flush=True)
        agree &= differ == 0 and centres <= CENTRE_TOLERANCE
    print("they agree" if agree else f"FAILED: expected no other cell, and centres within {CENTRE_TOLERANCE:g}")
    return 0 if agree else 1


def _differences(nside: int, directions: FloatArray) -> tuple[int, float]:
    """Number of directions that lie in another cell; largest difference of a centre's coordinates."""
    cells = healpy.vec2pix(nside, *directions.T)
    centres = np.stack(healpy.pix2vec(nside, np.arange(healpy.nside2npix(nside))), axis=1)
    return (
        int(np.count_nonzero(cells_of(directions, nside) != cells)),
        float(np.abs(cell_directions(nside) - centres).max()),
    )
