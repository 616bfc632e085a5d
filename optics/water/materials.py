"""Materials: the index of port windows and the reflectance of mirror metals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optics.kernels.tables import read_table
from optics.water.water import check_range
from rigs.port import PortMaterial

DATA = Path(__file__).parent / "data"

FORMULA_RANGE_NM = (400.0, 1050.0)
"""Where every port material's formula may be used. Measurements of PMMA begin at 405 nm, of polycarbonate at 437 nm:
below, down to the edge of the visible, their formulas are extrapolated."""

PORT_MATERIALS: dict[PortMaterial, str] = {
    "pmma": "PMMA_Szczurowski2013",
    "polycarbonate": "polycarbonate_Sultanova2009",
    "n-bk7": "N-BK7_Schott",
    "borofloat33": "BOROFLOAT33_Schott",
    "sapphire": "sapphire_o_Malitson1972",
    "fused-silica": "fused_silica_Malitson1965",
}
"""Which data set stands behind each name (sapphire: the ordinary ray)."""


def material_index(material: PortMaterial, wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    """Refractive index of a port material from its dispersion formula (refractiveindex.info, CC0).

    Raises
    ------
    ValueError
        Outside 400-1050 nm.
    """
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    check_range("wavelength_nm", wavelength, *FORMULA_RANGE_NM)
    record = json.loads((DATA / "port_materials.json").read_text(encoding="utf-8"))["materials"][
        PORT_MATERIALS[material]
    ]
    coefficients = record["coefficients"]
    constant, pairs = coefficients[0], zip(coefficients[1::2], coefficients[2::2], strict=True)
    squared = (wavelength / 1000) ** 2
    match record["formula"]:
        case "formula 1":
            terms = [b * squared / (squared - c**2) for b, c in pairs]
        case "formula 2":
            terms = [b * squared / (squared - c) for b, c in pairs]
        case other:
            raise ValueError(f"expected formula 1 or 2 for {material}, got {other}")
    return np.asarray(np.sqrt(1 + constant + sum(terms)))


def aluminium_index(wavelength_nm: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Complex index n, k of aluminium (McPeak et al. 2015, ACS Photonics 2, 326; refractiveindex.info, CC0).

    Raises
    ------
    ValueError
        Outside the table, 400-700 nm.
    """
    table = read_table(DATA / "metal_nk.csv")
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    check_range("wavelength_nm", wavelength, table["wavelength_nm"][0], table["wavelength_nm"][-1])
    return (
        np.asarray(np.interp(wavelength, table["wavelength_nm"], table["Al_McPeak2015_n"])),
        np.asarray(np.interp(wavelength, table["wavelength_nm"], table["Al_McPeak2015_k"])),
    )
