"""Ports: the window between the camera's air and the water, in the camera frame (pinhole at the origin).

`leave` follows rays from the pinhole out into the water; `aim` is its inverse: the direction at the pinhole whose
refracted ray passes through a given point in the water.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from optics.arrays import check_vector, opaque, opaque_vector, unit
from optics.backend import Array3f64, dr
from optics.materials import material_index
from optics.refraction import refract, window_transmittance
from optics.water import water_index
from rigs import Port as PortSpec
from rigs import Water

AIM_ITERATIONS = 12
"""Newton steps of `aim`; four to six converge anywhere inside the field of view of a real port."""

AIM_TOLERANCE = 1e-13
"""Relative step of the last iteration under which the root counts as found."""


@dataclass(frozen=True, kw_only=True)
class Exit:
    """Rays behind the port: Dr.Jit arrays.

    `point` (metres) on the outer face, unit `direction` in the water, `inside` whether the ray is within the
    aperture, `transmitted` whether it was not totally reflected, `transmittance` Fresnel's for both faces together
    (without the light that is reflected twice inside the window), 0 for rays that do not get out.
    """

    point: Any
    direction: Any
    inside: Any
    transmitted: Any
    transmittance: Any


class Port(ABC):
    """What all ports share."""

    n_inside: float
    n_water: float

    @abstractmethod
    def parameters(self) -> dict[str, Any]:
        """Numbers of the port for the kernels, as Dr.Jit scalars and vectors."""

    @staticmethod
    @abstractmethod
    def leave(parameters: dict[str, Any], direction: Any) -> Exit:
        """Kernel: follow unit directions from the pinhole into the water."""

    @staticmethod
    @abstractmethod
    def aim(parameters: dict[str, Any], point: Any) -> tuple[Any, Any, Any]:
        """Kernel: unit direction at the pinhole towards a point in the water, as seen through the port.

        Returns the direction, whether the root converged, and whether the point is in the water at all.
        """


def _check_positive(port: Any, *names: str) -> None:
    for name in names:
        value = getattr(port, name)
        if value is not None and not (0 < value < float("inf")):
            raise ValueError(f"expected {name} > 0, got {value}")


def _indices(port: FlatPort | DomePort) -> dict[str, Any]:
    """Indices for the kernels, with the ratios at both faces: a kernel would divide anew for every ray."""
    return {
        "n_inside": opaque(port.n_inside),
        "n_port": opaque(port.n_port),
        "n_water": opaque(port.n_water),
        "ratio_in": opaque(port.n_inside / port.n_port),
        "ratio_out": opaque(port.n_port / port.n_water),
    }


@dataclass(frozen=True, kw_only=True)
class FlatPort(Port):
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
    thickness_m: float
    normal: ArrayLike = (0.0, 0.0, 1.0)
    n_inside: float = 1.0
    n_port: float = 1.49
    n_water: float = 1.333
    aperture_radius_m: float | None = None

    def __post_init__(self) -> None:
        _check_positive(self, "distance_m", "thickness_m", "n_inside", "n_port", "n_water", "aperture_radius_m")
        unit("normal", self.normal)

    def parameters(self) -> dict[str, Any]:
        """Numbers of the port for the kernels."""
        return {
            "normal": opaque_vector(unit("normal", self.normal)),
            "distance": opaque(self.distance_m),
            "thickness": opaque(self.thickness_m),
            **_indices(self),
            "aperture": opaque(self.aperture_radius_m or float("inf")),
        }

    @staticmethod
    def leave(parameters: dict[str, Any], direction: Any) -> Exit:
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
    def aim(parameters: dict[str, Any], point: Any) -> tuple[Any, Any, Any]:
        """Kernel: Newton on the slope of the ray in the plane of refraction.

        With s the tangent of the angle in the medium of the lowest index, the ray meets the point's height at the
        radius ``sum(length_i tan_i(s))`` over air, window and water. Snell makes each tangent grow with s ever more
        slowly, so Newton climbs to the root from below without overshooting, and total reflection is never met.
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
        slope = _least_slope(radius, layers)
        step = dr.zeros(type(radius), 1)
        for _ in range(AIM_ITERATIONS):
            reached, rate = 0.0, 0.0
            # Sums are written out: += would change Dr.Jit's arrays in place.
            for length, ratio in layers:
                tangent, tangent_rate = _refracted_slope(slope, ratio)
                reached = reached + length * tangent
                rate = rate + length * tangent_rate
            step = (radius - reached) / rate
            slope = dr.maximum(slope + step, 0)
        converged = dr.abs(step) <= AIM_TOLERANCE * (1 + slope)
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
    """Tangent of the refracted angle for a tangent in the first medium, and its derivative."""
    secant2 = 1 + dr.square(slope)
    root = dr.rsqrt(secant2 - dr.square(ratio * slope))
    return ratio * slope * root, ratio * dr.square(root) * root


