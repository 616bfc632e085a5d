"""COLLADA, which carries its unit and its up axis; pycollada reads it."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cad.hulls.files.found import FoundHull, Piece, found_hull, reading

UP = {"X_UP": "+x", "Y_UP": "+y", "Z_UP": "+z"}


def read_collada(file: Path) -> FoundHull:
    """Triangles of a COLLADA file; its numbers are metres when it does not say, by its standard.

    Raises
    ------
    ValueError
        When it cannot be read or has none.
    """
    import collada  # noqa: PLC0415  (the only format that needs it)

    with reading("COLLADA"):
        # Materials and pictures that are not there do not matter to a shape.
        with warnings.catch_warnings():
            # pycollada still multiplies with matrices of numpy's old kind.
            warnings.simplefilter("ignore", PendingDeprecationWarning)
            document = collada.Collada(str(file), ignore=[collada.common.DaeError])
            pieces = list(_pieces(document))
        asset = document.assetInfo
        unit_mm = 1000 * float(asset.unitmeter or 1.0)
    return found_hull(file, pieces, unit_mm=unit_mm, up=UP.get(asset.upaxis))


def _pieces(document: Any) -> Iterator[Piece]:
    placed = [each for node in getattr(document.scene, "nodes", ()) for each in _placed(node)]
    # Without a scene, or where bones place the shapes, they are taken where they were drawn.
    for name, bound in placed or [
        (each.name or each.id or "", each.bind(np.eye(4), {})) for each in document.geometries
    ]:
        for primitive in bound.primitives():
            triangles = primitive.triangleset() if hasattr(primitive, "triangleset") else primitive
            if hasattr(triangles, "vertex_index") and np.ndim(triangles.vertex_index) == 2:
                faces = np.asarray(triangles.vertex_index, dtype=np.int64)
                # Lines have two corners each.
                if faces.shape[1] == 3:
                    yield Piece(name=name, vertices=np.asarray(triangles.vertex, dtype=np.float64), faces=faces)


def _placed(node: Any, pose: NDArray[np.float64] | None = None, name: str = "") -> Iterator[tuple[str, Any]]:
    """Geometries below a node of the scene, each with the name of the nearest node that has one."""
    if not hasattr(node, "children"):
        for bound in node.objects("geometry", pose):
            yield name or bound.original.name or bound.original.id or "", bound
        return
    below = node.matrix if pose is None else pose @ node.matrix
    for child in node.children:
        yield from _placed(child, below, node.name or name)
