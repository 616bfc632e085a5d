"""A camera behind a port: its derivatives, and the inverse of its projection."""

import numpy as np
import pytest

from optics import DomePort, FisheyeCamera, FlatPort, NoPort, PinholeCamera
from optics.perturbation.port_camera import PortCamera, parameters_of

SIZE = {"width_px": 1920, "height_px": 1080, "fx_px": 1400.0, "fy_px": 1410.0, "cx_px": 960.0, "cy_px": 540.0}
LENSES = {
    "brown": PinholeCamera(**SIZE, distortion=(-0.1, 0.02, 1e-3, 2e-3, 0.01)),
    "rational": PinholeCamera(**SIZE, distortion=(-0.1, 0.02, 1e-3, 2e-3, 0.01, 0.01, 0.01, 0.01)),
    "fisheye": FisheyeCamera(**SIZE, distortion=(0.01, 0.02, 0.001, 0.001)),
}
PORTS = {
    "flat": FlatPort(distance_m=0.03, thickness_m=0.01, normal=(0.4, -0.3, 1)),
    "dome": DomePort(centre_m=(0.002, 0.001, -0.004), radius_m=0.05, thickness_m=0.006),
    "none": NoPort(),
}
STEP = 1e-6
OF_CENTRAL_DIFFERENCES = 2e-5
"""Rounding of 1e-13 of a pixel's 1e3, over twice the step, beside the largest derivative of each parameter."""


@pytest.mark.parametrize("port", PORTS)
@pytest.mark.parametrize("lens", LENSES)
def test_derivatives_are_those_of_central_differences(lens, port):
    camera = PortCamera(camera=LENSES[lens], port=PORTS[port])
    points = np.random.default_rng(0).uniform((-0.3, -0.2, 0.6), (0.3, 0.2, 1.2), (40, 3))
    names = parameters_of(camera.model, camera.shape)
    found = camera.jacobian(points, names)
    np.testing.assert_allclose(found.outputs, camera.project(points), atol=1e-9)
    for name in names:
        step = STEP * max(abs(camera.values()[name]), 0.01)
        sides = [camera.moved({name: sign * step}).project(points) for sign in (1, -1)]
        wanted = (sides[0] - sides[1]) / (2 * step)
        scale = np.abs(wanted).max() + 1e-9
        np.testing.assert_allclose(found.of(name) / scale, wanted / scale, atol=OF_CENTRAL_DIFFERENCES, err_msg=name)


@pytest.mark.parametrize("port", PORTS)
def test_rays_pass_through_the_points_that_are_seen(port):
    camera = PortCamera(camera=LENSES["brown"], port=PORTS[port])
    point = np.array([[0.1, -0.05, 0.9]])
    origin, direction = camera.rays(camera.project(point))
    assert np.linalg.norm(np.cross(point - origin, direction)) < 1e-12


def test_values_come_back():
    for port in PORTS.values():
        camera = PortCamera(camera=LENSES["fisheye"], port=port)
        again = camera.moved({"fx": 1.0}).moved({"fx": -1.0})
        assert again.values() == pytest.approx(camera.values(), abs=1e-12)


def test_a_step_leaves_lengths_positive_and_the_pinhole_inside_the_dome():
    flat = PortCamera(camera=LENSES["brown"], port=PORTS["flat"]).moved({"port_distance": -1.0, "fx": -1e6})
    assert flat.values()["port_distance"] == pytest.approx(0.25 * 0.03)
    assert flat.values()["fx"] == pytest.approx(0.25 * 1400)
    dome = PortCamera(camera=LENSES["brown"], port=PORTS["dome"]).moved({"port_centre_z": 1.0})
    assert np.linalg.norm(dome.port.centre_m) == pytest.approx(0.95 * 0.05)
