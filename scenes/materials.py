"""Materials of rendered surfaces: Lambertian, with measured reflectance spectra."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from optics.mesh import Role
from scenes.spectrum import camera_bands, reflectance


class Material(IntEnum):
    """What a surface is made of."""

    HULL = 0
    MOUNT = 1
    SERVO = 2
    MIRROR_BACK = 3
    TARGET = 4
    TILE_WHITE = 5
    TILE_GREY = 6
    TILE_YELLOW = 7
    TILE_ORANGE = 8
    TILE_BLACK = 9
    STEEL = 10


PATCHES: dict[Material, str] = {
    Material.HULL: "yellow",
    Material.MOUNT: "neutral 5 (.70 D)",
    Material.SERVO: "black 2 (1.5 D)",
    Material.MIRROR_BACK: "black 2 (1.5 D)",
    Material.TARGET: "red",
    Material.TILE_WHITE: "white 9.5 (.05 D)",
    Material.TILE_GREY: "neutral 5 (.70 D)",
    Material.TILE_YELLOW: "yellow",
    Material.TILE_ORANGE: "orange",
    Material.TILE_BLACK: "black 2 (1.5 D)",
    Material.STEEL: "white 9.5 (.05 D)",
}
"""ColorChecker patch that stands for each material; the paper's ball is the red one."""

MATERIAL_OF_ROLE = {
    Role.HULL: Material.HULL,
    Role.MOUNT: Material.MOUNT,
    Role.SERVO: Material.SERVO,
    Role.MIRROR: Material.MIRROR_BACK,
    Role.HARDWARE: Material.STEEL,
}


def albedo_table() -> NDArray[np.float64]:
    """Reflectance of every material at the wavelengths of the bands, shape (materials, w)."""
    wavelength = camera_bands().wavelength_nm
    return np.stack([reflectance(PATCHES[material], wavelength) for material in Material])
