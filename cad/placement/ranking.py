"""Candidates of both fold directions, the cheapest first; where a seat is refused, others are looked for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import manifold3d
import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from cad.hulls.camera_housing import port_ahead_mm
from cad.placement.camera_sites import camera_sites, pinned_site
from cad.placement.candidates import (
    BASE_REACH_MM,
    FOLD_REACH_MM,
    Candidate,
    Prospect,
    Shortfalls,
    mirror_shapes,
    prospects,
    seated,
)
from cad.placement.fold_frame import (
    CAMERA,
    DIRECTION,
    facing,
    looking_ahead,
    pinned_seats,
    turn_of,
    turned,
    with_pinned,
)
from cad.placement.hull_field import HullField, hull_field
from cad.placement.mirror_table import D1_MM, D2_MM, mirror_table
from cad.placement.seats import SeatFinder
from cad.placement.wanted import Wanted
from optics.kernels.arrays import FloatArray
from rigs import Rig

SIDES_MM = 330.0
"""How far beside the camera's plane the hull is looked at."""
ASLANT_DEG = 1.0
"""A view further than this from the hull's plane of symmetry does not lie in it."""
FOREMOST_MM = 1.0
"""What of a hull is this near to its foremost point in the view is foremost too, as the whole of a flat side."""
UPWARDS_MM = 30.0
"""What a fold up costs, in millimetres of arm: a vehicle is lifted, and stands in the air, by its top."""


@dataclass(frozen=True, kw_only=True)
class _Search:
    """What one fold direction has to offer before seats are looked for, and who looks for them."""

    prospects: list[Prospect]
    finder: SeatFinder


class Ranking:
    """Candidates of a hull, each with its fold direction, the cheapest first.

    It goes on with what is left: a seat that is refused meanwhile is given out no more, and its candidates come again
    with the next best one.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    hull : Trimesh
        Closed surface of its hull, body frame, millimetres.
    wanted : Wanted
    short : Shortfalls
        What turned candidates away is added to it.
    """

    def __init__(self, rig: Rig, hull: trimesh.Trimesh, wanted: Wanted, short: Shortfalls) -> None:
        directions = [rig.require_gaze().fold_mirror.direction] if DIRECTION in wanted.pinned else ["down", "up"]
        self._short = short
        self._searches: dict[str, _Search] = {}
        self._found: dict[str, list[Candidate]] = {}
        for direction in directions:
            search = _search(rig, hull, direction, wanted, short)
            if search is not None:
                self._searches[direction] = search
                self._found[direction] = list(seated(search.prospects, search.finder, short))

    @property
    def found(self) -> list[tuple[str, Candidate]]:
        """All candidates with the seats that they have now."""
        pairs = [(direction, candidate) for direction in self._found for candidate in self._found[direction]]
        return sorted(pairs, key=lambda pair: round(pair[1].cost_mm + (UPWARDS_MM if pair[0] == "up" else 0.0), 3))

    def __iter__(self) -> Iterator[tuple[str, Candidate]]:
        given: set[tuple[object, ...]] = set()
        while left := [pair for pair in self.found if _identity(*pair) not in given]:
            given.add(_identity(*left[0]))
            yield left[0]

    def refuse(self, direction: str, point_mm: tuple[float, float, float], why: str, within_mm: float = 0.0) -> None:
        """Give out no more seats of a fold direction near a point of its fold frame, for a reason."""
        search = self._searches[direction]
        search.finder.refuse(point_mm, why, within_mm)
        # What turned the others away has been counted already.
        self._found[direction] = list(seated(search.prospects, search.finder, Shortfalls()))


def _identity(direction: str, candidate: Candidate) -> tuple[object, ...]:
    site, design = candidate.site.pinhole_mm, tuple(candidate.shape.design.tolist())
    return direction, site, design, candidate.fold.point_mm, candidate.base.point_mm


def _search(rig: Rig, hull: trimesh.Trimesh, direction: str, wanted: Wanted, short: Shortfalls) -> _Search | None:
    fold_from_body, folding = turn_of(rig, direction).inv(), facing(looking_ahead(rig), direction)
    table = mirror_table(folding, wanted.request)
    for condition, missing in table.rejected.items():
        short.note(condition, missing)
    designs = with_pinned(rig, table.designs, wanted.pinned)
    if not len(designs):
        return None
    shapes = mirror_shapes(folding, designs)
    vertices = fold_from_body.apply(np.asarray(hull.vertices))
    in_fold = trimesh.Trimesh(vertices, hull.faces, process=False)
    position = turned(rig.camera.position_mm, fold_from_body)
    y = position[1] if CAMERA in wanted.pinned else _plane_mm(vertices, fold_from_body)
    port = position[0] + port_ahead_mm(rig) if CAMERA in wanted.pinned else np.inf
    space = _space(in_fold, y, port)
    finder = SeatFinder(
        solid=in_fold,
        space=space,
        pinned=pinned_seats(rig, wanted.pinned, fold_from_body),
        lean_deg=float(np.degrees(np.arccos(min(abs(fold_from_body.apply([0.0, 0.0, 1.0])[2]), 1.0)))),
    )
    sites = [pinned_site(rig, position)] if CAMERA in wanted.pinned else camera_sites(rig, space, y)
    if not sites:
        short.note("a nose in the plane of symmetry for the camera's port")
    return _Search(prospects=[each for site in sites for each in prospects(site, shapes, space, short)], finder=finder)


def _plane_mm(vertices: FloatArray, fold_from_body: Rotation) -> float:
    """Plane of one y in which the camera goes: of symmetry, or where a hull is foremost that is looked at aslant.

    That of symmetry is y = 0 where the hull's box is about that.
    """
    if abs(fold_from_body.apply([0.0, 1.0, 0.0])[1]) < np.cos(np.radians(ASLANT_DEG)):
        foremost = vertices[:, 0] > vertices[:, 0].max() - FOREMOST_MM
        return round(float(vertices[foremost, 1].mean()), 1)
    low, high = vertices[:, 1].min(), vertices[:, 1].max()
    middle = float(low + high) / 2
    return 0.0 if abs(middle) < 0.02 * (high - low) else round(middle, 1)


def _space(hull: trimesh.Trimesh, y_mm: float, port_mm: float) -> HullField:
    """Distances around the front of a hull, as far as arms and mirrors reach.

    The camera is in the plane of `y_mm`, its port at `port_mm` along x, or wherever the hull ends.
    """
    vertices = np.asarray(hull.vertices)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    reach = max(FOLD_REACH_MM, BASE_REACH_MM)
    ahead = float(D1_MM.max()) + SIDES_MM / 2
    rear = max(low[0] - 50, min(high[0], port_mm) - reach - 50)
    return hull_field(
        manifold_of(hull),
        np.array([rear, max(low[1] - 50, y_mm - SIDES_MM), low[2] - D2_MM.max() / 2]),
        np.array([high[0] + ahead, min(high[1] + 50, y_mm + SIDES_MM), high[2] + 80]),
    )


def manifold_of(surface: trimesh.Trimesh) -> manifold3d.Manifold:
    """A closed surface as a body of manifold3d."""
    return manifold3d.Manifold(
        manifold3d.Mesh64(
            np.ascontiguousarray(surface.vertices, dtype=np.float64),
            np.ascontiguousarray(surface.faces, dtype=np.uint64),
        )
    )
