"""Where a rig's camera sees the water past both mirrors, from its meshes: what the tracking loop looks at as well."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from optics.coverage.field import folded_field
from optics.coverage.outcome import Outcome
from optics.coverage.poses import near_moving_parts
from optics.kernels.cache import load_or_make, result_key
from optics.layout import Layout
from optics.mesh import Group, PartMesh
from optics.occlusion import Occluder
from optics.train import OpticalTrain
from rigs import Rig
from tracking.perception.direct_view import DirectView

VIEW_VERSION = 2
"""Raised when the same rig gets another direct view."""

COLUMNS = 96
"""Of the cells of the image."""

DISTANCE_M = 2.0
"""At which what a cell shows is assumed: the port is 0.2 to 0.3 m from the gaze mirror, so that a target at 1.2 m is 5
degrees from where it is then thought to be, and still in the gaze."""


def direct_view(rig: Rig, parts: Sequence[PartMesh]) -> DirectView | None:
    """Cells of the image that look past both mirrors into the water at all joint values; None when there are none.

    Those beside an edge are left out: a mount is built to a millimetre. From the cache when it can be.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    parts : sequence of PartMesh
        Hull and mount (`cad.assembly.meshes.rig_meshes`); may be empty.
    """
    numbers = rig.model_dump(mode="json", include={"camera", "port", "water", "gaze"})
    shapes = [[part.group.value, part.vertices_m, part.faces] for part in parts]
    view = load_or_make(
        "direct views",
        result_key("direct view", VIEW_VERSION, numbers, shapes),
        lambda: traced_view(rig, parts),
        pack=lambda view: {"water": view.water, "direction": view.direction},
        unpack=lambda stored: DirectView(**stored),
    )
    return view if view.water.any() else None


def traced_view(rig: Rig, parts: Sequence[PartMesh]) -> DirectView:
    """The same without the cache; it may have no cells."""
    layout = Layout.from_rig(rig)
    occluders = {group: Occluder.of_group(parts, group) for group in Group}
    train = OpticalTrain.from_rig(rig, q1=layout.pan.limits[0], q2=layout.tilt.limits[0])
    shape = (round(COLUMNS * rig.camera.height_px / rig.camera.width_px), COLUMNS)
    field = folded_field(train, layout, occluders[Group.FIXED], COLUMNS, shape[0])
    # M2 is in the way at some joint values, whether or not it is one of the parts.
    mirror = rig.require_gaze().gaze_mirror
    m2_reach_m = math.hypot(mirror.width_mm, mirror.height_mm) / 2000
    near = near_moving_parts(field, layout, occluders, least_reach_m=m2_reach_m)
    seen = ~field.folded & ~near & (field.before.outcome == Outcome.SEEN)
    water, direction = np.zeros(shape, dtype=np.uint8), np.zeros((*shape, 3), dtype=np.float32)
    water.ravel()[field.cell[seen]] = 1
    shown_m = field.port_m + DISTANCE_M * field.port_direction - layout.body_from_gimbal.translation
    direction.reshape(-1, 3)[field.cell] = shown_m / np.linalg.norm(shown_m, axis=1, keepdims=True)
    inside = cv2.erode(water, np.ones((3, 3), dtype=np.uint8), borderType=cv2.BORDER_CONSTANT, borderValue=1)
    return DirectView(water=np.asarray(inside) > 0, direction=direction)
