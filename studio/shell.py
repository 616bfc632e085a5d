"""The covered sphere as a coloured shell: by dwell where it is seen, by what is in the way where it is not."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from optics.coverage.blind import OUT_OF_REACH, blind_causes
from optics.coverage.coverage import Coverage
from optics.coverage.outcome import BLOCKERS
from optics.coverage.sphere import cell_directions
from optics.kernels.arrays import FloatArray
from reports.figures.sphere import CAUSE_COLOURS, CAUSE_NAMES
from studio.results import Shell

DWELL_COLOURS = ((200, 230, 226), (42, 157, 143), (14, 78, 84))
"""From a direction that few poses see to one that many see."""
LEAST_DWELL = 1e-3
"""Share of the poses at the light end of the scale, which is logarithmic."""


def shell_of(coverage: Coverage) -> Shell:
    """Shell of a coverage."""
    vertices, faces = sphere(coverage.nside)
    causes = blind_causes(coverage)
    colours = dwell_colours(coverage.poses_seeing / coverage.solid_angle_sr.size)
    blind = []
    for cause in (OUT_OF_REACH, *(int(outcome) for outcome in BLOCKERS)):
        cells, colour = causes == cause, _rgb(CAUSE_COLOURS[cause])
        colours[cells] = colour
        if cells.any():
            blind.append((CAUSE_NAMES[cause], colour, float(cells.mean())))
    return Shell(vertices=vertices, faces=faces, colours=colours, blind=tuple(sorted(blind, key=lambda each: -each[2])))


def dwell_colours(dwell: FloatArray) -> NDArray[np.uint8]:
    """Colours (n, 3) of shares of the poses that see a direction."""
    share = np.log(np.maximum(dwell, LEAST_DWELL) / LEAST_DWELL) / -np.log(LEAST_DWELL)
    stops = np.linspace(0, 1, len(DWELL_COLOURS))
    channels = [np.interp(share, stops, channel) for channel in np.transpose(DWELL_COLOURS)]
    return np.round(np.stack(channels, axis=-1)).astype(np.uint8)


@cache
def sphere(nside: int) -> tuple[FloatArray, NDArray[np.int32]]:
    """Centres of all cells and triangles between them, which turn their faces inwards: the near half is not drawn."""
    centres = cell_directions(nside)
    faces = ConvexHull(centres).simplices
    a, b, c = centres[faces].transpose(1, 0, 2)
    outwards = (np.cross(b - a, c - a) * a).sum(axis=1) > 0
    faces[outwards] = faces[outwards, ::-1]
    return centres, faces.astype(np.int32)


def _rgb(colour: str) -> tuple[int, int, int]:
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return red, green, blue
