"""The hull of a rig as a closed surface, whether or not a mount can be made for it."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from cad.assembly.meshes import MESH_VERSION
from optics.kernels.cache import load_or_make, result_key
from optics.layout import Layout
from rigs import FileHull, Rig


def hull_surface(rig: Rig) -> trimesh.Trimesh:
    """Closed surface of a rig's hull in the body frame, millimetres; from the cache when it can be.

    It is the hull that the mount is made for. Nothing else of the rig need be in order.

    Raises
    ------
    ValueError
        For a rig without mirrors, whose file says nothing of a hull, or one whose hull cannot be made.
    """
    gaze = rig.require_gaze()
    if isinstance(gaze.hull, FileHull):
        from cad.hulls.hull import closed_surface, file_hull_solid  # noqa: PLC0415  (takes seconds to import)

        return closed_surface(file_hull_solid(gaze.hull))
    sections = (gaze.hull, gaze.mount, gaze.fold_mirror, gaze.gaze_mirror, rig.port, rig.camera)
    numbers = [section.model_dump(mode="json") for section in sections]
    key = result_key("hull surface", MESH_VERSION, numbers, version("build123d"))
    return load_or_make("hull surface", key, lambda: _made(rig), pack=_packed, unpack=_unpacked)


def _made(rig: Rig) -> trimesh.Trimesh:
    from cad.assembly.tessellation import HULL_LINEAR_TOLERANCE_MM, tessellated  # noqa: PLC0415  (takes seconds)
    from cad.hulls.hull import hull_shape  # noqa: PLC0415

    gaze = rig.require_gaze()
    shape = hull_shape(gaze.hull, gaze.mount, rig.port, Layout.from_rig(rig))
    return shape if isinstance(shape, trimesh.Trimesh) else tessellated(shape, HULL_LINEAR_TOLERANCE_MM)


def _packed(surface: trimesh.Trimesh) -> dict[str, NDArray[Any]]:
    return {"vertices": np.asarray(surface.vertices), "faces": np.asarray(surface.faces, dtype=np.int32)}


def _unpacked(stored: Mapping[str, NDArray[Any]]) -> trimesh.Trimesh:
    return trimesh.Trimesh(stored["vertices"], stored["faces"], process=False)
