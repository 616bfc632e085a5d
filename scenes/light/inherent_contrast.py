"""How bright a thing is beside the water behind it, from near by: inherent contrast (Duntley 1948, JOSA 38, 179)."""

from __future__ import annotations

import numpy as np

from optics.kernels.arrays import FloatArray
from scenes.light.light import Light
from scenes.light.materials import Material, albedo_table

AZIMUTHS_RAD = np.arange(72) * (2 * np.pi / 72)
"""Of level views, over which is averaged."""


def inherent_contrast(light: Light, depth_m: float, material: Material) -> FloatArray:
    """Natural logarithm of the radiance of a body over that of the water behind it, in red, green and blue, shape (3,).

    As the camera's channels have it, from near by.

    The body is convex: whichever way light comes, its surface gets a quarter of the scalar irradiance on average
    (Cauchy's mean projected area). The water is looked at level, in all directions, and the body is as deep as the
    camera. Lamps are left out.
    """
    scalar = light.field.scalar
    around = np.array([np.interp(depth_m, light.field.depth_m, row) for row in scalar])
    surface = albedo_table(light.bands)[material] * around / (4 * np.pi)
    channels = light.bands.weight
    return np.asarray(np.log((channels @ surface) / (channels @ level_radiance(light, depth_m))))


def level_radiance(light: Light, depth_m: float) -> FloatArray:
    """Radiance of open water in level views, the mean of all azimuths, by wavelength, shape (w,).

    The sun's light that was scattered once is added in closed form: along a level line its beam is as strong
    everywhere, ``b p E / c``.
    """
    field, optics = light.field, light.optics
    by_cosine = np.trapezoid(field.multiple, field.azimuth_rad, axis=3) / np.pi
    level = np.apply_along_axis(lambda row: np.interp(0.0, field.cosine, row), 2, by_cosine)
    multiple = np.array([np.interp(depth_m, field.depth_m, row) for row in level])
    beam = field.sun_irradiance * np.exp(-field.beam_attenuation * depth_m / field.sun_cosine)
    level_part = np.sqrt(1 - field.sun_cosine**2)
    angles = np.arccos(np.multiply.outer(level_part, np.cos(AZIMUTHS_RAD)))
    phase = np.array([optics.phase_function(row)[number].mean() for number, row in enumerate(angles)])
    return np.asarray(multiple + optics.scattering * phase * beam / field.beam_attenuation)
