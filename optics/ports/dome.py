"""Dome ports: spherical shells, centred on the pinhole or not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from optics.kernels.arrays import check_vector, opaque, opaque_vector
from optics.kernels.backend import Array3f64, dr
from optics.kernels.refraction import refract, window_transmittance
from optics.ports.interface import NEWTON_TOLERANCE, Exit, Window, check_positive, newton


@dataclass(frozen=True, kw_only=True)
class DomePort(Window):
    """Spherical shell around `centre_m`; the pinhole (origin) must be inside.

    Parameters
    ----------
    centre_m : (3,)
        Centre of both spheres, camera frame; (0, 0, 0) is a centred dome, which refracts nothing.
    radius_m : float
        Inner face.
    thickness_m : float
    n_inside, n_port, n_water : float
    aperture_radius_m : float, optional
        Clear radius of the dome's rim around its axis (the camera's z through the centre); None: unbounded.
    """

    centre_m: ArrayLike = (0.0, 0.0, 0.0)
    radius_m: float

    def __post_init__(self) -> None:
        super().__post_init__()
        check_positive(self, "radius_m")
        offset = float((check_vector("centre_m", self.centre_m) ** 2).sum() ** 0.5)
        if offset >= self.radius_m:
            raise ValueError(f"expected the pinhole inside the dome of radius_m {self.radius_m}, got it {offset} off")

    def parameters(self) -> dict[str, Any]:
        """Numbers of the port for the kernels."""
        return super().parameters() | {
            "centre": opaque_vector(check_vector("centre_m", self.centre_m)),
            "inner": opaque(self.radius_m),
            "outer": opaque(self.radius_m + self.thickness_m),
        }

    @staticmethod
    def trace(parameters: dict[str, Any], direction: Any) -> Exit:
        """Kernel: two refractions at concentric spheres."""
        centre = parameters["centre"]
        at_inner = direction * _exit_distance(-centre, direction, parameters["inner"])
        inner_normal = (at_inner - centre) / parameters["inner"]
        in_port, entered = refract(direction, inner_normal, parameters["ratio_in"])
        at_outer = at_inner + in_port * _exit_distance(at_inner - centre, in_port, parameters["outer"])
        outer_normal = (at_outer - centre) / parameters["outer"]
        in_water, left = refract(in_port, outer_normal, parameters["ratio_out"])
        rim = dr.square(at_inner.x - centre.x) + dr.square(at_inner.y - centre.y)
        inside = (at_inner.z > centre.z) & (rim <= dr.square(parameters["aperture"]))
        transmittance = window_transmittance(
            (
                dr.dot(direction, inner_normal),
                dr.dot(in_port, inner_normal),
                dr.dot(in_port, outer_normal),
                dr.dot(in_water, outer_normal),
            ),
            (parameters["n_inside"], parameters["n_port"], parameters["n_water"]),
        )
        transmitted = entered & left
        return Exit(
            point=at_outer,
            direction=in_water,
            inside=inside,
            transmitted=transmitted,
            transmittance=dr.select(inside & transmitted, transmittance, 0),
        )

    @staticmethod
    def project(parameters: dict[str, Any], point: Any) -> tuple[Any, Any, Any]:
        """Kernel: Newton on the angle at the pinhole in the plane of refraction.

        That plane contains the centre, the pinhole and the point. In it ``b = n r sin(incidence)`` is conserved along
        the ray (Born & Wolf, section 3.2.1, spherical symmetry), so the polar angle it sweeps around the centre is a
        sum of arcsines ``asin(b / n r)``, which must equal the polar angle of the point. No arcsine is needed: each
        is a turn by the complex number ``sqrt((n r)^2 - b^2) + i b``, and the sine of the sum is the imaginary part
        of their product.
        """
        centre = parameters["centre"]
        offset = dr.norm(centre)
        # A centred dome has no preferred axis: any will do, for the swept angle is then the angle itself.
        axis = dr.select(offset > 0, -centre / offset, Array3f64(0, 0, 1))
        radial = point - centre
        distance = dr.norm(radial)
        along = dr.dot(radial, axis)
        sideways = radial - axis * along
        across = dr.norm(sideways)
        passages = (
            (parameters["n_inside"] * parameters["inner"], -1),
            (parameters["n_port"] * parameters["inner"], 1),
            (parameters["n_port"] * parameters["outer"], -1),
            (parameters["n_water"] * parameters["outer"], 1),
            (parameters["n_water"] * distance, -1),
        )
        # The length of the product, so that it ends on the unit circle.
        scale = dr.rcp(dr.prod([reach for reach, _ in passages]) * distance)
        target = (along * scale, across * scale)
        lever = parameters["n_inside"] * offset

        # The angle is kept as its cosine and sine.
        def improved(cosine: Any, sine: Any) -> tuple[tuple[Any, Any], Any]:
            invariant, rate_of_invariant = lever * sine, lever * cosine
            real, imaginary = cosine * target[0] + sine * target[1], sine * target[0] - cosine * target[1]
            # d asin(b / n r) / db = 1 / sqrt((n r)^2 - b^2): the sum of these is `fractions / product`.
            fractions, product = 0.0, 1.0
            for reach, sign in passages:
                root = dr.sqrt((reach - invariant) * (reach + invariant))
                turn = sign * invariant
                real, imaginary = real * root - imaginary * turn, imaginary * root + real * turn
                fractions, product = fractions * root + sign * product, product * root
            step = -imaginary * product / (product + rate_of_invariant * fractions)
            better = _unit(cosine - sine * step, dr.maximum(sine + cosine * step, 0))
            # The sine of the difference vanishes opposite to the point as well.
            return better, (dr.abs(step) <= NEWTON_TOLERANCE) & (real > 0)

        # Straight to the point is where a centred dome would have it.
        (cosine, sine), converged = newton(_unit(along - offset, across), improved)
        outwards = dr.select(across > 0, sideways / across, 0)
        return dr.normalize(axis * cosine + outwards * sine), converged, distance > parameters["outer"]


def _unit(x: Any, y: Any) -> tuple[Any, Any]:
    """Point of the unit circle in the direction of (x, y)."""
    length = dr.rsqrt(dr.square(x) + dr.square(y))
    return x * length, y * length


def _exit_distance(start: Any, direction: Any, radius: Any) -> Any:
    """Distance along unit `direction` from `start` (relative to the centre, inside) to the sphere."""
    half_b = dr.dot(start, direction)
    return dr.sqrt(dr.square(half_b) - dr.squared_norm(start) + dr.square(radius)) - half_b