@dataclass(frozen=True, kw_only=True)
class DomePort(Port):
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
    thickness_m: float
    n_inside: float = 1.0
    n_port: float = 1.49
    n_water: float = 1.333
    aperture_radius_m: float | None = None

    def __post_init__(self) -> None:
        _check_positive(self, "radius_m", "thickness_m", "n_inside", "n_port", "n_water", "aperture_radius_m")
        offset = float((check_vector("centre_m", self.centre_m) ** 2).sum() ** 0.5)
        if offset >= self.radius_m:
            raise ValueError(f"expected the pinhole inside the dome of radius_m {self.radius_m}, got it {offset} off")

    def parameters(self) -> dict[str, Any]:
        """Numbers of the port for the kernels."""
        return {
            "centre": opaque_vector(check_vector("centre_m", self.centre_m)),
            "inner": opaque(self.radius_m),
            "outer": opaque(self.radius_m + self.thickness_m),
            **_indices(self),
            "aperture": opaque(self.aperture_radius_m or float("inf")),
        }

    @staticmethod
    def leave(parameters: dict[str, Any], direction: Any) -> Exit:
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
    def aim(parameters: dict[str, Any], point: Any) -> tuple[Any, Any, Any]:
        """Kernel: Newton on the angle at the pinhole in the plane of refraction.

        That plane contains the centre, the pinhole and the point. In it ``n r sin(incidence)`` is conserved along
        the ray (Born & Wolf, section 3.2.1, spherical symmetry), so the polar angle it sweeps around the centre is a
        sum of arcsines of the angle at the pinhole; it must equal the polar angle of the point.
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
        target = dr.atan2(across, along)
        angle = target
        step = dr.zeros(type(distance), 1)
        steps_of_index = (
            (offset, parameters["inner"], parameters["n_inside"]),
            (parameters["inner"], parameters["outer"], parameters["n_port"]),
            (parameters["outer"], distance, parameters["n_water"]),
        )
        for _ in range(AIM_ITERATIONS):
            invariant = parameters["n_inside"] * offset * dr.sin(angle)
            rate_of_invariant = parameters["n_inside"] * offset * dr.cos(angle)
            # Sums are written out: += would change Dr.Jit's arrays in place, and with them `angle`.
            # At the pinhole the ray's angle to the radius is `angle` itself, beyond 90 degrees too.
            swept, rate = angle, 1.0
            for position, (near, far, index) in enumerate(steps_of_index):
                if position > 0:
                    sine = invariant / (index * near)
                    swept = swept + dr.safe_asin(sine)
                    rate = rate + rate_of_invariant / (index * near) * dr.rsqrt(1 - dr.square(sine))
                sine = invariant / (index * far)
                swept = swept - dr.safe_asin(sine)
                rate = rate - rate_of_invariant / (index * far) * dr.rsqrt(1 - dr.square(sine))
            step = (target - swept) / rate
            angle = dr.clip(angle + step, 0, dr.pi)
        converged = dr.abs(step) <= AIM_TOLERANCE * (1 + angle)
        outwards = dr.select(across > 0, sideways / across, 0)
        direction = axis * dr.cos(angle) + outwards * dr.sin(angle)
        return dr.normalize(direction), converged, distance > parameters["outer"]


def _exit_distance(start: Any, direction: Any, radius: Any) -> Any:
    """Distance along unit `direction` from `start` (relative to the centre, inside) to the sphere."""
    half_b = dr.dot(start, direction)
    return dr.sqrt(dr.square(half_b) - dr.squared_norm(start) + dr.square(radius)) - half_b


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
    def leave(parameters: dict[str, Any], direction: Any) -> Exit:
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
    def aim(parameters: dict[str, Any], point: Any) -> tuple[Any, Any, Any]:
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
