"""From the rig file to the fold frame, and back; and what of a rig is pinned.

In the fold frame the camera looks along x and M2 is below it (`optics.layout`); here its origin is the body's, as the
pinhole is not known yet.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from scipy.spatial.transform import Rotation

from cad.hulls.anchors import Anchor, base_anchor, fold_anchor
from cad.placement.candidates import Candidate
from optics.kernels.arrays import FloatArray
from optics.layout import BODY_FROM_OPTICAL, camera_pose
from optics.search.objectives import PARAMETERS, rig_with
from rigs import Rig

HALF_TURN = Rotation.from_quat([1.0, 0.0, 0.0, 0.0])
"""About x: from the fold frame of a rig that folds down to that of one that folds up, and back."""
POINT_DIGITS, NORMAL_DIGITS = 1, 4
"""To which the rig file gives points (millimetres) and normals that were found."""

CAMERA = "camera.position_mm"
DIRECTION = "fold_mirror.direction"
FOLD_ANCHOR, BASE_ANCHOR = "mount.fold_anchor_mm", "mount.base_anchor_mm"
DESIGN_KEYS = tuple(f"{section}.{key}" for section, key in PARAMETERS)
PLACED_KEYS = (CAMERA, DIRECTION, *DESIGN_KEYS, FOLD_ANCHOR, BASE_ANCHOR)
"""Keys of a rig file that a placement decides, unless they are pinned."""

Point = tuple[float, float, float]


def turn_of(rig: Rig, direction: str) -> Rotation:
    """Turn of the fold frame in the body, for a rig that folds in a direction."""
    turn = camera_pose(rig.camera).rotation * BODY_FROM_OPTICAL.inv()
    return turn * HALF_TURN if direction == "up" else turn


def looking_ahead(rig: Rig) -> Rig:
    """The rig with a camera that looks along the body's x, in whose body the mount frame's numbers are."""
    ahead = {"yaw_deg": 0.0, "pitch_deg": 0.0, "roll_deg": 0.0}
    return rig.model_copy(update={"camera": rig.camera.model_copy(update=ahead)})


def facing(rig: Rig, direction: str) -> Rig:
    """The rig folding in a direction; if that is new, with the limits of its tilt the other way round."""
    gaze = rig.require_gaze()
    if gaze.fold_mirror.direction == direction:
        return rig
    tilt = gaze.joints.tilt
    reverse = tilt.model_copy(update={"min_deg": -tilt.max_deg, "max_deg": -tilt.min_deg})
    joints = gaze.joints.model_copy(update={"tilt": reverse})
    return rig.with_gaze(fold_mirror={"direction": direction}, joints=joints)


def turned(vector: Point, turn: Rotation) -> Point:
    """A vector of one frame in another."""
    x, y, z = turn.apply(vector).tolist()
    return x, y, z


def _rounded(vector: Point, digits: int) -> Point:
    # Adding zero turns -0.0 into 0.0, which is what a rig file should say.
    x, y, z = (np.round(vector, digits) + 0.0).tolist()
    return x, y, z


def pinned_seats(rig: Rig, pinned: Collection[str], fold_from_body: Rotation) -> dict[int, Anchor]:
    """Seats that the user has chosen, by the side of the fold frame that they are on."""
    ends = ((FOLD_ANCHOR, 1, fold_anchor), (BASE_ANCHOR, -1, base_anchor))
    chosen = {side: find(rig) for key, side, find in ends if key in pinned}
    return {
        side: Anchor(point_mm=turned(anchor.point_mm, fold_from_body), normal=turned(anchor.normal, fold_from_body))
        for side, anchor in chosen.items()
    }


def with_pinned(rig: Rig, designs: FloatArray, pinned: Collection[str]) -> FloatArray:
    """Designs with the numbers that are pinned: of pinned distances the nearest rows, pinned sizes as they are."""
    gaze = rig.require_gaze()
    designs = designs.copy()
    for column, (section, key) in enumerate(PARAMETERS):
        if f"{section}.{key}" in pinned and len(designs):
            value = getattr(getattr(gaze, section), key)
            if key == "distance_mm":
                away = np.abs(designs[:, column] - value)
                designs = designs[away == away.min()]
            designs[:, column] = value
    return designs


def rig_of(rig: Rig, candidate: Candidate, direction: str, pinned: Collection[str]) -> Rig:
    """The rig that a candidate describes, in the body frame."""
    turn = turn_of(rig, direction)
    sized = rig_with(facing(rig, direction), candidate.shape.design)
    mount: dict[str, object] = {}
    for end, anchor in (("fold", candidate.fold), ("base", candidate.base)):
        if f"mount.{end}_anchor_mm" not in pinned:
            mount[f"{end}_anchor_mm"] = _rounded(turned(anchor.point_mm, turn), POINT_DIGITS)
            mount[f"{end}_normal"] = _rounded(turned(anchor.normal, turn), NORMAL_DIGITS)
            mount[f"{end}_plane"] = None
    placed = sized.with_gaze(mount=mount)
    pinhole = _rounded(turned(candidate.site.pinhole_mm, turn), POINT_DIGITS)
    camera = rig.camera.model_copy(update={"position_mm": pinhole})
    return placed if CAMERA in pinned else placed.model_copy(update={"camera": camera})
