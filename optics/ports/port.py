"""Ports: flat, dome or none, and the one that a rig file asks for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from optics.kernels.backend import Array3f64, dr
from optics.ports.dome import DomePort
from optics.ports.flat import FlatPort
from optics.ports.interface import Exit, Port
from optics.water.materials import material_index
from optics.water.water import water_index
from rigs import Port as PortSpec
from rigs import Water

__all__ = ["GEOMETRY_WAVELENGTH_NM", "DomePort", "Exit", "FlatPort", "NoPort", "Port", "port_from_spec"]


@dataclass(frozen=True, kw_only=True)
class NoPort(Port):
    """No window: camera and scene share one medium."""

    n_inside: float = 1.0

    @property
    def n_water(self) -> float:  # type: ignore[override]
        """Index outside, which is the index inside."""
        return self.n_inside

    def parameters(self) -> dict[str, Any]:
        """Nothing to hand to the kernels."""
        return {}

    @staticmethod
    def trace(parameters: dict[str, Any], direction: Any) -> Exit:
        """Kernel: rays go on as they are."""
        everywhere = dr.mask_t(direction.x)(True)
        # Made from the direction: a literal of its width would stay at the width that the kernel was frozen with.
        known = dr.isfinite(direction.x)
        return Exit(
            point=dr.select(known, Array3f64(0), direction),
            direction=direction,
            inside=everywhere,
            transmitted=everywhere,
            transmittance=dr.select(known, type(direction.x)(1), 0),
        )

    @staticmethod
    def project(parameters: dict[str, Any], point: Any) -> tuple[Any, Any, Any]:
        """Kernel: straight towards the point."""
        return dr.normalize(point), dr.mask_t(point.x)(True), dr.squared_norm(point) > 0


GEOMETRY_WAVELENGTH_NM = 550.0
"""Wavelength at which geometry is computed: the middle of the visible, near water's clearest band."""


def port_from_spec(spec: PortSpec, water: Water, wavelength_nm: float = GEOMETRY_WAVELENGTH_NM) -> Port:
    """Port of a rig file's `[port]` section, in that rig's water."""
    if spec.shape == "none":
        return NoPort()
    indices = {
        "n_inside": 1.0,
        "n_port": float(material_index(spec.material, wavelength_nm)),
        "n_water": float(water_index(wavelength_nm, water.salinity_ppt, water.temperature_celsius)),
        "aperture_radius_m": spec.aperture_diameter_mm / 2000,
        "thickness_m": spec.thickness_mm / 1000,
    }
    if spec.shape == "flat":
        return FlatPort(distance_m=spec.distance_mm / 1000, normal=spec.normal, **indices)
    centre = tuple(component / 1000 for component in spec.centre_mm)
    return DomePort(centre_m=centre, radius_m=spec.inner_radius_mm / 1000, **indices)
