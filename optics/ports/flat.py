"""Flat ports: plane-parallel windows, tilted or not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from optics.kernels.arrays import opaque, opaque_vector, unit
from optics.kernels.backend import dr
from optics.kernels.refraction import window_transmittance
from optics.ports.interface import NEWTON_TOLERANCE, Exit, Window, check_positive, newton


@dataclass(frozen=True, kw_only=True)
class FlatPort(Window):
    """Plane-parallel window.

    Parameters
    ----------
    distance_m : float
        Pinhole to inner face, along the normal.
    thickness_m : float
    normal : (3,)
        Out of the housing, camera frame.
    n_inside, n_port, n_water : float
    aperture_radius_m : float, optional
        Clear radius around the foot of the normal through the pinhole, at the outer face; None: unbounded.
    """

    distance_m: float
    normal: ArrayLike = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_positive(self, "distance_m")
        unit("normal", self.normal)

    def parameters(self) -> dict[str, Any]:
        """Numbers of the port for the kernels."""
        return super().parameters() | {
            "normal": opaque_vector(unit("normal", self.normal)),
            "distance": opaque(self.distance_m),
            "thickness": opaque(self.thickness_m),
        }

    @staticmethod
    def trace(parameters: dict[str, Any], direction: Any) -> Exit:
        """Kernel: two refractions at parallel planes.

        The part of ``n direction`` along the planes is the same everywhere (Snell), so it is found once: no normal,
        and no direction inside the window, is needed.
        """
        normal, ratio_in = parameters["normal"], parameters["ratio_in"]
        ratio = ratio_in * parameters["ratio_out"]
        cosine = dr.dot(direction, normal)
        tangent = direction - normal * cosine
        sine2 = 1 - dr.square(cosine)
        port_square, water_square = 1 - dr.square(ratio_in) * sine2, 1 - dr.square(ratio) * sine2
        cosine_in_port, cosine_in_water = dr.safe_sqrt(port_square), dr.safe_sqrt(water_square)
        # distance / cosine + ratio_in thickness / cosine_in_port, with one division: they are what costs time here.
        stretch = (parameters["distance"] * cosine_in_port + ratio_in * parameters["thickness"] * cosine) / (
            cosine * cosine_in_port
        )
        outwards = cosine > 0
        inside = outwards & (sine2 * dr.square(stretch) <= dr.square(parameters["aperture"]))
        # A ray away from the window misses it: refraction has nothing to say about it.
        transmitted = ((port_square > 0) & (water_square > 0)) | ~outwards
        transmittance = window_transmittance(
            (cosine, cosine_in_port, cosine_in_port, cosine_in_water),
            (parameters["n_inside"], parameters["n_port"], parameters["n_water"]),
        )
        return Exit(
            point=tangent * stretch + normal * (parameters["distance"] + parameters["thickness"]),
            direction=tangent * ratio + normal * cosine_in_water,
            inside=inside,
            transmitted=transmitted,
            transmittance=dr.select(inside & transmitted, transmittance, 0),
        )

    @staticmethod
    def project(parameters: dict[str, Any], point: Any) -> tuple[Any, Any, Any]:
        """Kernel: Newton on the slope of the ray in the plane of refraction.

        With s the tangent of the angle in the medium of the lowest index, the ray meets the point's height at the
        radius ``sum(length_i tan_i(s))`` over air, window and water. Snell makes each tangent grow with s ever more
        slowly, so Newton climbs to the root from below without overshooting, and total reflection does not occur.
        """
        normal = parameters["normal"]
        height = dr.dot(point, normal)
        sideways = point - normal * height
        radius = dr.norm(sideways)
        depth = height - parameters["distance"] - parameters["thickness"]
        n_inside, n_port, n_water = (parameters[name] for name in ("n_inside", "n_port", "n_water"))
        lowest = dr.minimum(n_inside, dr.minimum(n_port, n_water))
        layers = (
            (parameters["distance"], lowest / n_inside),
            (parameters["thickness"], lowest / n_port),
            (depth, lowest / n_water),
        )

        def improved(slope: Any) -> tuple[tuple[Any], Any]:
            reached, rate = 0.0, 0.0
            # Sums are written out: += would change Dr.Jit's arrays in place.
            for length, ratio in layers:
                tangent, tangent_rate = _refracted_slope(slope, ratio)
                reached = reached + length * tangent
                rate = rate + length * tangent_rate
            step = (radius - reached) / rate
            slope = dr.maximum(slope + step, 0)
            return (slope,), dr.abs(step) <= NEWTON_TOLERANCE * (1 + slope)

        (slope,), converged = newton((_least_slope(radius, layers),), improved)
        outwards = dr.select(radius > 0, sideways / radius, 0)
        slope_inside, _ = _refracted_slope(slope, lowest / n_inside)
        return dr.normalize(normal + outwards * slope_inside), converged, depth > 0


def _least_slope(radius: Any, layers: tuple[tuple[Any, Any], ...]) -> Any:
    """Two lower bounds of the slope at which the layers are crossed over `radius`, the greater of them.

    One is the paraxial slope. The other gives every denser layer the tangent of its critical angle, the most it can
    reach; only layers of the lowest index go on growing. It is close where the water is near its critical angle.
    """
    paraxial = radius / sum(length * ratio for length, ratio in layers)
    unbounded, bounded = 0.0, 0.0
    for length, ratio in layers:
        lowest = ratio >= 1
        unbounded = unbounded + dr.select(lowest, length, 0)
        bounded = bounded + dr.select(lowest, 0, length * ratio * dr.rsqrt(1 - dr.square(ratio)))
    return dr.maximum(paraxial, (radius - bounded) / unbounded)


def _refracted_slope(slope: Any, ratio: Any) -> tuple[Any, Any]:
    """Tangent of the refracted angle for a tangent in the first medium, and its derivative.

    Under the root stands 1 + s^2 - (ratio s)^2. The difference of the squares is taken of the indices: for grazing rays
    the squares themselves cancel, and where a card rounds a product and a sum at once, not even to 1 for equal indices.
    """
    root = dr.rsqrt(dr.fma((1 - ratio) * (1 + ratio), dr.square(slope), 1))
    return ratio * slope * root, ratio * dr.square(root) * root
