"""The edges of the gaze mirror in the image: refraction bends them, where the paper draws a quadrilateral."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.mirror import PlaneMirror
from optics.status import Status
from optics.train import OpticalTrain
from rigs import Rig

EDGE_NAMES = {
    1: ("rim",),
    4: ("bottom", "right", "top", "left"),
    8: ("bottom", "lower right", "right", "upper right", "top", "upper left", "left", "lower left"),
}
"""Of M2, in its own frame, by how many there are; an ellipse has one."""

POINTS_PER_EDGE = 201
"""Odd, so that the middle, where a bent edge is farthest from its chord, is among them."""


@dataclass(frozen=True, kw_only=True)
class MirrorEdge:
    """One edge of M2 in the image, as M1 and the port show it.

    Attributes
    ----------
    name : str
        One of `EDGE_NAMES`.
    pixels : array, shape (k, 2)
        From corner to corner, evenly spaced on the mirror; NaN where there is no pixel. Points that M1's edge or the
        image's border cuts off keep the pixel at which they would appear.
    visible : array of bool, shape (k,)
        Whether the camera sees that point.
    deviation_px : float
        Largest distance of the edge from its chord, the straight line between its corners; NaN without corners, as an
        ellipse is.
    """

    name: str
    pixels: FloatArray
    visible: np.ndarray[tuple[int], np.dtype[np.bool_]]
    deviation_px: float


def mirror_edges(rig: Rig, *, q1: float = 0.0, q2: float = 0.0, count: int = POINTS_PER_EDGE) -> tuple[MirrorEdge, ...]:
    """Edges of the gaze mirror in the image, counter-clockwise from the bottom one; of an ellipse its whole rim.

    The outline of M2 is seen through the port and over M1 alone, so it is projected by the train without M2.
    """
    rig.require_gaze()
    train = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
    before = replace(train, mirrors=train.mirrors[:1])
    lines = _lines(train.mirrors[1], count)
    edges = []
    for name, points in zip(EDGE_NAMES[len(lines)], lines, strict=True):
        image = before.project(points)
        bent = _off_its_chord(image.pixels) if len(lines) > 1 else np.nan
        edges.append(MirrorEdge(name=name, pixels=image.pixels, visible=image.status == Status.OK, deviation_px=bent))
    return tuple(edges)


def _lines(mirror: PlaneMirror, count: int) -> list[FloatArray]:
    """Points of each edge from corner to corner, or of the closed rim of an ellipse, camera frame."""
    if mirror.outline is not None and not mirror.outline.has_corners:
        rim = mirror.at(mirror.outline.rim(count - 1))
        return [np.concatenate([rim, rim[:1]])]
    corners, along = mirror.corners_m, np.linspace(0, 1, count)[:, np.newaxis]
    return [start + along * (end - start) for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True)]


def _off_its_chord(pixels: FloatArray) -> float:
    chord = pixels[-1] - pixels[0]
    offset = pixels - pixels[0]
    distance = np.abs(offset[:, 0] * chord[1] - offset[:, 1] * chord[0]) / np.hypot(*chord)
    return float(distance.max())
