"""Reflectance of coated aluminium mirrors in water: thin films by their characteristic matrices."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.kernels.arrays import FloatArray
from optics.kernels.tables import read_table
from optics.water.materials import DATA, aluminium_index, material_index
from optics.water.water import check_range
from rigs.mounting import MirrorCoating

Film = Literal["silica", "titania"]

DESIGN_NM = 550.0
"""Wavelength that the films are made for."""
FILMS: dict[MirrorCoating, tuple[tuple[Film, float], ...]] = {
    "bare-aluminium": (),
    "protected-aluminium": (("silica", 0.5),),
    "enhanced-aluminium": (("titania", 0.25), ("silica", 0.25)),
}
"""Films from the water inwards, each with its optical thickness in design wavelengths (H. A. Macleod, Thin-Film Optical
Filters, chapter on metal reflectors: a half wave protects, a low and a high quarter wave raise the reflectance)."""


def mirror_reflectance(
    coating: MirrorCoating, wavelength_nm: ArrayLike, cosine: ArrayLike, n_outside: ArrayLike
) -> FloatArray:
    """Unpolarised reflectance of a mirror by the characteristic matrices of its films (Macleod, section 2.6).

    Parameters
    ----------
    coating : str
        One of `FILMS`.
    wavelength_nm : array, shape (w,)
        In vacuum, 400 to 700 nm.
    cosine : array, shape (m,)
        Of the angle of incidence.
    n_outside : float or array, shape (w,)
        Index of what is before the mirror: water, or 1 for air.

    Returns
    -------
    array, shape (w, m)
    """
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)[:, None]
    outside = np.broadcast_to(np.asarray(n_outside, dtype=np.float64), wavelength.shape[:1])[:, None]
    cosine = np.asarray(cosine, dtype=np.float64)[None, :]
    invariant = outside**2 * (1 - cosine**2)
    n, k = aluminium_index(wavelength)
    metal = n - 1j * k
    reflected = []
    for polarisation in ("s", "p"):
        field: NDArray[np.complex128] = np.ones_like(metal * cosine)
        current = _admittance(metal, invariant, polarisation)
        for film, thickness in reversed(FILMS[coating]):
            index = film_index(film, wavelength)
            length = thickness * DESIGN_NM / film_index(film, np.array([DESIGN_NM])).real
            phase = 2 * np.pi * length / wavelength * np.sqrt(index**2 - invariant)
            own = _admittance(index, invariant, polarisation)
            field, current = (
                np.cos(phase) * field + 1j * np.sin(phase) / own * current,
                1j * own * np.sin(phase) * field + np.cos(phase) * current,
            )
        before = outside * cosine if polarisation == "s" else outside / cosine
        reflected.append(np.abs((before * field - current) / (before * field + current)) ** 2)
    return np.asarray((reflected[0] + reflected[1]) / 2)


def film_index(film: Film, wavelength_nm: ArrayLike) -> NDArray[np.complex128]:
    """Complex index ``n - ik`` of a film; silica as fused silica (Malitson), titania as measured on a film (Zhukovsky).

    Raises
    ------
    ValueError
        Outside 400-700 nm.
    """
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    if film == "silica":
        return np.asarray(material_index("fused-silica", wavelength), dtype=np.complex128)
    table = read_table(DATA / "titania_film_nk.csv")
    check_range("wavelength_nm", wavelength, table["wavelength_nm"][0], table["wavelength_nm"][-1])
    n, k = (np.interp(wavelength, table["wavelength_nm"], table[key]) for key in ("n", "k"))
    return np.asarray(n - 1j * k)


def _admittance(index: NDArray[np.complex128], invariant: FloatArray, polarisation: str) -> NDArray[np.complex128]:
    """Tilted optical admittance of a medium; `invariant` is the square of ``n sin(angle)``, the same in all media."""
    across = np.sqrt(index**2 - invariant)
    return np.asarray(across if polarisation == "s" else index**2 / across)
