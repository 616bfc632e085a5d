"""The train beside prysm's ray tracer (Spencer & Murty 1962): the same surfaces, intersections and Snell by others.

prysm 0.21.1's own `raytrace` refracts at curved surfaces with normals that are not of unit length, which Snell's vector
form needs; its four steps are therefore called one by one, with the normal brought to unit length in between. Planes
have unit normals, and there `raytrace` is used as it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from prysm.experimental.raytracing.spencer_and_murty import (
    intersect,
    raytrace,
    refract,
    transform_to_global_coords,
    transform_to_local_coords,
)
from prysm.experimental.raytracing.surfaces import Surface
from scipy.spatial.transform import Rotation

from optics.camera import PinholeCamera
from optics.layout import Layout
from optics.ports.port import DomePort, FlatPort
from optics.status import Status
from optics.train import OpticalTrain, pixel_grid
from rigs import Rig

Q1, Q2 = 0.3, 0.2
"""Pose of the mirrors, radians: neither along an axis nor symmetric."""

MM = 1000.0

PROMISE_MM = 1e-9
"""Of positions on M2, and on a sphere of 10 m around it: directions are good to 1e-13."""

Bundle = tuple[NDArray[np.float64], NDArray[np.float64]]


def unbounded(port: FlatPort | DomePort) -> OpticalTrain:
    train = OpticalTrain.from_rig(Rig.load("aqua2"), q1=Q1, q2=Q2)
    mirrors = tuple(replace(mirror, outline=None) for mirror in train.mirrors)
    return replace(train, port=port, mirrors=mirrors)


def plane(point_m: NDArray[np.float64], normal: NDArray[np.float64], n: float | None = None) -> Surface:
    """Prysm's plane: z of its own frame is the normal; R takes global into local directions."""
    local = Rotation.align_vectors([[0.0, 0.0, 1.0]], [normal])[0].as_matrix()
    typ = "refl" if n is None else "refr"
    return Surface.plane(typ, MM * np.asarray(point_m), None if n is None else lambda _: n, R=local)


def mirrors() -> list[Surface]:
    layout = Layout.from_rig(Rig.load("aqua2"))
    poses = (layout.camera_from_m1, layout.camera_from_m2(Q1, Q2))
    return [plane(pose.translation, pose.rotation.as_matrix()[:, 2]) for pose in poses]


def through_flat(port: FlatPort, in_air: NDArray[np.float64]) -> Bundle:
    normal = np.asarray(port.normal) / np.linalg.norm(port.normal)
    faces = [
        plane(normal * port.distance_m, normal, port.n_port),
        plane(normal * (port.distance_m + port.thickness_m), normal, port.n_water),
    ]
    points, directions = raytrace([*faces, *mirrors()], np.zeros_like(in_air), in_air, 0.55, port.n_inside)
    return points[-1], directions[-1]


def through_dome(port: DomePort, in_air: NDArray[np.float64]) -> Bundle:
    point, direction, before = np.zeros_like(in_air), in_air, port.n_inside
    for radius, behind in ((port.radius_m, port.n_port), (port.radius_m + port.thickness_m, port.n_water)):
        # The vertex is where the sphere crosses its axis; the centre of curvature lies towards -z.
        vertex = MM * (np.asarray(port.centre_m) + np.array([0, 0, radius]))
        face = Surface.sphere(-1 / (MM * radius), "refr", vertex, lambda _: 1.0)
        local, along = transform_to_local_coords(point, face.P, direction, face.R)
        local, normal = intersect(local, along, face.sag_normal)
        along = refract(before, behind, along, normal / np.linalg.norm(normal, axis=1, keepdims=True))
        point, direction = transform_to_global_coords(local, face.P, along, face.R)
        before = behind
    points, directions = raytrace(mirrors(), point, direction, 0.55)
    return points[-1], directions[-1]


PORTS = {
    "flat": FlatPort(distance_m=0.02, thickness_m=0.008, n_port=1.4935, n_water=1.3427),
    "tilted": FlatPort(distance_m=0.02, thickness_m=0.008, n_port=1.4935, n_water=1.3427, normal=(0.1, -0.15, 1.0)),
    "dome": DomePort(centre_m=(0.002, -0.003, -0.008), radius_m=0.05, thickness_m=0.006, n_port=1.4935, n_water=1.3427),
}


@pytest.mark.parametrize("name", PORTS)
def test_the_train_is_prysm_s(name: str) -> None:
    """Two faces of a port and two mirrors: points on M2 and directions behind it, over the whole image."""
    port = PORTS[name]
    train = unbounded(port)
    assert isinstance(train.camera, PinholeCamera)
    # No pixel on the axis of a face: prysm divides by the distance from it.
    pixels = pixel_grid(train.camera, 64, 48)
    ours = train.trace(pixels)
    assert (ours.status == Status.OK).all()
    in_air = train.camera.unproject(pixels)[0]
    points, directions = through_flat(port, in_air) if isinstance(port, FlatPort) else through_dome(port, in_air)
    on_m2, at_10_m = np.abs(points - MM * ours.origin_m).max(), 10 * MM * np.abs(directions - ours.direction).max()
    print(f"{name}: {on_m2:.1e} mm on M2, {at_10_m:.1e} mm at 10 m")
    assert on_m2 < PROMISE_MM
    assert at_10_m < PROMISE_MM
