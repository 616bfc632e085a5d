"""Spectra: at which wavelengths a frame is computed, what they weigh in each channel, and what things reflect."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from optics.tables import read_table

FloatArray = NDArray[np.float64]

DATA = Path(__file__).parent / "data"

CHANNEL_PEAKS_NM = (600.0, 540.0, 460.0)
CHANNEL_WIDTH_NM = 30.0
"""Gaussian response of the red, green and blue channel: nominal peaks and standard deviation of a Bayer sensor."""

HERMITE_NODES = (-np.sqrt(3.0), 0.0, np.sqrt(3.0))
HERMITE_WEIGHTS = (1 / 6, 2 / 3, 1 / 6)
"""Three-point Gauss-Hermite rule: exact for a Gaussian band times a polynomial of degree five in wavelength."""


@dataclass(frozen=True, kw_only=True)
class Bands:
    """Quadrature of the camera's response.

    Attributes
    ----------
    wavelength_nm : array, shape (w,)
    weight : array, shape (3, w)
        Rows red, green, blue, each summing to 1.
    """

    wavelength_nm: FloatArray
    weight: FloatArray


@cache
def camera_bands() -> Bands:
    """Three wavelengths for each channel, so that a band loses its red end first, as a real one does."""
    nodes = [peak + CHANNEL_WIDTH_NM * node for peak in CHANNEL_PEAKS_NM for node in HERMITE_NODES]
    weight = np.kron(np.eye(len(CHANNEL_PEAKS_NM)), HERMITE_WEIGHTS)
    return Bands(wavelength_nm=np.array(nodes), weight=np.asarray(weight, dtype=np.float64))


def reflectance(patch: str, wavelength_nm: FloatArray) -> FloatArray:
    """Diffuse reflectance of a ColorChecker patch (average of 30 charts, BabelColor)."""
    table = read_table(DATA / "colorchecker_babelcolor_reflectance.csv")
    patches = [name for name in table if name != "wavelength_nm"]
    if patch not in patches:
        raise ValueError(f"expected a ColorChecker patch ({', '.join(patches)}), got {patch!r}")
    return np.asarray(np.interp(wavelength_nm, table["wavelength_nm"], table[patch]))


def sun_irradiance(wavelength_nm: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Direct normal irradiance of the sun and diffuse irradiance of the sky at sea level, W / (m^2 nm).

    ASTM G173-03. Its global column is for a surface tilted by 37 degrees with the sun 11.2 degrees off its normal;
    what the direct beam does not explain of it is taken as the sky's.
    """
    table = read_table(DATA / "astm_g173_350_750.csv")
    direct = np.interp(wavelength_nm, table["wavelength_nm"], table["direct_circumsolar"])
    total = np.interp(wavelength_nm, table["wavelength_nm"], table["global_tilt"])
    return np.asarray(direct), np.asarray(total - direct * np.cos(np.radians(11.2)))
