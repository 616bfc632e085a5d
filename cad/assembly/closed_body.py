"""Parts as bodies that can be cut, moved and intersected."""

from __future__ import annotations

import manifold3d
import numpy as np

from optics.mesh import PartMesh


def closed_body(mesh: PartMesh) -> manifold3d.Manifold:
    """Part as a body that can be cut and intersected, metres; raises `ValueError` when its surface is not closed."""
    # Copies: manifold3d takes no arrays that are read-only.
    vertices, faces = np.array(mesh.vertices_m, dtype=np.float64), np.array(mesh.faces, dtype=np.uint64)
    body = manifold3d.Manifold(manifold3d.Mesh64(vertices, faces))
    if body.is_empty():
        raise ValueError(f"{mesh.name}: expected a closed surface")
    return body
