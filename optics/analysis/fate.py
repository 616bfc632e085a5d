"""What becomes of a pixel: seen through both mirrors, or lost, and to what."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from optics.mesh import Role
from optics.occlusion import ROLES
from optics.status import Status
from optics.train import StatusArray


class Fate(IntEnum):
    """What becomes of a pixel's ray; the columns of counts and solid angles by fate."""

    SEEN = 0
    """It looks into the open water over both mirrors."""
    PORT = 1
    """It ends in the housing: the port's rim, total reflection, or beyond the camera's model."""
    MISSED_M1 = 2
    """It passes M1: the direct view."""
    MISSED_M2 = 3
    """It passes M2: the fold view."""
    BACK_OF_MIRROR = 4
    HULL = 5
    MOUNT = 6
    """It meets the mount or a servo."""
    FOLD_MIRROR = 7
    """It meets a mirror's plate on its way, such as M1 after M2: there the camera sees itself."""


FATE_OF_STATUS = {
    Status.OK: Fate.SEEN,
    Status.INVALID_INPUT: Fate.PORT,
    Status.OUTSIDE_CAMERA_MODEL: Fate.PORT,
    Status.MISSED_PORT: Fate.PORT,
    Status.TOTAL_REFLECTION: Fate.PORT,
    Status.MISSED_M1: Fate.MISSED_M1,
    Status.MISSED_M2: Fate.MISSED_M2,
    Status.BACK_OF_MIRROR: Fate.BACK_OF_MIRROR,
}

FATE_OF_ROLE = {
    Role.HULL: Fate.HULL,
    Role.MOUNT: Fate.MOUNT,
    Role.SERVO: Fate.MOUNT,
    Role.MIRROR: Fate.FOLD_MIRROR,
}


def fates_of_status(status: StatusArray) -> NDArray[np.int32]:
    """`Fate` of rays traced by an optical train, of the shape of `status`."""
    table = np.full(max(Status) + 1, Fate.PORT, dtype=np.int32)
    for key, fate in FATE_OF_STATUS.items():
        table[key] = fate
    return table[status]


def fate_of_role_table() -> NDArray[np.uint32]:
    """`Fate` of a ray that hits a part, by the part's position in `optics.occlusion.ROLES`."""
    return np.array([FATE_OF_ROLE[role] for role in ROLES], dtype=np.uint32)
