"""What becomes of a pixel: seen through both mirrors, or lost, and to what; and what each region of the image shows."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from optics.mesh import PartMesh, Role
from optics.status import Region, Status
from optics.train import StatusArray

FOLD_BRACKET = "fold_bracket"
"""Name of the part that carries M1; the rest of the mount belongs to the gimbal."""


Number = TypeVar("Number", np.int64, np.float64)


class Fate(IntEnum):
    """What becomes of a pixel's ray; the columns of counts and solid angles by fate."""

    SEEN = 0
    """It looks into the open water: over both mirrors where losses are counted, in its own way within a region."""
    PORT_RIM = 1
    """It ends in the housing, outside the port's aperture."""
    TOTAL_REFLECTION = 2
    """It does not get through the port."""
    OUTSIDE_CAMERA_MODEL = 3
    MISSED_M1 = 4
    """It passes the fold mirror's edge: the direct view."""
    MISSED_M2 = 5
    """It passes the gaze mirror's edge: the fold view."""
    BACK_OF_MIRROR = 6
    HULL = 7
    FOLD_BRACKET = 8
    """It meets the bracket of M1."""
    MOUNT = 9
    """It meets another part of the mount: gimbal base, yoke, mirror holder."""
    SERVO = 10
    MIRROR_PLATE = 11
    """It meets a mirror's plate on its way, such as M1 after M2: there the camera sees itself."""


BLOCKERS = (Fate.HULL, Fate.FOLD_BRACKET, Fate.MOUNT, Fate.SERVO, Fate.MIRROR_PLATE)
"""Fates of rays that a part stops."""


class Way(IntEnum):
    """How far a pixel's ray gets by port and mirrors alone: its `Region`, with the back of M2 apart."""

    HOUSING = 0
    DIRECT = 1
    FOLD = 2
    GAZE = 3
    BACK = 4
    """Over M1 to the back of M2: part of the fold view."""


FATE_OF_STATUS = {
    Status.INVALID_INPUT: Fate.OUTSIDE_CAMERA_MODEL,
    Status.OUTSIDE_CAMERA_MODEL: Fate.OUTSIDE_CAMERA_MODEL,
    Status.MISSED_PORT: Fate.PORT_RIM,
    Status.TOTAL_REFLECTION: Fate.TOTAL_REFLECTION,
    Status.MISSED_M1: Fate.MISSED_M1,
    Status.MISSED_M2: Fate.MISSED_M2,
    Status.BACK_OF_MIRROR: Fate.BACK_OF_MIRROR,
    Status.OK: Fate.SEEN,
}


def fates_of_status(status: StatusArray) -> NDArray[np.int32]:
    """`Fate` of rays traced by an optical train, of the shape of `status`."""
    table = np.full(max(Status) + 1, Fate.OUTSIDE_CAMERA_MODEL, dtype=np.int32)
    for key, fate in FATE_OF_STATUS.items():
        table[key] = fate
    return table[status]


def fate_at_part(part: PartMesh) -> Fate:
    """`Fate` of a ray that meets a part: by its role, and for the bracket of M1 by its name."""
    if part.role is Role.MOUNT and part.name == FOLD_BRACKET:
        return Fate.FOLD_BRACKET
    return {
        Role.HULL: Fate.HULL,
        Role.MOUNT: Fate.MOUNT,
        Role.HARDWARE: Fate.MOUNT,
        Role.SERVO: Fate.SERVO,
        Role.MIRROR: Fate.MIRROR_PLATE,
    }[part.role]


def fates_at_parts(parts: Sequence[PartMesh]) -> NDArray[np.uint32]:
    """`Fate` by the part's position; one entry where there are no parts, so that a kernel has something to read."""
    return np.array([fate_at_part(part) for part in parts] or [Fate.SEEN], dtype=np.uint32)


def by_fate(by_way: NDArray[Number]) -> NDArray[Number]:
    """Losses of the gaze: from sums by way and what is met, shape (..., len(Way), len(Fate)), to (..., len(Fate)).

    A pixel is lost to what comes first in the design, not along the ray: what passes a mirror's edge is lost to that
    edge, whatever it meets; only of pixels that port and mirrors lead to M2's face the parts in the way take some.
    """
    sums = by_way[..., Way.HOUSING, :] + by_way[..., Way.GAZE, :]
    # M1's back is told in the direct view by what is met; nothing else in a working rig is.
    back_of_m1 = by_way[..., Way.DIRECT, Fate.BACK_OF_MIRROR]
    sums[..., Fate.BACK_OF_MIRROR] += back_of_m1 + by_way[..., Way.BACK, :].sum(axis=-1)
    sums[..., Fate.MISSED_M1] += by_way[..., Way.DIRECT, :].sum(axis=-1) - back_of_m1
    sums[..., Fate.MISSED_M2] += by_way[..., Way.FOLD, :].sum(axis=-1)
    return sums


def by_region(by_way: NDArray[Number]) -> NDArray[Number]:
    """What each region shows: from sums by way, shape (..., len(Way), len(Fate)), to (..., len(Region), len(Fate))."""
    sums = by_way[..., : len(Region), :].copy()
    sums[..., Region.FOLD, :] += by_way[..., Way.BACK, :]
    return sums
