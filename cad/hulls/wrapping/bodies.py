"""The bodies that a solid field falls into: which are kept, and bars that join them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import KDTree

from cad.hulls.mesh_repair import LeftOut, largest_first
from cad.hulls.wrapping.solid_field import OFFSET, SolidField
from optics.kernels.arrays import FloatArray
from rigs.mounting import KeptBodies

SMALL = 0.02
"""A body whose longest side is less than this share of the whole one's is left out."""
BAR_RADIUS = 2.0
"""Of a bar that joins two bodies, in cells: it must be seen by the grid."""


@dataclass(frozen=True, kw_only=True)
class Kept:
    """What is kept of a solid field.

    Attributes
    ----------
    field : SolidField
    left_out : tuple of LeftOut
        The longest first.
    bars : tuple of float
        Lengths of the bars that were put between bodies.
    """

    field: SolidField
    left_out: tuple[LeftOut, ...] = ()
    bars: tuple[float, ...] = ()


def kept_bodies(field: SolidField, keep: KeptBodies) -> Kept:
    """Leave out small bodies, and of the others keep all, keep all and join them, or keep the largest one."""
    labels, count = ndimage.label(field.values < 0)
    boxes = ndimage.find_objects(labels)
    # Nodes that the surface winds around without being near are not grown by the offset.
    sides = np.array([max(max(s.stop - s.start for s in box) - 2 * OFFSET, 1.0) for box in boxes]) * field.cell
    volumes = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    wanted = sides >= SMALL * sides.max()
    if keep == "largest":
        wanted = np.arange(count) == volumes.argmax()
    if not wanted.all():
        gone = np.concatenate([[False], ~wanted])[labels]
        field = replace(field, values=np.where(gone, np.abs(field.values), field.values))
    ends = np.array([[[side.start, side.stop - 1] for side in box] for box in boxes])
    left_out = largest_first(sides[~wanted], field.nodes(ends.mean(axis=2))[~wanted])
    numbers = np.flatnonzero(wanted) + 1
    if keep != "joined" or len(numbers) == 1:
        return Kept(field=field, left_out=left_out)
    skins = [field.nodes(np.argwhere(_skin(labels, int(number), boxes[number - 1]))) for number in numbers]
    bars = _nearest_pairs(skins)
    for start, end in bars:
        field = _with_bar(field, start, end)
    lengths = tuple(float(np.linalg.norm(end - start)) for start, end in bars)
    return Kept(field=field, left_out=left_out, bars=lengths)


def _skin(labels: NDArray[np.int32], number: int, box: tuple[slice, ...]) -> NDArray[np.bool_]:
    """Outermost nodes of a body, on the whole grid."""
    body = labels[box] == number
    found = np.zeros(labels.shape, dtype=bool)
    found[box] = body & ~ndimage.binary_erosion(body)
    return found


def _nearest_pairs(skins: Sequence[FloatArray]) -> list[tuple[FloatArray, FloatArray]]:
    """Shortest bars that join bodies one after the other to the first, by their outermost nodes (Prim's tree)."""
    joined, rest, bars = skins[0], list(range(1, len(skins))), []
    while rest:
        tree = KDTree(joined)
        found = [tree.query(skins[body]) for body in rest]
        nearest = int(np.argmin([distance.min() for distance, _ in found]))
        distance, partner = found[nearest]
        place = int(distance.argmin())
        body = rest.pop(nearest)
        bars.append((joined[partner[place]], skins[body][place]))
        joined = np.concatenate([joined, skins[body]])
    return bars


def _with_bar(field: SolidField, start: FloatArray, end: FloatArray) -> SolidField:
    """Add a bar with round ends between two places."""
    reach = (BAR_RADIUS + 1) * field.cell
    low = np.floor((np.minimum(start, end) - reach - field.low) / field.cell).astype(int).clip(0)
    high = np.ceil((np.maximum(start, end) + reach - field.low) / field.cell).astype(int) + 1
    window = tuple(slice(first, last) for first, last in zip(low, high, strict=True))
    values = field.values.copy()
    places = field.nodes(np.moveaxis(np.indices(values[window].shape), 0, -1) + low)
    way = end - start
    along = np.clip((places - start) @ way / max(float(way @ way), np.finfo(float).tiny), 0, 1)
    away = np.linalg.norm(places - start - along[..., np.newaxis] * way, axis=-1) / field.cell - BAR_RADIUS
    away = np.where(np.abs(away) < 1e-3, 1e-3, away)
    values[window] = np.minimum(values[window], away)
    return replace(field, values=values)
