"""Kernels of the perturbed train: camera, port and mirrors of every lane, traced and projected.

A lane is one built rig at one pair of joint values, or one of its points. What perturbs it is a number per lane, by
name; what has no number is nominal, and costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

from optics.camera import Camera
from optics.kernels.arrays import opaque, opaque_vector
from optics.kernels.backend import Array3f64, dr
from optics.kernels.freezing import frozen
from optics.layout import FACE_ELEVATION_AT_ZERO, Layout
from optics.mirror import MirrorPlane, reflect_over, unfold
from optics.perturbation.parameters import CAMERA, DISTORTION, POINT, PORT_CENTRE
from optics.ports.interface import Port

PIXEL = ("u", "v")
ON_FACE = ("face_x", "face_y")
"""A point of M2's face in its axes, metres: it is seen over M1 alone."""


@dataclass(frozen=True, kw_only=True)
class Kind:
    """What the compiled kernels depend on: the camera's model in the rig file, whether it distorts, and the port."""

    model: str
    camera: type[Camera]
    distorted: bool
    port: type[Port]

    def distorts(self, lanes: dict[str, Any]) -> bool:
        """Whether some lane may: a lens without distortion, too, can be perturbed by some."""
        return self.distorted or any(name in lanes for name in DISTORTION[self.model])


Kernel = Callable[..., Any]
"""Function of the kind, the nominal numbers, the lanes by name, and options that are no arrays."""


@cache
def compiled(kernel: Kernel, kind: Kind, names: tuple[str, ...], *options: Any) -> Callable[..., Any]:
    """Frozen form of a kernel for lanes of some names: a function of the nominal numbers and the lanes."""

    @frozen()
    def call(numbers: dict[str, Any], lanes: dict[str, Any]) -> Any:
        return kernel(kind, numbers, lanes, *options)

    return call


def rays(kind: Kind, numbers: dict[str, Any], lanes: dict[str, Any]) -> tuple[Any, Any]:
    """Kernel: point on the last surface and direction behind it of each lane's pixel."""
    numbers = perturbed(kind, numbers, lanes)
    in_air, valid = kind.camera.direction(numbers["camera"], kind.distorts(lanes), *(lanes[name] for name in PIXEL))
    origin, direction, transmitted = traced(kind, numbers, lanes, in_air)
    out = valid & transmitted
    return dr.select(out, origin, dr.nan), dr.select(out, direction, dr.nan)


def pixels(kind: Kind, numbers: dict[str, Any], lanes: dict[str, Any]) -> tuple[Any, Any]:
    """Kernel: pixel of each lane's point."""
    numbers = perturbed(kind, numbers, lanes)
    _, (u, v), found = projected(kind, numbers, lanes)
    return dr.select(found, u, dr.nan), dr.select(found, v, dr.nan)


def mirror_frames(kind: Kind, numbers: dict[str, Any], lanes: dict[str, Any]) -> list[list[Any]]:
    """Kernel: origin, x, y and normal of each lane's M1 and M2."""
    # Selected by lane: M1 does not depend on the joints, and would not be as wide.
    known = dr.isfinite(lanes["q1"])
    mirrors = perturbed(kind, numbers, lanes)["mirrors"]
    frames = [(mirror.point, mirror.x, mirror.y, mirror.normal) for mirror in mirrors]
    return [[dr.select(known, vector, dr.nan) for vector in frame] for frame in frames]


def traced(kind: Kind, numbers: dict[str, Any], lanes: dict[str, Any], in_air: Any) -> tuple[Any, Any, Any]:
    """Kernel: follow rays from the pinhole through the port and over the mirrors.

    Returns the point on the last surface, the direction behind it, and whether the port lets the ray out.
    """
    exit_ = kind.port.trace(numbers["port"], in_air)
    point, direction = exit_.point, exit_.direction
    for hit in reflect_over(numbers["mirrors"], point, direction):
        point, direction = hit.point, hit.direction
    return _mirrored(lanes, point, exit_.point), _mirrored(lanes, direction, exit_.direction), exit_.transmitted


def unfolded(numbers: dict[str, Any], lanes: dict[str, Any]) -> Any:
    """Kernel: where the point of each lane appears to be behind the port: its image over the mirrors."""
    mirrors = numbers["mirrors"]
    if ON_FACE[0] in lanes:
        m1, m2 = mirrors
        return unfold(m1, m2.point + m2.x * lanes["face_x"] + m2.y * lanes["face_y"])
    point = Array3f64(*(lanes[name] for name in POINT))
    image = point
    for mirror in reversed(mirrors):
        image = unfold(mirror, image)
    return _mirrored(lanes, image, point)


def _mirrored(lanes: dict[str, Any], over_mirrors: Any, past_them: Any) -> Any:
    """What each lane shows: over the mirrors, or past them where it has no joint values."""
    return dr.select(lanes["mirrored"] > 0, over_mirrors, past_them) if "mirrored" in lanes else over_mirrors


def projected(kind: Kind, numbers: dict[str, Any], lanes: dict[str, Any]) -> tuple[Any, tuple[Any, Any], Any]:
    """Kernel: direction in air towards each lane's point, its pixel, and whether there is one."""
    in_air, converged, in_water = kind.port.project(numbers["port"], unfolded(numbers, lanes))
    u, v, valid = kind.camera.pixel(numbers["camera"], kind.distorts(lanes), in_air)
    return in_air, (u, v), converged & in_water & valid


