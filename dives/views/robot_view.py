"""Where in the crop a rig shows itself, from its meshes: what the tracking loop ignores."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from optics.coverage.pose_axes import PoseAxes
from optics.coverage.poses import seen_cells
from optics.kernels.arrays import FloatArray
from optics.kernels.cache import load_or_make, result_key
from optics.layout import Layout
from optics.mesh import Group, PartMesh
from optics.occlusion import Occluder
from optics.train import OpticalTrain
from rigs import Rig
from tracking.perception import Crop
from tracking.perception.corners.exact import corners_of
from tracking.perception.crop import WIDTH_PX
from tracking.perception.robot_view import DEEPEST_PX, RobotView

VIEW_VERSION = 3
"""Raised when the same rig is seen to hide other cells."""

STEP_DEG = 2.5
"""Of the gaze between the joint values of the grid, at most: tilt turns it by twice its own angle.

A pole or a hull's edge that is near moves by several of its own widths in 5 degrees, and what is interpolated between
then hides the water beside it: of 61 images of a target beside the robot's own parts, 34 instead of 26 show it to the
detector, as many as at 2 degrees, with as many false alarms (102 of 3,239 images)."""

CROP_CELLS = (80, 60)
"""Columns and rows of the crop: a quarter of a degree of the aqua2's gaze each.

Rails and legs are a few of them wide. With half as many along each side 90 things that are no ball pass for the target
in 3,225 stills of the arena, most of them a BlueROV2's mount, with these 23, and as many targets are found."""

CELLS_ACROSS = 60
"""Of the image that are traced across the gaze mirror, where it looks widest."""

MOST_COLUMNS = 192
"""Of cells of the image that are traced: 0.2 GB at all joint values. A gaze mirror of less than a third of the image's
width gets fewer across."""


def robot_view(rig: Rig, parts: Sequence[PartMesh]) -> RobotView:
    """Cells of the crop that do not look over both mirrors into the water, at joint values over all their range.

    From the cache when it can be.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    parts : sequence of PartMesh
        Hull and mount (`cad.assembly.meshes.rig_meshes`); may be empty.
    """
    numbers = rig.model_dump(mode="json", include={"camera", "port", "water", "gaze"})
    shapes = [[part.group.value, part.vertices_m, part.faces] for part in parts]
    return load_or_make(
        "robot views",
        result_key("robot view", VIEW_VERSION, numbers, shapes),
        lambda: traced_view(rig, parts),
        pack=lambda view: {"q1": view.q1, "q2": view.q2, "depth": view.depth},
        unpack=lambda stored: RobotView(**stored),
    )


def traced_view(rig: Rig, parts: Sequence[PartMesh], *, step_deg: float = STEP_DEG) -> RobotView:
    """The same without the cache, with gazes that are at most `step_deg` apart."""
    layout, camera = Layout.from_rig(rig), rig.camera
    q1, q2 = _grid(layout.pan.limits, step_deg), _grid(layout.tilt.limits, step_deg / 2)
    q = np.stack(np.meshgrid(q1, q2, indexing="ij"), axis=-1).reshape(-1, 2)
    corners = corners_of(rig).corners(q)
    narrowest_px = CELLS_ACROSS * camera.width_px / MOST_COLUMNS
    columns = round(CELLS_ACROSS * camera.width_px / np.nanmax(np.ptp(corners[..., 0], axis=1), initial=narrowest_px))
    seen = seen_cells(
        OpticalTrain.from_rig(rig, q1=float(q1[0]), q2=float(q2[0])),
        layout,
        {group: Occluder.of_group(parts, group) for group in Group},
        PoseAxes.of(layout, q[:, 0], q[:, 1]),
        columns=columns,
        rows=round(columns * camera.height_px / camera.width_px),
    )
    cells_per_px = np.array(seen.shape[:0:-1]) / [camera.width_px, camera.height_px]
    outlines = (corners + 0.5) * cells_per_px - 0.5
    depth = np.array([_depth(image, outline) for image, outline in zip(seen, outlines, strict=True)])
    return RobotView(q1=q1, q2=q2, depth=depth.reshape(len(q1), len(q2), *CROP_CELLS[::-1]))


def _grid(limits: tuple[float, float], step_deg: float) -> FloatArray:
    lowest, highest = limits
    return np.linspace(lowest, highest, int(np.ceil((highest - lowest) / np.radians(step_deg))) + 1)


def _depth(seen: NDArray[np.bool_], corners: FloatArray) -> NDArray[np.int8]:
    """How far each cell of the crop lies inside of what hides the water, from cells of the image that show it."""
    crop = Crop.of(corners, *CROP_CELLS)
    if crop.empty:
        return np.full(CROP_CELLS[::-1], DEEPEST_PX, dtype=np.int8)
    flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    water = np.asarray(cv2.warpPerspective(seen.astype(np.uint8), crop.image_from_crop, CROP_CELLS, flags=flags)) > 0
    depth_px = WIDTH_PX / CROP_CELLS[0] * (_to_nearest_other(~water) - _to_nearest_other(water))
    return np.clip(np.rint(depth_px), -DEEPEST_PX, DEEPEST_PX).astype(np.int8)


def _to_nearest_other(cells: NDArray[np.bool_]) -> FloatArray:
    """Distance of each true cell from the edge of the nearest false one, in cells; else 0."""
    distance = np.asarray(cv2.distanceTransform(cells.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE))
    return np.where(cells, distance - 0.5, 0.0)
