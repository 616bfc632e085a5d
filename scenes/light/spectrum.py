"""Spectra: at which wavelengths a frame is computed, what they weigh in each channel, and what surfaces reflect."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.linalg import block_diag, eigh_tridiagonal

from optics.kernels.arrays import FloatArray
from optics.kernels.tables import read_spectra, read_table
from rigs import Camera
from scenes.light.water_quadrature import water_rule

DATA = Path(__file__).parent / "data"

CHANNELS = ("red", "green", "blue")

CHANNEL_PEAKS_NM = (600.0, 540.0, 460.0)
CHANNEL_WIDTH_NM = 30.0
"""Gaussian response of the red, green and blue channel: nominal peaks and standard deviation of a Bayer sensor."""

NODES = 3
"""Wavelengths in each channel. `docs/explanation/water.md` has the error that three leave: below 3 % in green and blue,
up to 11 % in red behind 5 m of water (always too dark), because water's absorption rises like a step within the red
band."""

FINEST_STEP_NM = 0.25
"""A measured response is integrated at this step; it is a polygon, and so are the water's tables."""

LARGEST_SHARE_OUTSIDE = 0.05
"""Of a channel's response outside of 400 to 700 nm, where there are no numbers of water: what is cut off."""


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


@dataclass(frozen=True, kw_only=True, eq=False)
class CameraResponse:
    """Spectral response of a camera per unit of energy; a quantum efficiency has to be multiplied by its wavelength.

    Attributes
    ----------
    wavelength_nm : array, shape (k,)
        Ascending.
    response : array, shape (3, k)
        Rows red, green, blue, in any unit: each channel is brought to an integral of 1 over 400 to 700 nm.
    """

    wavelength_nm: FloatArray
    response: FloatArray


def read_camera_response(path: Path) -> CameraResponse:
    """Read a camera's response from a CSV with the columns wavelength_nm, red, green, blue.

    Raises
    ------
    ValueError
        With everything that is wrong with the file.
    """
    columns = read_spectra(path, required=CHANNELS)
    response = np.stack([columns[name] for name in CHANNELS])
    wavelength = columns["wavelength_nm"]
    for name, channel in zip(CHANNELS, response, strict=True):
        whole, part = float(np.trapezoid(channel, wavelength)), _quadrature(wavelength, channel)[1].sum()
        if not whole > 0:
            raise ValueError(f"{path}: expected a {name} response above zero, got none")
        if part < (1 - LARGEST_SHARE_OUTSIDE) * whole:
            raise ValueError(
                f"{path}: expected at least {1 - LARGEST_SHARE_OUTSIDE:.0%} of the {name} response between 400 and "
                f"700 nm, where water's properties are known, got {part / whole:.0%}"
            )
    return CameraResponse(wavelength_nm=wavelength, response=response)


@cache
def camera_bands(response: CameraResponse | None = None) -> Bands:
    """Three wavelengths for each channel, so that a band loses its red end first, as a real one does.

    They are the Gauss quadrature of the channel's own response: exact for it times a polynomial of degree five. The
    default response is Gaussian and nominal; its rule is Gauss-Hermite's.
    """
    if response is None:
        nodes, weights = np.polynomial.hermite_e.hermegauss(NODES)
        rules = [(peak + CHANNEL_WIDTH_NM * nodes, weights / weights.sum()) for peak in CHANNEL_PEAKS_NM]
    else:
        rules = [gauss_rule(*_quadrature(response.wavelength_nm, channel), NODES) for channel in response.response]
    return _bands(rules)


@cache
def water_bands(response: CameraResponse | None = None) -> Bands:
    """As `camera_bands`, with wavelengths and weights chosen for colours seen through water: see `water_rule`.

    Fitted to the 24 patches of the ColorChecker in sunlight and to light that has no colour. In red, where a Gauss rule
    is wrong by some 15 %, it is wrong by some 3 %; `docs/explanation/water.md` has the table.
    """
    if response is None:
        points = np.arange(400, 700 + FINEST_STEP_NM / 2, FINEST_STEP_NM)
        channels = [(points, np.exp(-0.5 * ((points - peak) / CHANNEL_WIDTH_NM) ** 2)) for peak in CHANNEL_PEAKS_NM]
    else:
        channels = [_quadrature(response.wavelength_nm, channel) for channel in response.response]
    return _bands([water_rule(points, weights, _colours(points), NODES) for points, weights in channels])


def _colours(wavelength_nm: FloatArray) -> FloatArray:
    """Spectra that are seen: the chart's patches in the sun, and one that is flat; shape (25, k)."""
    table = read_table(DATA / "colorchecker_babelcolor_reflectance.csv")
    sunlight = sun_irradiance(wavelength_nm)[0]
    patches = [reflectance(name, wavelength_nm) * sunlight for name in table if name != "wavelength_nm"]
    return np.stack([np.ones_like(wavelength_nm), *patches])


def _bands(rules: list[tuple[FloatArray, FloatArray]]) -> Bands:
    return Bands(
        wavelength_nm=np.concatenate([nodes for nodes, _ in rules]),
        weight=np.asarray(block_diag(*(weights for _, weights in rules)), dtype=np.float64),
    )


def bands_of_camera(camera: Camera) -> Bands:
    """Bands of a rig's camera: by its `response_file`, or the nominal ones."""
    return water_bands() if camera.response_file is None else water_bands(read_camera_response(camera.response_file))


def _quadrature(wavelength_nm: FloatArray, channel: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points within 400 to 700 nm and the response that each stands for (trapezoidal rule)."""
    points = np.arange(400, 700 + FINEST_STEP_NM / 2, FINEST_STEP_NM)
    weights = np.interp(points, wavelength_nm, channel, left=0, right=0) * FINEST_STEP_NM
    weights[[0, -1]] /= 2
    return points, weights


def gauss_rule(points: FloatArray, weights: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Gauss quadrature of a measure that is given by many points and weights: nodes (count,) and weights (count,).

    The recurrence of its orthogonal polynomials (Stieltjes) is a tridiagonal matrix, whose eigenvalues are the nodes
    (Golub & Welsch 1969, Mathematics of Computation 23, 221). The weights sum to 1.
    """
    share = weights / weights.sum()
    centre = share @ points
    spread = np.sqrt(share @ (points - centre) ** 2)
    x = (points - centre) / spread
    diagonal: list[float] = []
    beside: list[float] = []
    before, here = np.zeros_like(x), np.ones_like(x)
    for _ in range(count):
        diagonal.append(share @ (x * here**2))
        after = (x - diagonal[-1]) * here - (beside[-1] if beside else 0.0) * before
        beside.append(np.sqrt(share @ after**2))
        before, here = here, after / beside[-1]
    nodes, vectors = eigh_tridiagonal(np.array(diagonal), np.array(beside[:-1]))
    return centre + spread * nodes, np.asarray(vectors[0] ** 2)


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