def perturbed(kind: Kind, numbers: dict[str, Any], lanes: dict[str, Any]) -> dict[str, Any]:
    """Kernel: numbers of camera, port and mirrors with each lane's perturbations; nominal where it has none."""
    return {
        "camera": _camera(kind.model, numbers["camera"], lanes),
        "port": _port(numbers["port"], lanes),
        "mirrors": _mirrors(numbers["mirrors"], lanes) if "mirrors" in numbers else [],
    }


def _camera(model: str, camera: dict[str, Any], lanes: dict[str, Any]) -> dict[str, Any]:
    camera = camera | {f"{name}_px": camera[f"{name}_px"] + lanes.get(name, 0) for name in CAMERA}
    coefficients = zip(DISTORTION[model], camera["coefficients"], strict=True)
    return camera | {
        "per_fx": 1 / camera["fx_px"],
        "per_fy": 1 / camera["fy_px"],
        "coefficients": [value + lanes.get(name, 0) for name, value in coefficients],
    }


def _port(port: dict[str, Any], lanes: dict[str, Any]) -> dict[str, Any]:
    if not port:
        return port
    n_port, n_water = (port[name] + lanes.get(name, 0) for name in ("n_port", "n_water"))
    indices = {"ratio_in": port["n_inside"] / n_port, "ratio_out": n_port / n_water, "n_port": n_port}
    thickness = lanes.get("port_thickness", 0)
    if "normal" in port:
        axes = _turned([Array3f64(1, 0, 0), Array3f64(0, 1, 0), Array3f64(0, 0, 1)], lanes, "port_tilt")
        shape = {
            "normal": sum(axis * part for axis, part in zip(axes, port["normal"], strict=True)),
            "distance": port["distance"] + lanes.get("port_distance", 0),
            "thickness": port["thickness"] + thickness,
        }
    else:
        radius = lanes.get("port_radius", 0)
        shape = {
            "centre": port["centre"] + Array3f64(*(lanes.get(name, 0) for name in PORT_CENTRE)),
            "inner": port["inner"] + radius,
            "outer": port["outer"] + radius + thickness,
        }
    return port | indices | {"n_water": n_water} | shape


def mirror_numbers(layout: Layout) -> dict[str, Any]:
    """Nominal mirrors and joints as inputs of the kernels."""
    frames = {"m1": layout.camera_from_m1, "gimbal": layout.camera_from_gimbal}
    return {
        **{name: opaque_vector(frame.translation) for name, frame in frames.items()},
        **{f"{name}_axes": list(map(opaque_vector, frame.rotation.as_matrix().T)) for name, frame in frames.items()},
        "fold": opaque_vector(layout.fold_direction),
        "pan": (opaque(layout.pan.sign), opaque(layout.pan.angle(0.0))),
        "elevation": (opaque(layout.tilt.sign), opaque(FACE_ELEVATION_AT_ZERO + layout.tilt.angle(0.0))),
    }


def _mirrors(numbers: dict[str, Any], lanes: dict[str, Any]) -> list[MirrorPlane]:
    """Kernel: M1 and M2 in the camera frame, unbounded."""
    axial = Array3f64(0, 0, lanes.get("fold_mirror_distance", 0))
    axes = _turned(numbers["m1_axes"], lanes, "m1_turn")
    m1 = _mirror(_shifted(numbers["m1"] + axial, axes, lanes, "m1_shift"), axes)

    origin, axes = numbers["gimbal"] + axial, numbers["gimbal_axes"]
    origin = _shifted(origin + numbers["fold"] * lanes.get("gaze_mirror_distance", 0), axes, lanes, "gimbal_shift")
    axes = _turned(axes, lanes, "gimbal_turn")
    axes = _about(axes, 2, _joint(numbers["pan"], lanes["q1"], lanes.get("pan_offset", 0)))
    origin = _shifted(origin, axes, lanes, "tilt_axis_shift")
    x, y, z = _turned(axes, lanes, "tilt_axis_turn")
    # M2's x is the tilt axis, the pan frame's y; a positive tilt raises the normal, against it.
    axes = _about([y, z, x], 0, -_joint(numbers["elevation"], lanes["q2"], lanes.get("tilt_offset", 0)))
    axes = _turned(axes, lanes, "m2_turn")
    return [m1, _mirror(_shifted(origin, axes, lanes, "m2_shift"), axes)]


def _joint(numbers: tuple[Any, Any], q: Any, offset: Any) -> Any:
    sign, at_zero = numbers
    return sign * q + at_zero + offset


def _mirror(point: Any, axes: list[Any]) -> MirrorPlane:
    x, y, normal = axes
    return MirrorPlane(point=point, x=x, y=y, normal=normal)


def _shifted(point: Any, axes: list[Any], lanes: dict[str, Any], parameter: str) -> Any:
    """A point shifted along a frame's axes, where there is such a parameter."""
    for axis, name in zip(axes, "xyz", strict=True):
        point = point + axis * lanes.get(f"{parameter}_{name}", 0)
    return point


def _turned(axes: list[Any], lanes: dict[str, Any], parameter: str) -> list[Any]:
    """Axes of a frame turned about its own x, y and z in this order, where there is such a parameter."""
    for index, name in enumerate("xyz"):
        if f"{parameter}_{name}" in lanes:
            axes = _about(axes, index, lanes[f"{parameter}_{name}"])
    return axes


def _about(axes: list[Any], index: int, angle: Any) -> list[Any]:
    """Axes of a frame turned about one of them."""
    sine, cosine = dr.sincos(angle)
    first, second = axes[index - 2], axes[index - 1]
    turned = [axes[index], cosine * first + sine * second, cosine * second - sine * first]
    return [turned[(axis - index) % 3] for axis in range(3)]
