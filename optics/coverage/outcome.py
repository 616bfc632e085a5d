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


class Outcome(IntEnum):
    """What becomes of a pixel's ray; the columns of counts and solid angles by outcome."""

    SEEN = 0
    """It looks into the open water: over both mirrors where losses are counted, as it goes within a region."""
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
    """It hits the bracket of M1."""
    MOUNT = 9
    """It hits another part of the mount: gimbal base, yoke, mirror holder."""
    SERVO = 10
    MIRROR_PLATE = 11
    """It hits a mirror's plate on its path, such as M1 after M2: there the camera sees itself."""


BLOCKERS = (Outcome.HULL, Outcome.FOLD_BRACKET, Outcome.MOUNT, Outcome.SERVO, Outcome.MIRROR_PLATE)
"""Outcomes of rays that a part stops."""


class OpticalPath(IntEnum):
    """How far a pixel's ray gets by port and mirrors alone: its `Region`, with the back of M2 apart."""

    HOUSING = 0
    DIRECT = 1
    FOLD = 2
    GAZE = 3
    BACK = 4
    """Over M1 to the back of M2: part of the fold view."""


OUTCOME_OF_STATUS = {
    Status.INVALID_INPUT: Outcome.OUTSIDE_CAMERA_MODEL,
    Status.OUTSIDE_CAMERA_MODEL: Outcome.OUTSIDE_CAMERA_MODEL,
    Status.MISSED_PORT: Outcome.PORT_RIM,
    Status.TOTAL_REFLECTION: Outcome.TOTAL_REFLECTION,
    Status.MISSED_M1: Outcome.MISSED_M1,
    Status.MISSED_M2: Outcome.MISSED_M2,
    Status.BACK_OF_MIRROR: Outcome.BACK_OF_MIRROR,
    Status.OK: Outcome.SEEN,
}


def outcomes_of_status(status: StatusArray) -> NDArray[np.int32]:
    """`Outcome` of rays traced by an optical train, of the shape of `status`."""
    table = np.full(max(Status) + 1, Outcome.OUTSIDE_CAMERA_MODEL, dtype=np.int32)
    for key, outcome in OUTCOME_OF_STATUS.items():
        table[key] = outcome
    return table[status]


def outcome_at_part(part: PartMesh) -> Outcome:
    """`Outcome` of a ray that hits a part: by its role, and for the bracket of M1, or its halves, by its name."""
    if part.role is Role.MOUNT and part.name.startswith(FOLD_BRACKET):
        return Outcome.FOLD_BRACKET
    return {
        Role.HULL: Outcome.HULL,
        Role.MOUNT: Outcome.MOUNT,
        Role.HARDWARE: Outcome.MOUNT,
        Role.SERVO: Outcome.SERVO,
        Role.MIRROR: Outcome.MIRROR_PLATE,
    }[part.role]


def outcomes_at_parts(parts: Sequence[PartMesh]) -> NDArray[np.uint32]:
    """`Outcome` by the part's position; one entry where there are no parts, so that a kernel has something to read."""
    return np.array([outcome_at_part(part) for part in parts] or [Outcome.SEEN], dtype=np.uint32)


def by_outcome(by_path: NDArray[Number]) -> NDArray[Number]:
    """Losses of the gaze, shape (..., len(Outcome)), from sums by path, shape (..., len(OpticalPath), len(Outcome)).

    A pixel is lost to what comes first in the design, not along the ray: what passes a mirror's edge is lost to that
    edge, whatever it hits; only of pixels that port and mirrors lead to M2's face the parts in the way take some.
    """
    sums = by_path[..., OpticalPath.HOUSING, :] + by_path[..., OpticalPath.GAZE, :]
    # M1's back is an outcome of the direct view; nothing else in a working rig is.
    back_of_m1 = by_path[..., OpticalPath.DIRECT, Outcome.BACK_OF_MIRROR]
    sums[..., Outcome.BACK_OF_MIRROR] += back_of_m1 + by_path[..., OpticalPath.BACK, :].sum(axis=-1)
    sums[..., Outcome.MISSED_M1] += by_path[..., OpticalPath.DIRECT, :].sum(axis=-1) - back_of_m1
    sums[..., Outcome.MISSED_M2] += by_path[..., OpticalPath.FOLD, :].sum(axis=-1)
    return sums


def by_region(by_path: NDArray[Number]) -> NDArray[Number]:
    """What each region shows, shape (..., len(Region), len(Outcome)), from sums by path, as `by_outcome` takes them."""
    sums = by_path[..., : len(Region), :].copy()
    sums[..., Region.FOLD, :] += by_path[..., OpticalPath.BACK, :]
    return sums
