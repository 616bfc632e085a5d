"""Whether light reaches M1 through the hull from a file, which is closed or has a window."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cad.assembly.hull_surface import seen_file_hull
from cad.hulls.window import WINDOW_REACH_MM
from optics.kernels.arrays import FloatArray, to_columns
from optics.kernels.backend import Array3f64, Bool, Float64
from optics.layout import Layout
from optics.occlusion import Occluder, first_hit
from optics.train import OpticalTrain, pixel_grid
from rigs import FileHull, Problem, Rig

COLUMNS, ROWS = 64, 48
"""Rays of the image that are followed from pinhole to M1."""

SKIN_M = 1e-4
"""Rays begin this far in front of the port: what touches its face is not in their way."""


def window_problems(rig: Rig, hull: FileHull) -> Iterator[Problem]:
    """Skin of a rig's hull in the light's way, from the pinhole through the port to M1.

    Raises
    ------
    ValueError
        When the file of the hull cannot be used.
    """
    layout, train = Layout.from_rig(rig), OpticalTrain.from_rig(rig)
    pixels = pixel_grid(train.camera, COLUMNS, ROWS)
    at_port = train.without_mirrors().trace(pixels)
    at_m1 = replace(train, mirrors=train.mirrors[:1]).trace(pixels)
    folded = at_m1.passed
    if not folded.any():
        return
    port, m1 = (rays[folded].moved(layout.body_from_camera).origin_m for rays in (at_port, at_m1))
    skin = Occluder([seen_file_hull(rig, hull)])
    behind = _hits(skin, np.broadcast_to(layout.body_from_camera.translation, port.shape), port)
    in_front = _hits(skin, port, m1)
    opened = hull.window != "as-drawn"
    places = ((behind, "between the pinhole and the port"), (in_front, _nearest_in_front(in_front)))
    for distances, where in places:
        blocked = np.isfinite(distances)
        if not blocked.any():
            continue
        which = f"{blocked.mean():.0%} of the rays to M1 ({_span(pixels[folded][blocked])}) hit the skin {where}"
        advice = 'hull.window = "cut" makes an opening of it, "clear" a pane'
        if opened:
            advice = "move the camera along its view, or M1 towards it"
        yield Problem(
            place="camera.position_mm" if opened else "hull.window",
            value=rig.camera.position_mm if opened else hull.window,
            expected=f"a window in {hull.file.name}, within {WINDOW_REACH_MM:g} mm of the port: {which}; {advice}",
        )


def _nearest_in_front(distances_m: FloatArray) -> str:
    return f"in front of the port, the nearest {1000 * distances_m.min():.1f} mm from it"


def _span(pixels: FloatArray) -> str:
    """Columns and rows that pixels lie in."""
    (left, top), (right, bottom) = pixels.min(axis=0), pixels.max(axis=0)
    return f"u {left:.0f} to {right:.0f}, v {top:.0f} to {bottom:.0f} px"


def _hits(skin: Occluder, start_m: FloatArray, end_m: FloatArray) -> FloatArray:
    """How far from their starts segments hit the skin, metres, shape (n,); infinite where they do not."""
    segments = end_m - start_m
    lengths = np.linalg.norm(segments, axis=1)
    along = Array3f64(*to_columns(segments / lengths[:, np.newaxis]))
    origin = Array3f64(*to_columns(start_m)) + along * SKIN_M
    hit = first_hit(skin.parameters(), origin, along, Float64(lengths - 2 * SKIN_M), Bool(True))
    found: NDArray[np.float64] = np.array(hit.distance, dtype=np.float64)
    return np.broadcast_to(found, lengths.shape) + SKIN_M
