"""The wrap: a closed solid that holds triangles of any kind."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from cad.hulls.mesh_repair import LeftOut
from cad.hulls.triangle_samples import lattice
from cad.hulls.wrapping.bodies import kept_bodies
from cad.hulls.wrapping.fit import fitted, nearest_places
from cad.hulls.wrapping.solid_field import OFFSET, cell_of, samples_of, solid_field
from rigs.mounting import KeptBodies

DEVIATION_PLACES = 40_000
COARSER = 1.5
"""From one grid to the next, where a wrap has too many triangles: it goes around each piece of a surface in tatters."""


@dataclass(frozen=True, kw_only=True)
class Wrap:
    """A closed surface around another one; lengths in the unit of that.

    Attributes
    ----------
    surface : Trimesh
        Closed, outward, free of crossings: one body or several.
    bodies : int
        How many.
    closed : float
        Gaps and holes narrower than this are closed.
    median, p95 : float
        Distance of the wrap from the surface, over the wrap's area.
    left_out : tuple of LeftOut
        Bodies that were left out, the longest first.
    bars : tuple of float
        Lengths of the bars that join bodies.
    """

    surface: trimesh.Trimesh
    bodies: int
    closed: float
    median: float
    p95: float
    left_out: tuple[LeftOut, ...]
    bars: tuple[float, ...]


def wrapped(surface: trimesh.Trimesh, keep: KeptBodies = "all") -> Wrap:
    """Wrap a surface: closed, free of crossings, and around all of it but what was left out.

    Parameters
    ----------
    surface : Trimesh
        Triangles of any kind: open, double, crossing each other, facing any way.
    keep : str
        Whether ``all`` bodies are kept, kept and ``joined`` by bars, or the ``largest`` alone.
    """
    vertices, faces = np.asarray(surface.vertices, dtype=np.float64), np.asarray(surface.faces, dtype=np.int64)
    cell, found = cell_of(vertices, faces), None
    while found is None:
        samples = samples_of(vertices, faces, cell)
        kept = kept_bodies(solid_field(samples, cell), keep)
        found = fitted(*kept.field.surface(), samples, cell)
        cell *= 1.0 if found else COARSER
    spacing = max((found.area / DEVIATION_PLACES) ** 0.5, 1e-9 * cell)
    places, _ = lattice(np.asarray(found.vertices), np.asarray(found.faces), spacing)
    _, away = nearest_places(samples, places[:: max(1, len(places) // DEVIATION_PLACES)])
    median, p95 = np.percentile(away, [50, 95])
    return Wrap(
        surface=found,
        bodies=int(found.body_count),
        closed=2 * OFFSET * cell,
        median=float(median),
        p95=float(p95),
        left_out=kept.left_out,
        bars=kept.bars,
    )
