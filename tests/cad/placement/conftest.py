"""Hulls whose distances are known in closed form."""

from __future__ import annotations

import manifold3d
import numpy as np
import pytest
import trimesh

from cad.placement.hull_field import hull_field
from cad.placement.seats import SeatFinder

RADIUS_MM, LENGTH_MM = 100.0, 1000.0


def triangles(body: manifold3d.Manifold) -> trimesh.Trimesh:
    """Triangles of a closed body."""
    mesh = body.to_mesh64()
    return trimesh.Trimesh(np.array(mesh.vert_properties[:, :3]), np.asarray(mesh.tri_verts), process=False)


@pytest.fixture(scope="session")
def capsule() -> trimesh.Trimesh:
    """A torpedo: a cylinder along x of 200 mm, its ends half spheres, one metre in all."""
    ball = manifold3d.Manifold.sphere(RADIUS_MM, 96)
    half = LENGTH_MM / 2 - RADIUS_MM
    return triangles(manifold3d.Manifold.batch_hull([ball.translate((side * half, 0, 0)) for side in (-1, 1)]))


@pytest.fixture(scope="session")
def finder(capsule: trimesh.Trimesh) -> SeatFinder:
    """Seats on the front of the capsule."""
    body = manifold3d.Manifold(manifold3d.Mesh64(capsule.vertices, np.asarray(capsule.faces, dtype=np.uint64)))
    space = hull_field(body, np.array([0.0, -200.0, -250.0]), np.array([700.0, 200.0, 250.0]))
    return SeatFinder(solid=capsule, space=space)
