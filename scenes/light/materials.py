"""Materials of rendered surfaces: Lambertian, with measured reflectance spectra and a colour that varies over them."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import expit

from optics.kernels.arrays import FloatArray
from optics.mesh import PartMesh, Role
from scenes.light.spectrum import Bands, camera_bands, reflectance


class Material(IntEnum):
    """What a surface is made of."""

    HULL = 0
    PRINT_GREY = 1
    SERVO = 2
    MIRROR_BACK = 3
    TARGET = 4
    TILE_WHITE = 5
    TILE_GREY = 6
    TILE_YELLOW = 7
    TILE_ORANGE = 8
    TILE_BLACK = 9
    STEEL = 10
    SAND = 11
    ROCK = 12
    TURF = 13
    BROWN_CORAL = 14
    RED_SPONGE = 15
    ORANGE_SPONGE = 16
    PINK_CORAL = 17
    YELLOW_CORAL = 18
    PURPLE_FAN = 19
    GREEN_CORAL = 20
    BLUE_CORAL = 21
    NEOPRENE = 22
    SKIN = 23
    FISH = 24
    BUOY = 25
    SNOW = 26
    COLOURED = 27
    """White at every wavelength, so that the colour factors are the reflectance: a user's own mesh."""
    PRINT_BLACK = 28
    PRINT_WHITE = 29
    PRINT_YELLOW = 30
    PRINT_ORANGE = 31
    PRINT_RED = 32
    PRINT_GREEN = 33
    PRINT_BLUE = 34


PATCHES: dict[Material, str] = {
    Material.HULL: "yellow",
    Material.PRINT_GREY: "neutral 5 (.70 D)",
    Material.SERVO: "black 2 (1.5 D)",
    Material.MIRROR_BACK: "black 2 (1.5 D)",
    Material.TARGET: "red",
    Material.TILE_WHITE: "white 9.5 (.05 D)",
    Material.TILE_GREY: "neutral 5 (.70 D)",
    Material.TILE_YELLOW: "yellow",
    Material.TILE_ORANGE: "orange",
    Material.TILE_BLACK: "black 2 (1.5 D)",
    Material.STEEL: "white 9.5 (.05 D)",
    Material.SAND: "neutral 8 (.23 D)",
    Material.ROCK: "neutral 5 (.70 D)",
    Material.TURF: "foliage",
    Material.BROWN_CORAL: "dark skin",
    Material.RED_SPONGE: "red",
    Material.ORANGE_SPONGE: "orange",
    Material.PINK_CORAL: "moderate red",
    Material.YELLOW_CORAL: "orange yellow",
    Material.PURPLE_FAN: "purple",
    Material.GREEN_CORAL: "yellow green",
    Material.BLUE_CORAL: "blue flower",
    Material.NEOPRENE: "black 2 (1.5 D)",
    Material.SKIN: "light skin",
    Material.FISH: "neutral 6.5 (.44 D)",
    Material.BUOY: "orange",
    Material.SNOW: "neutral 8 (.23 D)",
    Material.PRINT_BLACK: "black 2 (1.5 D)",
    Material.PRINT_WHITE: "white 9.5 (.05 D)",
    Material.PRINT_YELLOW: "yellow",
    Material.PRINT_ORANGE: "orange",
    Material.PRINT_RED: "red",
    Material.PRINT_GREEN: "green",
    Material.PRINT_BLUE: "blue",
}
"""ColorChecker patch that stands for each material; the paper's ball is the red one, what lives in the sea and what
is printed nominal."""

MATERIAL_OF_ROLE = {
    Role.HULL: Material.HULL,
    Role.MOUNT: Material.PRINT_GREY,
    Role.SERVO: Material.SERVO,
    Role.MIRROR: Material.MIRROR_BACK,
    Role.HARDWARE: Material.STEEL,
}


BASIS_EDGES_NM = (500.0, 570.0)
BASIS_WIDTH_NM = 12.0
"""Where blue turns to green and green to red in a colour factor, and how softly: nominal, between the channels."""


def material_of(part: PartMesh) -> Material:
    """What a part is made of."""
    return MATERIAL_OF_ROLE[part.role] if part.colour is None else Material[f"PRINT_{part.colour.upper()}"]


def albedo_table(bands: Bands | None = None) -> FloatArray:
    """Reflectance of every material at the wavelengths of the bands (the camera's own by default), (materials, w)."""
    wavelength = (bands or camera_bands()).wavelength_nm
    white = np.ones_like(wavelength)
    return np.stack([reflectance(PATCHES[each], wavelength) if each in PATCHES else white for each in Material])


def colour_basis(wavelength_nm: ArrayLike) -> FloatArray:
    """Red, green and blue part of the spectrum, smooth and positive, shape (3, w); they add up to 1 everywhere.

    Two logistic steps cut the spectrum. A reflectance is a material's spectrum times the sum of the three parts, each
    times its colour factor: equal factors darken and keep the colour, and factors of at most 1 keep a reflectance
    below 1.
    """
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    not_blue, red = (expit((wavelength - edge) / BASIS_WIDTH_NM) for edge in BASIS_EDGES_NM)
    return np.stack([red, not_blue - red, 1 - not_blue])
