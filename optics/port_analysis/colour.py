"""Colour fringes from the dispersion of port and water. Formulas and sources: `docs/explanation/ports.md`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray, check_points
from optics.ports.port import port_from_spec
from optics.train import OpticalTrain
from optics.water.materials import material_index
from optics.water.water import water_index
from rigs import Rig
from rigs.port import PortMaterial

FRAUNHOFER_NM = {"C": 656.27, "d": 587.56, "F": 486.13}
"""Lines of hydrogen and helium at which dispersion is quoted: red, yellow, blue."""


def lateral_colour(
    rig: Rig,
    pixels: ArrayLike,
    *,
    object_distance_m: float,
    wavelengths_nm: Sequence[float] = tuple(FRAUNHOFER_NM.values()),
) -> FloatArray:
    """Shift of a point's image with wavelength, by the dispersion of port and water.

    Parameters
    ----------
    rig : Rig
        Its camera, port and water; the lens itself is taken to be free of lateral colour.
    pixels : array, shape (n, 2)
        Where the points appear at the wavelength of the geometry, 550 nm.
    object_distance_m : float
        From the port to the points, along the rays.
    wavelengths_nm : (k,)
        By default the lines C, d and F: red, yellow, blue.

    Returns
    -------
    array, shape (k, n, 2)
        Pixels relative to `pixels`; NaN where the pixel does not see the water.
    """
    if not 0 < object_distance_m < float("inf"):
        raise ValueError(f"expected object_distance_m > 0, got {object_distance_m!r}")
    pixels = check_points("pixels", pixels, 2)
    train = OpticalTrain.bare(rig)
    rays = train.trace(pixels)
    points = rays.origin_m + object_distance_m * rays.direction
    points[~rays.passed] = np.nan
    ports = [port_from_spec(rig.port, rig.water, wavelength) for wavelength in wavelengths_nm]
    return np.stack([replace(train, port=port).project(points).pixels - pixels for port in ports])


def abbe_number(material: PortMaterial) -> float:
    """``(n_d - 1) / (n_F - n_C)`` of a port material: the greater, the less it disperses."""
    n_c, n_d, n_f = (float(material_index(material, wavelength)) for wavelength in FRAUNHOFER_NM.values())
    return (n_d - 1) / (n_f - n_c)


def water_abbe_number(salinity_ppt: float, temperature_celsius: float) -> float:
    """``(n_d - 1) / (n_F - n_C)`` of water."""
    n_c, n_d, n_f = water_index(list(FRAUNHOFER_NM.values()), salinity_ppt, temperature_celsius)
    return float((n_d - 1) / (n_f - n_c))
