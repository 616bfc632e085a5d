"""Parts as a few convex pieces, as simulators want them for collisions.

One hull around a yoke would enclose the mirror that turns in it. A part is therefore cut in two, along the axis-aligned
plane that saves most volume, and the pieces again, until their hulls hold little that is not the part.
"""

from __future__ import annotations

import manifold3d
import numpy as np
import trimesh

from cad.assembly.closed_body import closed_body
from optics.mesh import PartMesh

MOST_PIECES = 12
ENOUGH_FRACTION = 0.05
"""Of the part's volume: cuts that save less than this are not worth a piece."""
CUTS_PER_AXIS = 9


def convex_pieces(mesh: PartMesh) -> list[trimesh.Trimesh]:
    """Convex polyhedra, metres, that together hold a part; in the frame of its group.

    Raises
    ------
    ValueError
        When the part's surface is not closed.
    """
    body = closed_body(mesh)
    least = ENOUGH_FRACTION * body.volume()
    pieces = [body]
    finished: list[manifold3d.Manifold] = []
    while pieces and len(pieces) + len(finished) < MOST_PIECES:
        # The piece whose hull holds most water first.
        pieces.sort(key=lambda piece: piece.hull().volume() - piece.volume())
        worst = pieces.pop()
        halves = _best_cut(worst, least)
        if halves:
            pieces += halves
        else:
            finished.append(worst)
    return [_surface(piece.hull()) for piece in [*finished, *pieces]]


def _best_cut(body: manifold3d.Manifold, least: float) -> list[manifold3d.Manifold]:
    """Halves whose hulls have least volume; none when they save less than `least` (m³)."""
    whole = body.hull().volume()
    if whole - body.volume() < least:
        return []
    low, high = np.split(np.array(body.bounding_box()), 2)
    best: tuple[float, list[manifold3d.Manifold]] = (whole - least, [])
    for axis in np.eye(3):
        for share in np.linspace(0, 1, CUTS_PER_AXIS + 2)[1:-1]:
            offset = float(axis @ (low + share * (high - low)))
            halves = [half for half in body.split_by_plane(tuple(axis), offset) if not half.is_empty()]
            volume = sum(half.hull().volume() for half in halves)
            if volume < best[0]:
                best = (volume, halves)
    return best[1]


def _surface(body: manifold3d.Manifold) -> trimesh.Trimesh:
    mesh = body.to_mesh64()
    return trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False)
