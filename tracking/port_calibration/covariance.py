"""How well a calibration knows its parameters, and the combinations of them that are unobservable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from optics.kernels.arrays import FloatArray
from optics.perturbation.parameters import CAMERA, UNITS, shown_per_si, shown_unit
from optics.perturbation.port_camera import PortCamera
from tracking.calibration.combinations import in_words, sparse_basis

UNOBSERVABLE = 1.0
"""Standard deviation, in the sizes of `plausible_sizes`, from which on a combination counts as unobservable."""

PRIOR_SIZES = 2.0
"""Standard deviation of a prior in those sizes: what is observable at all hardly notices it."""

SHOWN = 0.1
"""Share of a combination's largest part below which a parameter is left out of its description."""


@dataclass(frozen=True, kw_only=True)
class PortCovariance:
    """Covariance of the parameters of cameras behind ports, in metres, radians, pixels and units of index.

    Attributes
    ----------
    names : tuple of str, length k
        `camera.parameter`, and `n_water`.
    matrix : array, shape (k, k)
        Of images and prior; the prior decides only what is unobservable.
    unobservable : tuple of str
        Combinations that the images tell nothing of, in words and units.
    """

    names: tuple[str, ...]
    matrix: FloatArray
    unobservable: tuple[str, ...]

    def standard_deviations(self) -> dict[str, float]:
        """Of each parameter."""
        return dict(zip(self.names, np.sqrt(np.maximum(np.diag(self.matrix), 0.0)).tolist(), strict=True))


def covariance_of(
    names: tuple[str, ...], information: FloatArray, prior: FloatArray, sizes: FloatArray
) -> PortCovariance:
    """Covariance by what the images say and the prior (inverse variances), and what is unobservable."""
    counted = information * np.outer(sizes, sizes)
    values, vectors = np.linalg.eigh(counted)
    matrix = np.linalg.pinv(counted + np.diag(prior * sizes**2), hermitian=True) * np.outer(sizes, sizes)
    unknown = sparse_basis(vectors[:, values <= UNOBSERVABLE**-2].T)
    units = [unit_of(name) for name in names]
    per_unit = np.array([per_si_of(name) for name in names]) * sizes
    words = tuple(in_words(row, names, units, per_unit, least_share=SHOWN) for row in unknown)
    return PortCovariance(names=names, matrix=matrix, unobservable=words)


def plausible_sizes(names: Sequence[str], cameras: dict[str, PortCamera], board_distance_m: float) -> FloatArray:
    """How far each parameter may be off without anybody's noticing: what a calibration has to know better."""
    sizes = []
    for name in names:
        camera, _, parameter = name.rpartition(".")
        of = cameras[camera] if camera in cameras else next(iter(cameras.values()))
        sizes.append(_size(parameter, of, board_distance_m))
    return np.array(sizes)


def unit_of(name: str) -> str:
    """Unit in which a parameter is shown."""
    return shown_unit(_plain(name))


def per_si_of(name: str) -> float:
    """Factor from the SI unit to `unit_of`."""
    return shown_per_si(_plain(name))


def _plain(name: str) -> str:
    """Parameter of `optics.perturbation.parameters` with the same unit."""
    parameter = name.rpartition(".")[2]
    if parameter in UNITS:
        return parameter
    return "m1_shift_x" if parameter.startswith("shift") else "m1_turn_x"


def prior_of(of: PortCamera, free: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Of what a lens and a port can be expected to be: they hold what the images say nothing of.

    The port is near where it was given. Focal length and principal point are free.
    """
    values = of.values()
    held = [name for name in free if name in values and name not in CAMERA]
    return {name: (values[name], PRIOR_SIZES * _size(name, of, 1.0)) for name in held}


def _size(parameter: str, of: PortCamera, board_distance_m: float) -> float:
    camera, values = of.camera, of.values()
    reach = np.hypot(camera.width_px, camera.height_px) / 2 / camera.fx_px
    powers = {"k1": 2, "k2": 4, "k3": 6, "k4": 2, "k5": 4, "k6": 6, "p1": 1, "p2": 1}
    if of.model == "fisheye":
        powers |= {"k3": 6, "k4": 8}
    sizes: dict[str, float] = {
        "fx": 0.02 * camera.fx_px,
        "fy": 0.02 * camera.fy_px,
        "cx": 0.02 * camera.width_px,
        "cy": 0.02 * camera.width_px,
        "n_water": 0.03,
        "n_port": 0.3,
        "port_thickness": 0.5 * values.get("port_thickness", 0.0),
        "port_radius": 0.2 * values.get("port_radius", 0.0),
        "port_distance": max(0.5 * values.get("port_distance", 0.0), 0.01),
    }
    sizes |= {f"port_centre_{axis}": 0.2 * values.get("port_radius", 0.0) for axis in "xyz"}
    sizes |= {f"shift_{axis}": 0.1 * board_distance_m for axis in "xyz"}
    if parameter in powers:
        return float(0.3 / reach ** powers[parameter])
    return float(sizes.get(parameter, float(np.radians(5))))
