"""Surfaces with names and colours for glTF viewers."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import NDArray

GLB_FROM_BODY = np.array([[0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""glTF is y up and looks along -z: x right is the body's -y, y up is z, and -z is forward."""


def add_surface(
    scene: trimesh.Scene,
    surface: trimesh.Trimesh,
    body_from_surface: NDArray[np.float64],
    *,
    name: str,
    material: str,
    colour: tuple[int, int, int],
    opacity: float = 1.0,
) -> None:
    """Add a surface in metres to a scene whose frame is that of glTF.

    Parameters
    ----------
    scene : Scene
    surface : Trimesh
        Left as it is.
    body_from_surface : array, shape (4, 4)
    name : str
        Of its node.
    material : str
        Name of its material.
    colour : tuple of three int
        sRGB, 0 to 255.
    opacity : float
    """
    surface = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    # Flat faces meet at sharp edges: shared normals would make them look inflated.
    surface.unmerge_vertices()
    surface.visual = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.PBRMaterial(
            name=material,
            baseColorFactor=(*colour, round(255 * opacity)),
            alphaMode="OPAQUE" if opacity == 1 else "BLEND",
            metallicFactor=0.0,
            roughnessFactor=0.6,
        )
    )
    scene.add_geometry(surface, node_name=name, geom_name=name, transform=GLB_FROM_BODY @ body_from_surface)
