"""How thick the walls of a printed part are, by rays from its surface inwards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import manifold3d
import numpy as np
import trimesh

from cad.finding import Finding
from cad.overlaps import manifold_mm
from optics.kernels.arrays import FloatArray
from optics.mesh import PartMesh
from rigs import Mount, Problem

CHECK = "wall thickness"
SAMPLES = 4000
SEED = 0
PERCENTILE = 1.0
"""Rays that start beside a sharp edge leave through the next face: the thinnest hundredth is edges, not walls."""
PERIMETERS = 2
"""A wall of one line has no inside to hold it together."""
UNDER_SURFACE_MM = 1e-4
"""Rays start this deep, so that they do not hit the face they start on."""


@dataclass(frozen=True, kw_only=True)
class WallThickness:
    """Thickness of the walls of a part.

    Attributes
    ----------
    thickness_mm : array, shape (n,)
        From each sample of the surface straight inwards to the other side, ascending.
    point_mm : array, shape (n, 3)
        The samples, in the part's frame.
    """

    thickness_mm: FloatArray
    point_mm: FloatArray

    @property
    def thinnest(self) -> tuple[float, FloatArray]:
        """First percentile and where it was found."""
        position = int(PERCENTILE / 100 * len(self.thickness_mm))
        return float(self.thickness_mm[position]), self.point_mm[position]


def wall_thickness(mesh: PartMesh, samples: int = SAMPLES, seed: int = SEED) -> WallThickness:
    """Thickness of the walls of a part with a closed surface, at points spread evenly over its area."""
    surface = trimesh.Trimesh(1000 * mesh.vertices_m, mesh.faces, process=False)
    points, faces = trimesh.sample.sample_surface(surface, samples, seed=seed)
    inwards = -surface.face_normals[faces]
    starts = points + UNDER_SURFACE_MM * inwards
    ends = starts + 2 * surface.scale * inwards
    body = manifold_mm(mesh)
    thickness = np.array([_first_hit_mm(body.ray_cast(a, b), a) for a, b in zip(starts, ends, strict=True)])
    # A ray that starts on an edge may find no other side.
    hit = np.isfinite(thickness)
    order = np.argsort(thickness[hit])
    return WallThickness(thickness_mm=thickness[hit][order] + UNDER_SURFACE_MM, point_mm=np.asarray(points)[hit][order])


def wall_finding(mesh: PartMesh, mount: Mount) -> Finding:
    """Wall thickness of a printed part against what the nozzle needs."""
    thickness, point = wall_thickness(mesh).thinnest
    limit = PERIMETERS * mount.nozzle_mm
    place = "at (" + ", ".join(f"{value:.1f}" for value in point) + f") mm of the part's {mesh.group} frame"
    problem = Problem(
        place="mount.nozzle_mm",
        value=mount.nozzle_mm,
        expected=f"at most {thickness / PERIMETERS:.2f}, half the wall of {mesh.name} of {thickness:.2f} mm {place}",
    )
    return Finding(
        check=CHECK,
        subject=mesh.name,
        figure=thickness,
        unit="mm",
        limit=limit,
        place=place,
        note=f"{PERCENTILE:g} % of its surface has less behind it",
        problem=problem if thickness < limit else None,
    )


def _first_hit_mm(hits: Sequence[manifold3d.RayHit], start: FloatArray) -> float:
    return float(np.linalg.norm(np.asarray(hits[0].position) - start)) if hits else np.inf
