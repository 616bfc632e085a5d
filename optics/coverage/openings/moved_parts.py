"""Parts of a mount beside the mirrors of a rig with other numbers: moved and stretched along, not designed again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import RigidTransform

from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from rigs import Rig
from rigs.gaze import FlatMirror

FOLD = ("fold_", "stow_")
"""How names of the fixed parts begin that stand with M1; the others stand with the gimbal, but for the hull."""

ROUNDING_M = 1e-9


def moved_parts(parts: Sequence[PartMesh], rig: Rig, changed: Rig) -> list[PartMesh]:
    """Parts of a rig in the places where a rig with other arms or mirrors would have them.

    What holds M1 moves with it, what is fixed of the gimbal moves with the gimbal, and what turns with M2 moves by
    itself, since its frame does. M1's plate, and all that turns with M2, is stretched along the mirror's sides.
    """
    before, after = Layout.from_rig(rig), Layout.from_rig(changed)
    gaze, other = rig.require_gaze(), changed.require_gaze()
    fold = after.body_from_m1 * before.body_from_m1.inv()
    gimbal = after.body_from_gimbal * before.body_from_gimbal.inv()
    stretched = _stretch(gaze.gaze_mirror, other.gaze_mirror)
    plate = _stretch(gaze.fold_mirror, other.fold_mirror)
    return [_moved(part, before.body_from_m1, fold, gimbal, stretches=(plate, stretched)) for part in parts]


def _moved(
    part: PartMesh,
    body_from_m1: RigidTransform,
    fold: RigidTransform,
    gimbal: RigidTransform,
    *,
    stretches: tuple[FloatArray, FloatArray],
) -> PartMesh:
    """A part where it then is; itself where it stays, so that nothing need be made of it again."""
    vertices = part.vertices_m
    if part.group is Group.TILT:
        vertices = vertices * stretches[1]
    elif part.group is Group.FIXED and part.role is not Role.HULL:
        if part.name == "fold_mirror":
            vertices = body_from_m1.apply(body_from_m1.inv().apply(vertices) * stretches[0])
        vertices = (fold if part.name.startswith(FOLD) else gimbal).apply(vertices)
    return (
        part if np.allclose(vertices, part.vertices_m, rtol=0, atol=ROUNDING_M) else replace(part, vertices_m=vertices)
    )


def _stretch(before: FlatMirror, after: FlatMirror) -> FloatArray:
    """Along a mirror's axes: its width, its height, and not its thickness."""
    return np.array([after.width_mm / before.width_mm, after.height_mm / before.height_mm, 1.0])
